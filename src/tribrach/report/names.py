"""Names as a person would say them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

__all__ = ["some_of", "spoken", "told_apart"]


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


def told_apart(one: Path, two: Path) -> tuple[str, str]:
    """Two files by name, with as many of their folders as it takes to tell them apart."""
    a, b = one.resolve().parts, two.resolve().parts
    most = max(len(a), len(b))
    shown = next((k for k in range(1, most) if a[-k:] != b[-k:]), 1)
    return "/".join(a[-shown:]), "/".join(b[-shown:])
