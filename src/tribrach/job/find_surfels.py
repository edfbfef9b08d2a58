"""The surfels of stations for registration by clouds, found once, by tasks, and remembered."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tribrach._types import Array, Progress
from tribrach.io.arrays import named_bytes, read_named
from tribrach.io.outputs import write_bytes
from tribrach.job.each import Item, each
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered, digest
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.scan.scan import Scan

__all__ = ["station_surfels"]


def station_surfels(
    stations: Mapping[str, Sequence[StationScan]], state: Remembered, progress: Progress
) -> dict[str, PreparedScan]:
    """Prepare every station for registration; those of unchanged scans come from the last run.

    Parameters
    ----------
    stations
        Their scans, which are one cloud, by name.
    state
        Where surfels are remembered, and who makes those that are not.
    progress
        Called with what is being done.

    Returns
    -------
    dict of str to PreparedScan
        By the names of the stations.

    Raises
    ------
    InputError
        A scan without surfaces, or one that cannot be read.
    """
    items = [_item(name, scans, state) for name, scans in stations.items()]
    made = each(_of_station, items, _read, state=state, progress=progress)
    return dict(zip(stations, made, strict=True))


def _item(name: str, scans: Sequence[StationScan], state: Remembered) -> Item:
    plain = re.sub(r"[^\w-]", "_", name)[:60]
    return Item(
        f"surfels-{name}",
        f"surfels of {name}",
        (name, [(scan.name, scan.scan) for scan in scans]),
        source=scans[0].scan.path,
        cost=sum(scan.scan.records or 0 for scan in scans),
        file=state.folder / f"surfels-{plain}-{digest(name)[:8]}.npz",
    )


def _of_station(
    name: str, scans: Sequence[tuple[str, Scan]], *, path: Path, progress: Progress
) -> dict[str, Any]:
    """Write the surfels of a station into a file."""
    made = prepare(name, _points(scans, progress))
    write_bytes(path, named_bytes(made.to_arrays()))
    return {"surfels": len(made.fine.surfels)}


def _points(scans: Sequence[tuple[str, Scan]], progress: Progress) -> Iterator[Array]:
    for name, scan in scans:
        done = 0
        for chunk in scan.chunks():
            done += len(chunk)
            progress(f"points of {name}", done, scan.records)
            yield chunk.xyz


def _read(item: Item, facts: dict[str, Any]) -> PreparedScan:
    """The surfels of a file, with their search trees."""
    assert item.file is not None
    return PreparedScan.from_arrays(item.values[0], read_named(item.file))
