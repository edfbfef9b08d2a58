"""The planes and the view of every station, found once and remembered."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tribrach.errors import InputError
from tribrach.io.arrays import named_bytes, read_named
from tribrach.io.outputs import write_bytes
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered, digest
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.views import StationView, Surroundings, merged_view, view_of
from tribrach.scan.loading import load
from tribrach.scan.range_image import organise
from tribrach.targets.planes import find_planes

__all__ = ["surroundings"]


def surroundings(
    scans: Sequence[StationScan],
    least_area: float,
    floor: float,
    state: Remembered,
    progress: Callable[[str], None],
) -> list[Surroundings]:
    """Find the planes and the view of every station.

    Those of unchanged scans come from the last run. A scan whose scanner's place is unknown has
    neither.

    Parameters
    ----------
    scans
        Of all stations.
    least_area
        Planes of a scan smaller than this are not used [m²].
    floor
        Standard deviation that no plane falls below [m].
    state
        Where results are remembered.
    progress
        Called with what is being done.
    """
    stations: dict[str, list[StationScan]] = {}
    for scan in scans:
        stations.setdefault(scan.station, []).append(scan)
    out = []
    for name, members in stations.items():
        seen = [
            _remembered(scan.measured, least_area, floor, state, progress)
            for scan in members
            if scan.origin_known
        ]
        planes = PlaneSet.joined([planes for planes, _ in seen])
        view = merged_view([view for _, view in seen]) if seen else StationView.empty()
        out.append(Surroundings.of(name, planes, view, members[0].levelled))
    return out


def _remembered(
    scan: MeasuredScan,
    least_area: float,
    floor: float,
    state: Remembered,
    progress: Callable[[str], None],
) -> tuple[PlaneSet, StationView]:
    """Planes and view of one scan, from the last run if nothing changed."""
    key = state.key(_of_scan, scan, least_area, floor)
    product = f"planes-{scan.name}"
    plain = re.sub(r"[^\w-]", "_", scan.name)[:60]
    file = state.folder / f"planes-{plain}-{digest(scan.name)[:8]}.npz"
    if state.recall(product, key, file) is not None:
        known = _read(file, scan.name)
        if known is not None:
            return known
    progress(f"planes of {scan.name}")
    planes, view = _of_scan(scan, least_area, floor)
    write_bytes(file, _packed(planes, view))
    state.remember(product, key, {"planes": len(planes)}, file)
    return planes, view


def _of_scan(scan: MeasuredScan, least_area: float, floor: float) -> tuple[PlaneSet, StationView]:
    """Planes and view of one scan."""
    cloud = load(scan.scan)
    image = organise(cloud.xyz, cloud.row, cloud.column)
    shared = None if scan.noise is None else scan.noise.estimated_shared
    planes, _ = find_planes(
        cloud.xyz,
        image,
        least_area=least_area,
        floor=floor,
        shared=shared,
        scan=scan.name,
        **scan.fit_sigmas,
    )
    return PlaneSet.of(planes), view_of(cloud.xyz, image)


def _packed(planes: PlaneSet, view: StationView) -> bytes:
    """Planes and view as the bytes of an npz file."""
    arrays = {
        "normal": planes.normal,
        "center": planes.center,
        "covariance": planes.covariance,
        "area": planes.area,
        "sample": np.concatenate([np.zeros((0, 3)), *planes.samples]),
        "count": np.array([len(s) for s in planes.samples], dtype=np.int64),
        "spacing": planes.spacing,
        "near": view.near,
        "far": view.far,
        "looked": view.looked,
        "points": view.points,
        "reach": np.array(view.reach),
    }
    return named_bytes(arrays)


def _read(file: Path, scan: str) -> tuple[PlaneSet, StationView] | None:
    """What was packed; None if the file is damaged."""
    try:
        data = read_named(file)
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
    except (InputError, ValueError, KeyError, TypeError, IndexError):
        return None
    return planes, view
