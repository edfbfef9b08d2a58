"""PTX: scans of a grid, one after the other, each with its pose.

Points are in the scanner's own frame, column after column. ``x y z 1`` as a row times the 4x4
matrix gives the world; the four lines before the matrix, position and axes of the scanner, say the
same again. Directions without a return are ``0 0 0``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.scans.columns import arranged
from tribrach.io.scans.origin import scan_name
from tribrach.io.scans.reading import reading
from tribrach.io.scans.text import LineBlock, Lines
from tribrach.io.scans.text_scan import TextScan, refuse_many, rows, short, table
from tribrach.io.text_form import blanks_of
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Chunk, Field, Origin, Scan
from tribrach.sentences import Sentence

#: values in the lines of a header
HEADER = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)
#: columns of a point: without and with colours
_COLUMNS = {4: "x y z intensity", 7: "x y z intensity red green blue"}
#: farther than any scanner reaches [m]; such coordinates are no longer those of the scanner
_FAR = 10_000.0
#: by how much the two poses may differ: elements of the rotation, position [m]
_ROTATION, _POSITION = 1e-4, 1e-3
_NOTHING = re.compile(rb"(?m)^[-+]?0(?:\.0*)? [-+]?0(?:\.0*)? [-+]?0(?:\.0*)?(?: [^\n]*)?$")
_CURE = "export the scan again"


@dataclass(frozen=True)
class PtxScan(TextScan):
    """One scan of a PTX file; row and column follow from the order of the points."""

    def _numbers(self, lines: Lines, block: LineBlock, columns: int) -> list[Array]:
        """The table of a block, where lines without a return may be shorter."""
        try:
            return table(lines, block, columns)
        except InputError:
            full = b" ".join([b"0"] * columns)
            text, changes = _NOTHING.subn(full, block.text)
            if not changes:
                raise
            return table(lines, LineBlock(text, block.count, block.first, block.mark), columns)

    def _chunk(self, values: dict[str, NDArray[Any]], done: int) -> Chunk:
        height = 1 if self.grid is None else self.grid[0]
        place = np.arange(done, done + len(values["x"]))
        where = {
            "row": (place % height).astype(np.int32),
            "column": (place // height).astype(np.int32),
        }
        return self.columns.chunk(values, self.path, extra=where, zero_is_nothing=True)


def read(path: Path) -> tuple[Scan, ...]:
    """All scans of a file; the lines are counted on the way."""
    scans: list[PtxScan] = []
    with unpacked(path) as file:
        lines = Lines(file, path, blanks_of(path, reading().decimal, head=len(HEADER) - 2))
        while lines.peek(1):
            scans.append(_scan(lines, len(scans)))
            refuse_many(path, len(scans))
    if not scans:
        raise InputError("the file is empty", file=path, cure="copy it again from its source")
    return tuple(scans)


def _scan(lines: Lines, index: int) -> PtxScan:
    """The next scan; its points are passed over."""
    path = lines.path
    name = scan_name(path, index)
    numbers = _header(lines, name, index)
    width, height = int(numbers[0][0]), int(numbers[1][0])
    pose, warnings, agree = _pose(numbers, path, name)
    mark, first = lines.mark, lines.ordinal
    records, sample = lines.survey(width * height)
    if records != width * height:
        raise short(path, width * height, records, name)
    count = max((line.count(b" ") + 1 for line in sample), default=4)
    if count not in _COLUMNS:
        what = f"points have {count} values; 4 or 7 belong there"
        raise InputError(what, file=path, record=name, cure=_CURE)
    names = _COLUMNS[count].split()
    values = rows(sample, count)
    types, columns = dict.fromkeys(names, "float64"), dict(zip(names, values.T, strict=True))
    layout = arranged(types, columns, path, intensity=(0.0, 1.0))
    origin: Origin = "stated" if agree else "unknown"
    with np.errstate(over="ignore"):
        nearest = np.linalg.norm(values[values[:, :3].any(axis=1), :3], axis=1).min(initial=np.inf)
    if np.isfinite(nearest) and nearest > _FAR:
        origin = "unknown"
        warnings.append(
            Sentence(
                "the points are {nearest:km0} from the scanner's zero: they are no longer in "
                "its frame",
                nearest=nearest,
            )
        )
    return PtxScan(
        name=name,
        path=path,
        index=index,
        records=records,
        fields=(*layout.fields, Field("row", "int32"), Field("column", "int32")),
        pose=pose,
        origin=origin,
        grid=(height, width),
        warnings=tuple(warnings),
        mark=mark,
        first=first,
        blanks=lines.blanks,
        types=types,
        columns=layout,
    )


def _header(lines: Lines, name: str, index: int) -> list[list[float]]:
    """The numbers of the ten lines of a header, checked one by one."""
    path, block = lines.path, lines.take(len(HEADER))
    numbers: list[list[float]] = []
    for k, line in enumerate(block.text.split(b"\n")[:-1]):
        try:
            values = [float(value) for value in line.split(b" ")]
        except ValueError:
            values = []
        whole = HEADER[k] > 1 or (len(values) == 1 and values[0] >= 0 and values[0] % 1 == 0)
        if len(values) != HEADER[k] or not whole or not np.isfinite(values).all():
            raise InputError(
                _wrong_line(line, k, index),
                file=path,
                line=lines.number(block, k),
                record=name,
                cure=_CURE,
            )
        numbers.append(values)
    if len(numbers) < len(HEADER):
        what = "the file ends within the header of a scan"
        raise InputError(what, file=path, record=name, cure=_CURE)
    return numbers


_LINES = ("columns", "rows", "position", *["axis"] * 3, *["row of the 4x4 matrix"] * 4)


def _wrong_line(line: bytes, k: int, index: int) -> str:
    """Reason why a line of a header is wrong: its values or its position."""
    cells = line.split(b" ")
    if len(cells) != HEADER[k]:
        early = index > 0 and k < 2
        before = "; the scan before may have more points than it states" if early else ""
        there, due = len(cells), HEADER[k]
        return (
            f"line {k + 1} of the scan's header has {there} values, and {due} belong there{before}"
        )
    wrong = next((cell for cell in cells if not _finite(cell)), cells[0])
    return (
        f"{wrong[:40].decode(errors='replace')!r} in line {k + 1} of the scan's header "
        f"({_LINES[k]}) is no {'number of points' if k < 2 else 'finite number'}"
    )


def _finite(cell: bytes) -> bool:
    """True if a cell is a finite number."""
    try:
        return bool(np.isfinite(float(cell)))
    except ValueError:
        return False


def _pose(numbers: list[list[float]], path: Path, name: str) -> tuple[Pose, list[str], bool]:
    """The pose of the matrix, warnings, and True if the points are in the scanner's frame."""
    matrix, axes = np.array(numbers[6:10]).T, np.array(numbers[3:6]).T
    try:
        pose = Pose.from_matrix(matrix)
    except InputError as error:
        raise InputError(error.what, file=path, record=name, cure=_CURE) from error
    turned = float(np.abs(axes - pose.rotation).max())
    moved = float(np.abs(np.array(numbers[2]) - pose.translation).max())
    if turned <= _ROTATION and moved <= _POSITION:
        return pose, [], True
    silent = not np.any(numbers[2]) and np.array_equal(axes, np.eye(3))
    warning = Sentence(
        "the scanner's position and axes contradict the 4x4 matrix (by {moved:mg4} and "
        "{turned:g2} in the rotation); the matrix is taken",
        moved=moved,
        turned=turned,
    )
    return pose, [warning], silent
