"""One run of RTKLIB in a process of its own: ``python engine_worker.py OPTIONS OUT FILE ...``.

The library keeps options and memory in global variables and ends the process where it fails, so it
is never loaded into the program itself. Nothing but the wheel is imported here. Exit status 3:
the options were not taken; 4: the library itself reported an error.
"""

from __future__ import annotations

import importlib
import sys

__all__ = ["main"]


def main(options: str, out: str, files: list[str]) -> int:
    """Compute positions with the options of a file.

    Parameters
    ----------
    options
        Path of the file of options.
    out
        Path of the solution file.
    files
        Paths of observations and orbits.

    Returns
    -------
    int
        Exit status: 0, 3 or 4, see the module.
    """
    pyrtklib = importlib.import_module("pyrtklib")
    pyrtklib.resetsysopts()
    if not pyrtklib.loadopts(options, pyrtklib.sysopts.ptr):
        return 3
    processing, solution, names = pyrtklib.prcopt_t(), pyrtklib.solopt_t(), pyrtklib.filopt_t()
    pyrtklib.getsysopts(processing, solution, names)
    ever = pyrtklib.gtime_t()
    destination = pyrtklib.Arr1Dchar(out)
    status = pyrtklib.postpos(
        ever, ever, 0.0, 0.0, processing, solution, names, files, len(files), destination, "", ""
    )
    return 4 if status else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], sys.argv[3:]))
