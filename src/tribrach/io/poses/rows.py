"""What the readers of poses share: rows of numbers, rigid matrices, lists of poses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.opened_files import contents, lines_of

#: files of poses are small; larger ones are something else [bytes]
LARGEST = 20_000_000
#: coordinates beyond this are none [m, cm]
_FARTHEST = 1e9
_COMMENTS = ("#", "//", "%", "!")


@dataclass(frozen=True)
class NumberRow:
    """Numbers of one line, with its 1-based number in the file."""

    line: int
    values: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class PoseList:
    """Poses of one file, all in one frame."""

    path: Path  #: the file
    poses: tuple[Pose, ...]  #: world from scanner, one or more
    #: numbers of the scans that the poses belong to, from 0; None for a file that is of one scan
    #: and has its name
    frames: tuple[int, ...] | None
    words: str  #: the format and how it was understood


def number_rows(path: Path) -> list[NumberRow]:
    """Numbers of the lines of a text; blank lines and comments are left out."""
    cure = "give a file of poses: 4x4 or 3x4 matrices, KITTI, .pose or .DAT"
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(
                f"the file has more than {LARGEST / 1e6:.0f} MB and is none of poses",
                file=path,
                cure=cure,
            )
        text = contents(path).decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error
    rows = []
    for number, line in enumerate(lines_of(text), start=1):
        bare = line.strip()
        if not bare or bare.startswith(_COMMENTS):
            continue
        words = bare.replace(",", " ").replace(";", " ").split()
        rows.append(NumberRow(number, tuple(_number(path, number, word, cure) for word in words)))
    if not rows:
        raise InputError("the file has no numbers", file=path, cure=cure)
    return rows


def _number(path: Path, line: int, word: str, cure: str) -> float:
    """A finite number."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not abs(value) <= _FARTHEST:
        what = f"{word[:30]!r} is no number of a pose"
        raise InputError(what, file=path, line=line, cure=cure)
    return value


def rigid(path: Path, line: int, values: Sequence[float]) -> Pose:
    """The pose of 12 or 16 numbers of a matrix, row by row."""
    given = [*values, 0.0, 0.0, 0.0, 1.0] if len(values) == 12 else values
    matrix = np.array(given, dtype=np.float64).reshape(4, 4)
    if np.allclose(matrix[:, 3], [0, 0, 0, 1]) and matrix[3, :3].any():
        raise InputError(
            "the matrix stands transposed, with the shift in its last row",
            file=path,
            line=line,
            cure="write it with the shift in the last column",
        )
    try:
        return Pose.from_matrix(matrix)
    except InputError as error:
        cure = "give matrices of poses, metres, row by row"
        raise InputError(error.what, file=path, line=line, cure=cure) from error
