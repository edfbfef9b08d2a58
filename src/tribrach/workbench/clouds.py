"""The clouds of a result as the page loads them: COPC, with ranges of what they are coloured by.

Clouds of a run in COPC are used as they are. Others are converted once: the copies lie among what
is remembered beside the results, under the digest of the file that each was made from, so that a
cloud of another run is converted anew and no other. Where nothing may be written beside the
results, they lie in a temporary folder as long as the program runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Progress
from tribrach.io.clouds.copc_head import CopcHead, is_copc, read_copc_head
from tribrach.io.keeping import STATE_FOLDER, keeping
from tribrach.job.convert import as_copc
from tribrach.job.each import Item, each, facts_alone
from tribrach.job.poses import PoseFile
from tribrach.job.state import Remembered
from tribrach.workbench.result_folder import CLOUDS

__all__ = ["SceneCloudFile", "cloud_parts", "convert_clouds", "written_clouds"]

#: shares of the points that lie below the ends of a range of colours
_LOW, _HIGH = 5.0, 95.0
#: what points are coloured by: title and unit
_ATTRIBUTES = {
    "sigma": ("3D sigma", "m"),
    "sigma_x": ("sigma of the first coordinate", "m"),
    "sigma_y": ("sigma of the second coordinate", "m"),
    "sigma_z": ("sigma of the third coordinate", "m"),
    "correlation_xy": ("correlation of the first and second coordinate", ""),
    "correlation_xz": ("correlation of the first and third coordinate", ""),
    "correlation_yz": ("correlation of the second and third coordinate", ""),
    "incidence": ("incidence", "°"),
    "intensity": ("intensity", ""),
    "distance": ("distance", "m"),
    "classification": ("class", ""),
}
#: along the axes of a frame that has heights
_AXES = {"sigma_x": "sigma E", "sigma_y": "sigma N", "sigma_z": "sigma of heights"}


@dataclass(frozen=True)
class SceneCloudFile:
    """A cloud of a scene.

    Parameters
    ----------
    name
        Of the cloud, as the page calls it.
    file
        Name of the COPC file as the page asks for it.
    path
        The file itself.
    source
        Name of the file that the run wrote.
    """

    name: str
    file: str
    path: Path
    source: str


def written_clouds(result: Mapping[str, Any], folder: Path) -> list[Path]:
    """Clouds that a run wrote and that are still there, in its order.

    Parameters
    ----------
    result : mapping
        Keys of ``result.json``.
    folder : Path
        Folder of the results.

    Returns
    -------
    list of Path
        Files directly in the folder of clouds; names that lead elsewhere, and links, are left out.
    """
    place = folder / CLOUDS
    files = [str(cloud["file"]) for cloud in (result.get("scans") or {}).get("clouds", [])]
    paths = [place / name for name in dict.fromkeys(files) if name not in ("", ".", "..")]
    return [p for p in paths if p.parent == place and p.is_file() and not p.is_symlink()]


def convert_clouds(
    paths: Sequence[Path],
    folder: Path,
    progress: Progress,
    ready: Callable[[SceneCloudFile], None],
) -> None:
    """Give clouds as COPC one after the other, the smallest first; convert those that are none.

    Parameters
    ----------
    paths : sequence of Path
        Clouds of a run.
    folder : Path
        Folder of the results, beside which copies are kept; it may be one where nothing can be
        written by somebody who only looks, then it is not that of the results.
    progress : Progress
        Told of points done; what it raises ends the work, and nothing half-written remains.
    ready : function
        Told of each cloud that can be loaded.

    Raises
    ------
    InputError
        A cloud that cannot be read, a copy that cannot be written.
    """
    state = Remembered(folder)
    for path in sorted(paths, key=lambda path: path.stat().st_size):
        name = _stem(path)
        if is_copc(path):
            ready(SceneCloudFile(name, f"{name}.copc.laz", path, path.name))
            continue
        copy = folder / STATE_FOLDER / f"copc-{name}.copc.laz"
        item = Item(f"copc-{path.name}", f"{path.name} for the page", (path,), path, 0.0, copy)
        with keeping([path], folder):
            each(as_copc, [item], facts_alone, state=state, progress=progress)
        ready(SceneCloudFile(name, f"{name}.copc.laz", copy, path.name))


def _stem(path: Path) -> str:
    """The name of a cloud without the endings of its format."""
    return path.name.removesuffix(path.suffix).removesuffix(".copc")


def cloud_parts(
    clouds: Sequence[SceneCloudFile], poses: PoseFile | None, *, upright: bool = True
) -> list[dict[str, Any]]:
    """Describe clouds for the scene: bounds, attributes with ranges, the station.

    Parameters
    ----------
    clouds : sequence of SceneCloudFile
        COPC files.
    poses : PoseFile or None
        Poses of the run, which say whose cloud it is.
    upright : bool
        Whether the third coordinate is the height.

    Raises
    ------
    InputError
        A file that is no COPC.
    """
    return [_part(cloud, poses, upright) for cloud in clouds]


def _part(cloud: SceneCloudFile, poses: PoseFile | None, upright: bool) -> dict[str, Any]:
    head = read_copc_head(cloud.path)
    at = None if poses is None else poses.of_cloud(Path(cloud.source))
    return {
        "name": cloud.name,
        "station": "" if at is None else at.placement.station,
        "scans": [] if at is None else [at.scan],
        "url": f"clouds/{cloud.file}",
        "points": head.points,
        "bounds": head.bounds.tolist(),
        "attributes": _attributes(head, upright),
    }


def _attributes(head: CopcHead, upright: bool) -> dict[str, Any]:
    """Ranges of what points can be coloured by, from the coarsest points of the cloud."""
    out: dict[str, Any] = {"rgb": head.colours}
    for name, (title, unit) in _ATTRIBUTES.items():
        values = head.sample.get(name)
        if values is None or not len(values) or not np.isfinite(values).any():
            continue
        low, high = _range(values)
        if name in ("intensity", "classification") and low == high == 0.0:
            continue
        words = _AXES.get(name, title) if upright else title
        out[name] = {"low": low, "high": high, "unit": unit, "title": words}
    return out


def _range(values: NDArray[Any]) -> tuple[float, float]:
    """What most values are between."""
    known = values[np.isfinite(values)].astype(np.float64)
    low, high = np.percentile(known, [_LOW, _HIGH])
    return float(low), float(high)
