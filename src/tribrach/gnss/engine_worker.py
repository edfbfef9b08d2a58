"""One run of RTKLIB in a process of its own: ``engine_worker.py OPTIONS OUT START END FILE ...``.

The library keeps options and memory in global variables and ends the process where it fails, so it
is never loaded into the program itself. Nothing but the wheel is imported here. Exit status 3:
the options were not taken; 4: the library itself reported an error.
"""

from __future__ import annotations

import importlib
import sys

#: seconds of a GPS week
WEEK = 604_800.0


def main(options: str, out: str, start: float, end: float, files: list[str]) -> int:
    """Compute positions with a file's options, from ``start`` to ``end`` [GPS s]; all if both 0."""
    pyrtklib = importlib.import_module("pyrtklib")
    pyrtklib.resetsysopts()
    if not pyrtklib.loadopts(options, pyrtklib.sysopts.ptr):
        return 3
    processing, solution, names = pyrtklib.prcopt_t(), pyrtklib.solopt_t(), pyrtklib.filopt_t()
    pyrtklib.getsysopts(processing, solution, names)
    first, last = (
        pyrtklib.gpst2time(int(at // WEEK), at % WEEK) if at else pyrtklib.gtime_t()
        for at in (start, end)
    )
    destination = pyrtklib.Arr1Dchar(out)
    status = pyrtklib.postpos(
        first, last, 0.0, 0.0, processing, solution, names, files, len(files), destination, "", ""
    )
    return 4 if status else 0


if __name__ == "__main__":
    _, options_file, out_file, first_time, last_time, *rest = sys.argv
    sys.exit(main(options_file, out_file, float(first_time), float(last_time), rest))
