"""Small files of scans that tests write themselves."""

from __future__ import annotations

from pathlib import Path

import laspy


def empty_las(path: Path) -> None:
    """A LAS file without points."""
    laspy.LasData(laspy.LasHeader(point_format=6, version="1.4")).write(path)
