"""Test sites from a CSV file: ``name,x,y,z,radius`` or ``name,xmin,ymin,zmin,xmax,ymax,zmax``.

Metres in the frame of the clouds. Text or a spreadsheet (:mod:`tribrach.io.csv_rows`). Further
columns are ignored.
"""

from __future__ import annotations

import math
from pathlib import Path

from tribrach.comparison.sites import ComparisonSite
from tribrach.errors import InputError
from tribrach.io.csv_rows import read_rows
from tribrach.io.decimals import plain

_BALL = ("x", "y", "z", "radius")
_BOX = ("xmin", "ymin", "zmin", "xmax", "ymax", "zmax")


def read_sites(path: Path) -> list[ComparisonSite]:
    """The sites of a file, in its order."""
    table = read_rows(path)
    rows, lines = table.cells, table.lines
    titles = [" ".join(title.split()).lower() for title in rows[0]]
    wanted = _wanted(path, lines[0], titles)
    places = [titles.index(column) for column in wanted]
    decimal, _ = table.decimal(places)
    sites: dict[str, ComparisonSite] = {}
    for cells, line in zip(rows[1:], lines[1:], strict=True):
        name = cells[titles.index("name")].strip()
        if not name or name in sites:
            what = f"there is a site {name!r} above" if name else "the site has no name"
            raise InputError(what, file=path, line=line, cure="give every site its own name")
        numbers = [
            _number(path, line, column, plain(cells[place], decimal))
            for column, place in zip(wanted, places, strict=True)
        ]
        sites[name] = _site(path, line, name, numbers)
    return list(sites.values())


def _wanted(path: Path, line: int, titles: list[str]) -> tuple[str, ...]:
    """The columns of balls or of boxes, whichever the header has."""
    for title in titles:
        if titles.count(title) > 1:
            raise InputError(
                f"the column {title!r} is there twice", file=path, line=line, cure="remove one"
            )
    kinds = [kind for kind in (_BALL, _BOX) if all(column in titles for column in kind)]
    if "name" not in titles or len(kinds) != 1:
        what = "the columns are those of balls and of boxes"
        if len(kinds) < 2:
            what = "the columns do not say what the sites are"
        raise InputError(
            what,
            file=path,
            line=line,
            cure=f"name them name,{','.join(_BALL)} or name,{','.join(_BOX)}",
        )
    return kinds[0]


def _number(path: Path, line: int, column: str, cell: str) -> float:
    """A finite number [m]."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        what = f"{column} is {cell.strip()!r}, not a number"
        raise InputError(what, file=path, line=line, cure="give metres")
    return value


def _site(path: Path, line: int, name: str, numbers: list[float]) -> ComparisonSite:
    """A ball from four numbers, a box from six."""
    if len(numbers) == len(_BALL):
        x, y, z, radius = numbers
        if not radius > 0:
            raise InputError(
                f"the radius is {radius:g}", file=path, line=line, cure="give metres above zero"
            )
        return ComparisonSite.ball(name, (x, y, z), radius)
    low, high = (numbers[0], numbers[1], numbers[2]), (numbers[3], numbers[4], numbers[5])
    for axis, start, end in zip("xyz", low, high, strict=True):
        if not start < end:
            what = f"{axis}min is not below {axis}max"
            raise InputError(what, file=path, line=line, cure="exchange them")
    return ComparisonSite(name, low, high)
