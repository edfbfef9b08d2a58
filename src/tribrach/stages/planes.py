"""The planes and the view of every station, found once and remembered."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.io.outputs import write_bytes
from tribrach.project.scan_sections import RegistrationSection
from tribrach.registration.plane_set import PlaneSet
from tribrach.registration.station_view import StationView, merged_view, view_of
from tribrach.registration.surroundings import Surroundings
from tribrach.scan.loading import load
from tribrach.scan.range_image import organise
from tribrach.stages.scans import StationScan
from tribrach.stages.state import State, digest
from tribrach.targets.planes import find_planes
from tribrach.units import MM

__all__ = ["surroundings"]

Array = NDArray[np.float64]

#: changes of how planes are found make remembered ones void
_METHOD = 1
#: range for which the noise of fits is taken [m]
_USUAL = 15.0


def surroundings(
    scans: Sequence[StationScan],
    wish: RegistrationSection,
    state: State,
    progress: Callable[[str], None],
) -> list[Surroundings]:
    """Planes and view of every station; those of unchanged scans come from the last run.

    A scan whose scanner's place is unknown has neither.
    """
    stations: dict[str, list[StationScan]] = {}
    for scan in scans:
        stations.setdefault(scan.station, []).append(scan)
    out = []
    for name, mine in stations.items():
        found = [_of_scan(scan, wish, state, progress) for scan in mine if scan.origin_known]
        planes = PlaneSet.joined([planes for planes, _ in found])
        view = merged_view([view for _, view in found]) if found else StationView.empty()
        out.append(Surroundings.of(name, planes, view, mine[0].levelled))
    return out


def _of_scan(
    scan: StationScan, wish: RegistrationSection, state: State, progress: Callable[[str], None]
) -> tuple[PlaneSet, StationView]:
    """Planes and view of one scan."""
    noise = _noise(scan)
    settings = [sorted(noise.items()), wish.plane_area_m2, wish.plane_floor_mm]
    key = digest("planes", _METHOD, state.file_digest(scan.scan.path), scan.mark, settings)
    product = f"planes-{scan.name}"
    plain = re.sub(r"[^\w-]", "_", scan.name)[:60]
    file = state.folder / f"planes-{plain}-{digest(scan.name)[:8]}.npz"
    if state.recall(product, key, file) is not None:
        known = _read(file, scan.name)
        if known is not None:
            return known
    progress(f"planes of {scan.name}")
    cloud = load(scan.scan)
    image = organise(cloud.xyz, cloud.row, cloud.column)
    found, _ = find_planes(
        cloud.xyz,
        image,
        least_area=wish.plane_area_m2,
        floor=wish.plane_floor_mm * MM,
        scan=scan.name,
        **noise,
    )
    planes, view = PlaneSet.of(found), view_of(cloud.xyz, image)
    write_bytes(file, _packed(planes, view))
    state.remember(product, key, {"planes": len(planes)}, file)
    return planes, view


def _noise(scan: StationScan) -> dict[str, float]:
    """Sigmas of single points for the fits; without an instrument they come from the scan."""
    if scan.noise is None:
        return {}
    spot = float(scan.noise.beam_angle(np.array([_USUAL]))[0])
    return {
        "sigma_range": scan.noise.range + scan.noise.range_scale * _USUAL,
        "sigma_angle": float(np.hypot(scan.noise.vertical, spot)),
    }


def _packed(planes: PlaneSet, view: StationView) -> bytes:
    """Planes and view as the bytes of an npz file."""
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        normal=planes.normal,
        center=planes.center,
        covariance=planes.covariance,
        area=planes.area,
        sample=np.concatenate([np.zeros((0, 3)), *planes.samples]),
        count=np.array([len(s) for s in planes.samples], dtype=np.int64),
        spacing=planes.spacing,
        near=view.near,
        far=view.far,
        looked=view.looked,
        points=view.points,
        reach=np.array(view.reach),
    )
    return buffer.getvalue()


def _read(file: Path, scan: str) -> tuple[PlaneSet, StationView] | None:
    """What was packed; None if the file is damaged."""
    try:
        with file.open("rb") as source, np.load(source, allow_pickle=False) as data:
            ends = np.cumsum(data["count"])
            samples = tuple(np.split(data["sample"], ends[:-1])) if len(ends) else ()
            planes = PlaneSet(
                data["normal"],
                data["center"],
                data["covariance"],
                data["area"],
                samples,
                data["spacing"],
                (scan,) * len(ends),
            )
            view = StationView(
                data["near"],
                data["far"],
                data["looked"],
                data["points"],
                float(data["reach"]),
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return planes, view
