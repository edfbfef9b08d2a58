"""The file that tells of a fault of the program, for those who can mend it."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import traceback
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: packages whose versions matter
_PACKAGES = ("tribrach", "numpy", "scipy", "numba", "laspy", "pyproj", "pydantic")


def write_fault(error: BaseException) -> Path | None:
    """Write what happened into the folder of temporary files; None where nothing can be written.

    It has the words of the command and the way through the program, but no data.
    """
    lines = [
        f"command: {' '.join(map(ascii, sys.argv))}",
        f"Python {platform.python_version()} on {platform.platform()}",
        *(f"{name} {_version(name)}" for name in _PACKAGES),
        "",
        *traceback.format_exception(error),
    ]
    try:
        handle, name = tempfile.mkstemp(prefix="tribrach-fault-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write("\n".join(lines))
    except OSError:
        return None
    return Path(name)


def _version(name: str) -> str:
    """Version of a package."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "is not there"
