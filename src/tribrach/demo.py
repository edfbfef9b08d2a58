"""A project to start from: two facades of a campus, scanned and surveyed, all of it simulated.

What a surveyor would bring home lies in the folder, and the truth as well: the report compares
everything with it. Nothing here is a measurement.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tribrach.io.twins import write_twin
from tribrach.simulate.twins import build

#: which twin it is
TWIN = "hanoi-facade"
#: points at each of its stations, about
POINTS = 1_000_000
_SEED = 1


def write_project(
    folder: Path,
    points: int = POINTS,
    progress: Callable[[str, int, int], None] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Simulate the survey into a folder.

    Scans that are there and whole are kept. The project file is written last: a folder without one
    holds a simulation that was interrupted, and another call goes on with it.
    """
    return write_twin(build(TWIN, points, _SEED), folder, progress, overwrite=overwrite)
