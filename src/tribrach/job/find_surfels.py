"""The surfels of stations for registration by clouds, found once, by tasks, and remembered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from tribrach._types import Array, Progress
from tribrach.job.each import Item, each
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.registration.clouds.prepared import PreparedScan, SurfacesOfScan, surfaces
from tribrach.scan.scan import Scan


def station_surfels(
    stations: Mapping[str, Sequence[StationScan]], state: Remembered, progress: Progress
) -> dict[str, PreparedScan]:
    """Prepare every station for registration; those of unchanged scans come from the last run."""
    items = [
        Item(
            f"surfels-{name}",
            f"surfels of {name}",
            (name, [(scan.name, scan.scan) for scan in scans]),
            source=scans[0].scan.path,
            cost=sum(scan.scan.records or 0 for scan in scans),
        )
        for name, scans in stations.items()
    ]
    made = each(_of_station, items, state=state, progress=progress)
    return {name: found.indexed(name) for name, found in zip(stations, made, strict=True)}


def _of_station(
    name: str, scans: Sequence[tuple[str, Scan]], *, progress: Progress
) -> SurfacesOfScan:
    """The surfels and the view of a station, whose search trees are for the caller."""
    return surfaces(name, _points(scans, progress))


def _points(scans: Sequence[tuple[str, Scan]], progress: Progress) -> Iterator[Array]:
    for name, scan in scans:
        done = 0
        for chunk in scan.chunks():
            done += len(chunk)
            progress(f"points of {name}", done, scan.records)
            yield chunk.xyz
