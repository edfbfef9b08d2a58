"""A session: one observation off, the values adjusted again, all tests, against one adjustment.

The networks are a hall of scanner stations and a grid of set-ups, read from their files as a
project. The peer is the adjustment of the same network from its approximate values, which no
session could do without.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.figures import Figure, cost_of, run
from benchmarks.network_files import write_grid, write_scanner
from tribrach.network.adjustment import adjust
from tribrach.workbench.session import Session

PEER = "one adjustment"


def hall(folder: Path, stations: int, targets: int) -> Path:
    """A project of scanner stations that see the 113 nearest of their targets each."""
    write_scanner(stations, targets, folder, seen=113)
    files = '[[points]]\nfile = "control.csv"\n[[observations]]\nfile = "polar.csv"\n'
    (folder / "hall.toml").write_text(files, encoding="utf-8")
    return folder / "hall.toml"


def grid(folder: Path, side: int) -> Path:
    """A project of set-ups in a grid."""
    folder.mkdir()
    write_grid(side, folder / "grid.gkf")
    (folder / "grid.toml").write_text('[[observations]]\nfile = "grid.gkf"\n', encoding="utf-8")
    return folder / "grid.toml"


def measure(stations: float, targets: float, side: float) -> Iterator[Figure]:
    """Both networks."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        # compiled code is loaded before anything is timed
        warm = Session.open(hall(folder / "warm", 20, 60))
        warm.tests(warm.revision)
        warm = Session.open(grid(folder / "warm grid", 12))
        warm.tests(warm.revision)
        yield from _figures(hall(folder / "hall", int(stations), int(targets)), "hall")
        yield from _figures(grid(folder / "grid", int(side)), "grid")


def _figures(project: Path, name: str) -> Iterator[Figure]:
    session = Session.open(project)
    network = session.adjustment.network
    fresh = session._state.measured.network
    size = f"{name}, {network.count()} values, {session.adjustment.n_unknowns} unknowns"
    _, theirs = cost_of(lambda: adjust(fresh), 3)
    session.tests(session.revision)
    observation = session.adjustment.observations.worst(1)[0].id
    uses = iter(["off", "active", "off"])

    def switch() -> float:
        change = {"do": "use", "observation": observation, "use": next(uses), "reason": "tried"}
        return float(session.apply(session.revision, [change])["largest"]["moved"])

    moved, ours = cost_of(switch, 3)
    told = f"largest move {1000 * moved:.2f} mm"
    yield Figure("adjusted values after one is off", size, ours, PEER, theirs, told)
    _, ours = cost_of(lambda: session.tests(session.revision))
    yield Figure("all tests after that", size, ours, PEER, theirs)
    _, ours = cost_of(lambda: session.what_if(observation), 5)
    yield Figure("what one observation does, predicted", size, ours, PEER, theirs)


if __name__ == "__main__":
    run(measure, full=(60, 850, 58), small=(20, 200, 12))
