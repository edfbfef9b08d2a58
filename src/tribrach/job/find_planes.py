"""The planes and the view of every station, found once and remembered."""

from __future__ import annotations

from collections.abc import Sequence

from tribrach._types import Progress
from tribrach.job.each import Item, each
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered
from tribrach.job.visits import Wish
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.views import StationView, Surroundings, merged_view, view_of
from tribrach.scan.loading import laid_out
from tribrach.targets.planes import find_planes


def surroundings(
    scans: Sequence[StationScan],
    least_area: float,
    floor: float,
    state: Remembered,
    progress: Progress,
) -> list[Surroundings]:
    """Find the planes and the view of every station.

    Those of unchanged scans come from the last run. A scan whose scanner's place is unknown has
    neither.
    """
    seen = _planes_and_views(
        [s for s in scans if s.origin_known], least_area, floor, state, progress
    )
    out = []
    for name in dict.fromkeys(scan.station for scan in scans):
        members = [scan for scan in scans if scan.station == name]
        parts = [seen[scan.name] for scan in members if scan.origin_known]
        angles = {scan.name: scan.noise.systematic for scan in members if scan.noise is not None}
        planes = PlaneSet.joined([planes for planes, _ in parts]).with_angles(angles)
        view = merged_view([view for _, view in parts]) if parts else StationView.empty()
        out.append(Surroundings.of(name, planes, view, members[0].levelled))
    return out


def _planes_and_views(
    scans: Sequence[StationScan],
    least_area: float,
    floor: float,
    state: Remembered,
    progress: Progress,
) -> dict[str, tuple[PlaneSet, StationView]]:
    """Planes and views by the names of the scans, from the last run if nothing changed."""
    items = [plane_wish(scan, least_area, floor).item for scan in scans]
    found = each(_of_scan, items, state=state, progress=progress)
    return {scan.name: seen for scan, seen in zip(scans, found, strict=True)}


def plane_wish(scan: StationScan, least_area: float, floor: float) -> Wish:
    """The planes and the view of a scan as a product."""
    item = Item(
        f"planes-{scan.name}",
        f"planes of {scan.name}",
        (scan.measured, least_area, floor),
        source=scan.scan.path,
        cost=scan.scan.records or 0,
    )
    return Wish(_of_scan, item)


def _of_scan(
    scan: MeasuredScan, least_area: float, floor: float, *, progress: Progress
) -> tuple[PlaneSet, StationView]:
    """Planes and view of one scan."""
    cloud, image = laid_out(scan.scan)
    shared = None if scan.noise is None else scan.noise.estimated_shared
    found, _ = find_planes(
        cloud.xyz,
        image,
        least_area=least_area,
        floor=floor,
        shared=shared,
        scan=scan.name,
        **scan.fit_sigmas,
    )
    return PlaneSet.of(found), view_of(cloud.xyz, image)
