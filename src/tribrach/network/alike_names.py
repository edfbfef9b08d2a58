"""Names that differ in nothing but case, spaces or the Unicode form of their characters.

Two programs, or two people, write one point as ``p1`` and ``P1``, or an accented letter as one
character and as a letter with a mark. To the network these are two points. They may be two: a hint
is given where one of them is observed and the other is not, where they look the same, and beside
the reasons of an adjustment that failed.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence

#: how every hint ends, by which it is found again
_CURE = "write them alike if they are one point."


def _key(name: str) -> str:
    """What names that are alike have in common."""
    return " ".join(unicodedata.normalize("NFKC", name).casefold().split())


def alike_groups(names: Iterable[str]) -> list[tuple[str, ...]]:
    """Names that differ in case, spaces or Unicode form only."""
    groups: dict[str, dict[str, None]] = {}
    for name in names:
        groups.setdefault(_key(name), {})[name] = None
    return [tuple(group) for group in groups.values() if len(group) > 1]


def look_alike(first: str, second: str) -> bool:
    """True if two different names are the same characters in another Unicode form."""
    return first != second and all(
        unicodedata.normalize(form, first) == unicodedata.normalize(form, second)
        for form in ("NFC", "NFKC")
    )


def alike_hint(first: str, second: str, known: str = "") -> str:
    """Say in what two names differ, and what to do about it."""
    if look_alike(first, second):
        what = "the Unicode form of their characters"
    elif first.casefold() == second.casefold():
        what = "case"
    elif "".join(first.split()) == "".join(second.split()) or first.split() == second.split():
        what = "spaces"
    else:
        what = "case, spaces or the Unicode form of their characters"
    return f"Names {first} and {second} differ only in {what}{known}: {_CURE}"


def hints_among(names: Sequence[str], said: Sequence[str]) -> list[str]:
    """Hints for a network that cannot be adjusted."""
    found = [alike_hint(group[0], other) for group in alike_groups(names) for other in group[1:]]
    return list(dict.fromkeys([*(s for s in said if s.endswith(_CURE)), *found]))
