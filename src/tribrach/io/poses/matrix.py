"""One pose as a 4x4 or 3x4 matrix in lines, world from scanner, in metres.

RiSCAN PRO writes the SOP matrix of each scan position, scanner's own to project coordinates, as
``ScanPos001.DAT`` (Registration, Multiple SOP export).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tribrach.io.poses.rows import NumberRow, PoseList, rigid


def fits(rows: Sequence[NumberRow]) -> bool:
    """True for three or four lines of four numbers."""
    return len(rows) in (3, 4) and all(len(row.values) == 4 for row in rows)


def read(path: Path, rows: Sequence[NumberRow]) -> PoseList:
    """The pose of a matrix."""
    pose = rigid(path, rows[0].line, [v for row in rows for v in row.values])
    name = "SOP matrix" if path.suffix.lower() == ".dat" else "matrix, world from scanner"
    return PoseList(path, (pose,), None, f"{name}, metres")
