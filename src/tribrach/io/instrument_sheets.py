"""Data sheets of instruments, with the source of each figure.

Figures carry their unit in their name, as in a project file. One that the maker does not publish
has a default whose source says so. They are figures of the makers, whose meaning (one sigma, a
limit, which surface) differs from sheet to sheet; a figure by a standard names it. A field check is
worth more.
"""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from tribrach.errors import InputError

_ABOUT = ("aliases", "kind", "status", "remark")


@dataclass(frozen=True)
class Figure:
    """One figure of a sheet."""

    key: str  #: name with its unit, such as ``range_mm``
    value: float  #: in that unit
    source: str  #: where the figure comes from
    #: what the maker determined it by, such as ``ISO 17123-3``; "" if the sheet names nothing
    standard: str = ""

    @property
    def published(self) -> bool:
        """False for a default that stands in for a figure which the maker does not give."""
        return not self.source.startswith("default")


@dataclass(frozen=True)
class Sheet:
    """The sheet of an instrument."""

    name: str  #: of the model
    kind: str  #: of instrument
    #: ``read`` if its figures were compared with their sources, ``quoted`` if they should be
    #: compared with the sheet of the instrument at hand
    status: Literal["read", "quoted"]
    figures: tuple[Figure, ...]  #: with their sources
    aliases: tuple[str, ...] = ()  #: models with the same figures
    remark: str = ""  #: on the sheet

    @property
    def values(self) -> dict[str, float]:
        """Figures by key."""
        return {figure.key: figure.value for figure in self.figures}

    def figure(self, key: str) -> Figure | None:
        """A figure of the sheet; None for one that is not on it."""
        return next((figure for figure in self.figures if figure.key == key), None)


@cache
def sheets() -> tuple[Sheet, ...]:
    """All sheets of the package."""
    text = (files("tribrach.io") / "sheets.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    return tuple(
        _sheet(name, entry, data["sources"]) for name, entry in data["instruments"].items()
    )


def find_sheet(name: str) -> Sheet:
    """The sheet of a model; capitals and blanks do not matter."""
    known = {_plain(word): sheet for sheet in sheets() for word in (sheet.name, *sheet.aliases)}
    sheet = known.get(_plain(name))
    if sheet is not None:
        return sheet
    near = difflib.get_close_matches(_plain(name), known, 3, cutoff=0.5)
    names = list(dict.fromkeys(known[word].name for word in near)) or [s.name for s in sheets()]
    raise InputError(
        f"there is no sheet of an instrument {name!r}",
        cure=f"{'the nearest are' if near else 'there are'} {', '.join(names)}; or leave sheet out "
        "and give the figures",
    )


def _plain(name: str) -> str:
    """A name in small letters and digits."""
    return "".join(c for c in name.lower() if c.isalnum())


def _sheet(name: str, entry: dict[str, Any], sources: dict[str, str]) -> Sheet:
    """A sheet by its entry of the file."""
    figures = [
        Figure(key, float(value[0]), sources[value[1]], *value[2:])
        for key, value in entry.items()
        if key not in _ABOUT
    ]
    return Sheet(
        name=name,
        kind=entry["kind"],
        status=entry["status"],
        figures=tuple(figures),
        aliases=tuple(entry.get("aliases", ())),
        remark=entry.get("remark", ""),
    )
