"""The survey of the demonstration in small: one station, one scan of a few of the boards."""

from dataclasses import replace
from functools import cache

from tribrach.simulate.aiming import fine_scan
from tribrach.simulate.twin import Twin
from tribrach.simulate.twins import build
from tribrach.simulate.twins.hanoi_facade import FINE_STEP

#: the four check points and two more
BOARDS = ("N3", "N4", "N6", "E2", "E4", "E5")


@cache
def few_boards(name: str, points: int, seed: int) -> Twin:
    """Station S2 and a scan of windows around these boards, whatever number of points is asked."""
    twin = build(name, 10_000, seed)
    station = twin.station("S2")
    boards = [target for target in twin.targets if target.name in BOARDS]
    scan = fine_scan(station.name, station.pose, boards, FINE_STEP)
    # with one station nothing is compared
    project = twin.project.split("[[comparison]]")[0]
    return replace(twin, stations=[station], scans=[scan], project=project)
