"""PTS: a count, then as many lines ``x y z [intensity] [red green blue]``; also several blocks.

Intensities are from -2048 to 2047. The format has no place for the scanner.
"""

from __future__ import annotations

from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.scans.columns import arranged
from tribrach.io.scans.origin import assumed_origin, bounds_of, scan_name
from tribrach.io.scans.reading import reading
from tribrach.io.scans.text import Lines
from tribrach.io.scans.text_scan import TextScan, off_by_one, refuse_many, rows
from tribrach.io.text_form import blanks_of
from tribrach.io.unpacking import unpacked
from tribrach.scan.scan import Scan

#: columns by their number
_COLUMNS = {
    3: "x y z",
    4: "x y z intensity",
    6: "x y z red green blue",
    7: "x y z intensity red green blue",
}
_CURE = "copy the file again from its source"


class PtsScan(TextScan):
    """One block of a PTS file."""


def read(path: Path) -> tuple[Scan, ...]:
    """Each block of a file as a scan; the lines are counted on the way."""
    scans: list[PtsScan] = []
    with unpacked(path) as file:
        lines = Lines(file, path, blanks_of(path, reading().decimal))
        while lines.peek(1):
            scans.append(_block(lines, len(scans)))
            refuse_many(path, len(scans))
    if not scans:
        raise InputError("the file is empty", file=path, cure=_CURE)
    return tuple(scans)


def _block(lines: Lines, index: int) -> PtsScan:
    """The scan of the next block; its lines are passed over."""
    path = lines.path
    name = scan_name(path, index)
    head = lines.take(1)
    if not head.text.strip().isdigit():
        what = "the number of points belongs in the first line"
        if index:
            what = "the block before has more points than it states"
        raise InputError(what, file=path, line=lines.number(head, 0), cure=_CURE)
    stated = int(head.text[:30])
    mark, first = lines.mark, lines.ordinal
    records, sample = lines.survey(stated)
    warnings = []
    if records != stated:
        warnings.append(off_by_one(path, stated, records, name))
    elif stated and (last := lines.peek(2)) and len(last) == 1 and not last[0].isdigit():
        # one line more than is stated, and nothing behind it
        records += lines.skip(1)
        warnings.append(off_by_one(path, stated, records, name))
    count = sample[0].count(b" ") + 1 if sample else 3
    if count not in _COLUMNS:
        what = f"points have {count} values; 3, 4, 6 or 7 belong there"
        raise InputError(what, file=path, line=lines.number(head, 0) + 1, cure=_CURE)
    names = _COLUMNS[count].split()
    values = rows(sample, count)
    types, columns = dict.fromkeys(names, "float64"), dict(zip(names, values.T, strict=True))
    layout = arranged(types, columns, path, intensity=(-2048.0, 2047.0))
    return PtsScan(
        name=name,
        path=path,
        index=index,
        records=records,
        fields=layout.fields,
        origin=assumed_origin(bounds_of(values[:, :3])),
        warnings=tuple(warnings),
        mark=mark,
        first=first,
        blanks=lines.blanks,
        types=types,
        columns=layout,
    )
