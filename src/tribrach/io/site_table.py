"""Test sites from a CSV file: ``name,x,y,z,radius`` or ``name,xmin,ymin,zmin,xmax,ymax,zmax``.

Metres in the frame of the clouds. UTF-8; comma, semicolon or tab between cells; lines that begin
with ``#`` are comments. Further columns are passed over.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

from tribrach.comparison.sites import Site
from tribrach.errors import InputError
from tribrach.io.xml_file import read_bytes

__all__ = ["read_sites"]

_BALL = ("x", "y", "z", "radius")
_BOX = ("xmin", "ymin", "zmin", "xmax", "ymax", "zmax")


def read_sites(path: Path) -> list[Site]:
    """The sites of a file, in its order.

    Raises
    ------
    InputError : unreadable, not UTF-8 text, columns of neither kind or of both, a row of another
        length, a cell that is no finite number, a radius or side that is not above zero, a name
        that is empty or there twice.
    """
    rows = _rows(path)
    line, header = rows[0]
    titles = [" ".join(title.split()).lower() for title in header]
    wanted = _wanted(path, line, titles)
    sites: dict[str, Site] = {}
    for line, cells in rows[1:]:
        if len(cells) != len(titles):
            what = f"the row has {len(cells)} cells, the header has {len(titles)}"
            raise InputError(what, file=path, line=line, cure="give every row the same cells")
        name = cells[titles.index("name")].strip()
        if not name or name in sites:
            what = f"there is a site {name!r} above" if name else "the site has no name"
            raise InputError(what, file=path, line=line, cure="give every site its own name")
        numbers = [_number(path, line, column, cells[titles.index(column)]) for column in wanted]
        sites[name] = _site(path, line, name, numbers)
    return list(sites.values())


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows of cells with their 1-based lines, the header first."""
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "the file is not UTF-8 text", file=path, cure="save it as UTF-8"
        ) from error
    if "\0" in text:
        raise InputError("the file is not text", file=path, cure="give a CSV file in UTF-8")
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(kept) < 2:
        what = "there are no sites under the header" if kept else "the file is empty"
        raise InputError(what, file=path, cure="give a header and a row for each site")
    separator = max(",;\t", key=kept[0][1].count)
    return [(number, next(csv.reader([line], delimiter=separator))) for number, line in kept]


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
    """A finite number."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        what = f"{column} is {cell.strip()!r}, not a number"
        raise InputError(what, file=path, line=line, cure="give metres, decimals with a point")
    return value


def _site(path: Path, line: int, name: str, numbers: list[float]) -> Site:
    """A ball of four numbers, a box of six."""
    if len(numbers) == len(_BALL):
        x, y, z, radius = numbers
        if not radius > 0:
            raise InputError(
                f"the radius is {radius:g}", file=path, line=line, cure="give metres above zero"
            )
        return Site.ball(name, (x, y, z), radius)
    low, high = (numbers[0], numbers[1], numbers[2]), (numbers[3], numbers[4], numbers[5])
    for axis, start, end in zip("xyz", low, high, strict=True):
        if not start < end:
            what = f"{axis}min is not below {axis}max"
            raise InputError(what, file=path, line=line, cure="exchange them")
    return Site(name, low, high)
