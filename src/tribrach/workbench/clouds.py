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
from tribrach.errors import InputError
from tribrach.io.clouds.copc_head import CopcHead, is_copc, read_copc_head
from tribrach.io.keeping import STATE_FOLDER, keeping
from tribrach.io.scans.formats import read_scans
from tribrach.job.each import Item, each
from tribrach.job.poses import PoseFile
from tribrach.job.state import Remembered
from tribrach.questions.convert import as_copc
from tribrach.workbench.further import cloud_stem
from tribrach.workbench.result_folder import CLOUDS
from tribrach.workbench.schema import SceneAttribute, SceneCloud

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
    """A cloud of a scene."""

    name: str  #: of the cloud, as the page calls it
    file: str  #: name of the COPC file as the page asks for it
    path: Path  #: the file itself
    source: str  #: name of the file that the run wrote, or that was given besides
    further: bool = False  #: is it no cloud of the run, but one that was given besides?


def written_clouds(result: Mapping[str, Any], folder: Path) -> list[Path]:
    """Clouds that a run wrote and that are still there, in its order."""
    place = folder / CLOUDS
    files = [str(cloud["file"]) for cloud in (result.get("scans") or {}).get("clouds", [])]
    paths = [place / name for name in dict.fromkeys(files) if name not in ("", ".", "..")]
    return [p for p in paths if p.parent == place and p.is_file() and not p.is_symlink()]


def lacking_clouds(result: Mapping[str, Any], folder: Path, poses: PoseFile | None) -> str:
    """Say which clouds of a result cannot be shown, or are of another run, and what to do.

    A run that is stopped while it writes leaves its poses beside clouds of the run before.
    """
    files = {str(cloud["file"]) for cloud in (result.get("scans") or {}).get("clouds", [])}
    paths = written_clouds(result, folder)
    gone = sorted(files - {path.name for path in paths})
    other = [] if poses is None else [p.name for p in paths if _placed_otherwise(p, poses)]
    sentences = []
    if gone:
        verb, where = "are" if len(gone) > 1 else "is", f"not in {CLOUDS} any more"
        sentences.append(f"{_some(gone)} {verb} {where}: run the project again to show it all.")
    if other:
        verb = "were" if len(other) > 1 else "was"
        sentences.append(
            f"{_some(sorted(other))} {verb} not placed by the poses beside the clouds, so that the "
            "folder holds parts of two runs: run the project again."
        )
    return " ".join(sentences)


def _some(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    return f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0]


def _placed_otherwise(path: Path, poses: PoseFile) -> bool:
    """Whether a cloud says that it was placed by another pose than that of its scan."""
    at = poses.of_cloud(path)
    if at is None:
        return False
    try:
        return any(at.placed(scan.facts) is False for scan in read_scans(path))
    except InputError:
        return False


def convert_clouds(
    paths: Sequence[Path],
    folder: Path,
    progress: Progress,
    ready: Callable[[SceneCloudFile], None],
) -> None:
    """Give clouds as COPC one after the other, the smallest first; convert those that are none."""
    for path in sorted(paths, key=lambda path: path.stat().st_size):
        name = cloud_stem(path)
        copy = _as_copc(path, folder, f"copc-{name}", progress)
        ready(SceneCloudFile(name, f"{name}.copc.laz", copy, path.name))


def convert_further(
    path: Path, name: str, folder: Path, progress: Progress, ready: Callable[[SceneCloudFile], None]
) -> None:
    """Give a cloud as COPC that is none of the run: distances of a comparison, a design."""
    copy = _as_copc(path, folder, f"copc-{name}", progress)
    ready(SceneCloudFile(name, f"{name}.copc.laz", copy, path.name, further=True))


def _as_copc(path: Path, folder: Path, key: str, progress: Progress) -> Path:
    """A cloud as COPC: itself, or a copy beside the results, made unless it is there."""
    if is_copc(path):
        return path
    copy = folder / STATE_FOLDER / f"{key}.copc.laz"
    item = Item(f"{key}{path.suffix}", f"{path.name} for the page", (path,), path, 0.0, copy)
    with keeping([path], folder):
        each(as_copc, [item], state=Remembered(folder), progress=progress)
    return copy


def cloud_parts(
    clouds: Sequence[SceneCloudFile], poses: PoseFile | None, *, upright: bool = True
) -> list[SceneCloud]:
    """Describe clouds for the scene: bounds, attributes with ranges, the station."""
    return [_part(cloud, poses, upright) for cloud in clouds]


def _part(cloud: SceneCloudFile, poses: PoseFile | None, upright: bool) -> SceneCloud:
    head = read_copc_head(cloud.path)
    at = None if poses is None or cloud.further else poses.of_cloud(Path(cloud.source))
    return SceneCloud(
        name=cloud.name,
        station="" if at is None else at.placement.station,
        scans=[] if at is None else [at.scan],
        url=f"clouds/{cloud.file}",
        points=head.points,
        bounds=head.bounds.tolist(),
        attributes=_attributes(head, upright),
        further=cloud.further,
    )


def _attributes(head: CopcHead, upright: bool) -> dict[str, SceneAttribute | bool]:
    """Ranges of attributes for colours, from the coarsest points of the cloud."""
    out: dict[str, SceneAttribute | bool] = {"rgb": head.colours}
    compared = "distance" in head.sample
    for name, (title, unit) in _ATTRIBUTES.items():
        values = head.sample.get(name)
        if values is None or not len(values) or not np.isfinite(values).any():
            continue
        if name == "sigma" and compared:
            # that of a distance, which is no sigma of a position
            continue
        low, high = _range(values)
        if name in ("intensity", "classification") and low == high == 0.0:
            continue
        if name == "distance":
            # both directions alike, so that nothing is in the middle of the colours
            low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
        words = _AXES.get(name, title) if upright else title
        out[name] = SceneAttribute(low=low, high=high, unit=unit, title=words)
    if {"distance", "lod95"} <= head.sample.keys():
        title = "distance over its level of detection"
        out["significance"] = SceneAttribute(low=-2.0, high=2.0, unit="", title=title)
    return out


def _range(values: NDArray[Any]) -> tuple[float, float]:
    """What most values are between."""
    known = values[np.isfinite(values)].astype(np.float64)
    low, high = np.percentile(known, [_LOW, _HIGH])
    return float(low), float(high)
