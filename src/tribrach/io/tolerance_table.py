"""Tolerances by element from a CSV file: ``element,tolerance_mm`` or ``element,lower_mm,upper_mm``.

An element is a name, or a pattern with ``*`` and ``?``; the first row that fits an element counts.
Text or a spreadsheet (:mod:`tribrach.io.csv_rows`). Further columns are ignored.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from tribrach.comparison.as_designed import DeviationLimits
from tribrach.errors import InputError
from tribrach.io.csv_rows import read_rows
from tribrach.io.decimals import plain
from tribrach.units import MM

_BOTH, _EACH = ("tolerance_mm",), ("lower_mm", "upper_mm")


def read_tolerances(path: Path) -> list[tuple[str, DeviationLimits]]:
    """Patterns of elements with their limits [m], in the order of the file."""
    table = read_rows(path)
    titles = [" ".join(title.split()).lower() for title in table.cells[0]]
    kinds = [kind for kind in (_BOTH, _EACH) if all(column in titles for column in kind)]
    if "element" not in titles or len(kinds) != 1:
        raise InputError(
            "the columns do not say what is tolerated",
            file=path,
            line=table.lines[0],
            cure="name them element,tolerance_mm or element,lower_mm,upper_mm",
        )
    places = [titles.index(column) for column in kinds[0]]
    decimal, _ = table.decimal(places)
    out = []
    for cells, line in zip(table.cells[1:], table.lines[1:], strict=True):
        try:
            values = [float(plain(cells[place], decimal)) * MM for place in places]
        except ValueError:
            values = [math.nan]
        lower, upper = (-values[0], values[0]) if len(values) == 1 else values
        if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
            raise InputError(
                "the tolerance is no range of deviations",
                file=path,
                line=line,
                cure="give millimetres, a tolerance above zero or lower_mm below upper_mm",
            )
        out.append((cells[titles.index("element")].strip(), DeviationLimits(lower, upper)))
    return out


def limits_of(
    names: Sequence[str], table: Sequence[tuple[str, DeviationLimits]], rest: DeviationLimits | None
) -> tuple[dict[str, DeviationLimits], list[str]]:
    """DeviationLimits by element, and patterns that fit none."""
    out: dict[str, DeviationLimits] = {}
    used: set[int] = set()
    for name in names:
        fits = [k for k, (pattern, _) in enumerate(table) if fnmatchcase(name, pattern)]
        used.update(fits)
        limits = table[fits[0]][1] if fits else rest
        if limits is not None:
            out[name] = limits
    return out, [pattern for k, (pattern, _) in enumerate(table) if k not in used]
