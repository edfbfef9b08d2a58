"""Names as a person would say them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

#: so many numbers in a row are said by the first and the last
_ROW = 3


def spoken(name: str) -> str:
    """A name of a scan as one would say it: ``S1, targets`` for the scan S1-targets at S1.

    Scans of a station with several are named after both, and files often begin with the name of
    the station as well. Everything else stays as it is, also what follows after the name.
    """
    station, _, scan = name.partition(" ")
    rest = scan.removeprefix(station)
    if not station or rest == scan or rest[:1] not in tuple("-_. ") or len(rest) < 2:
        return name
    return f"{station}, {rest[1:]}"


def some_of(names: Sequence[str], most: int) -> str:
    """The first names and how many more there are: A; A and B; A, B and 3 more."""
    shown, more = list(names[:most]), len(names) - most
    if more > 0:
        shown.append(f"{more} more")
    return " and ".join(filter(None, [", ".join(shown[:-1]), *shown[-1:]]))


def numbered(names: Sequence[str]) -> str:
    """All names: 1 to 4, 7 and 9, where names are whole numbers that follow each other."""
    rows: list[list[str]] = []
    for name in names:
        last = rows[-1][-1] if rows else ""
        follows = last.isdecimal() and name == str(int(last) + 1)
        rows[-1:] = [[*rows[-1], name]] if follows else [*rows[-1:], [name]]
    said = [
        part for row in rows for part in ([f"{row[0]} to {row[-1]}"] if len(row) >= _ROW else row)
    ]
    return some_of(said, len(said))


def told_apart(one: Path, two: Path) -> tuple[str, str]:
    """Two files by name, with as many of their folders as it takes to tell them apart."""
    a, b = one.resolve().parts, two.resolve().parts
    most = max(len(a), len(b))
    shown = next((k for k in range(1, most) if a[-k:] != b[-k:]), 1)
    return "/".join(a[-shown:]), "/".join(b[-shown:])
