"""Kinds of columns that the tables of the report are made of."""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import attrgetter
from pathlib import PurePath
from typing import Any

from tribrach.report.names import spoken
from tribrach.report.numbers import Style
from tribrach.report.tables import Cell, ColumnHead, Spec, number_cell, text_cell
from tribrach.sentences import written
from tribrach.units import format_angle

AXES = ("E", "N", "U")


def column(
    head: str,
    get: str | Callable[[Any], Any],
    spec: str | Callable[[Any, Any], str] = "",
    *,
    unit: str = "",
    mark: Callable[[Any], str] = lambda item: "",
    wide: bool = False,
) -> Spec:
    """A column of words, or of quantities that are written like those of sentences."""
    take = along(get) if isinstance(get, str) else get
    if not spec:
        return ColumnHead(head, unit, numeric=False, wide=wide), lambda item: text_cell(
            take(item), mark(item)
        )

    def cell(item: Any) -> Cell:
        value = take(item)
        if value is None or math.isnan(value):
            return Cell("")
        value = float(value)
        text = written(value, f"{spec}~") if isinstance(spec, str) else spec(value, item)
        return number_cell(value if math.isfinite(value) else None, text, mark(item))

    below = unit or (spec.rstrip("0123456789g,") if isinstance(spec, str) else "")
    return ColumnHead(head, below, wide=wide), cell


def along(path: str) -> Callable[[Any], Any]:
    """Takes an attribute by the names that lead to it; None where one of them is None."""
    *names, last = path.split(".")
    if not names:
        return attrgetter(last)

    def take(item: Any) -> Any:
        for name in names:
            item = getattr(item, name)
            if item is None:
                return None
        return getattr(item, last)

    return take


def passed(get: Callable[[Any], bool], words: tuple[str, str] = ("passed", "failed")) -> Spec:
    """A column of verdicts without a head: what passes is green, the rest red."""
    return ColumnHead("", numeric=False), lambda item: text_cell(
        words[not get(item)], ("good", "bad")[not get(item)]
    )


def component(path: str, k: int) -> Callable[[Any], float | None]:
    """Takes one number of several, None where there is none."""
    get = attrgetter(path)

    def value(item: Any) -> float | None:
        triple = get(item)
        return None if triple is None or triple[k] is None else float(triple[k])

    return value


class ColumnSet:
    """Columns in one style; each is a head and how to make a cell of an item."""

    def __init__(self, style: Style) -> None:
        self.style = style

    def word(self, head: str, path: str, *, wide: bool = False) -> Spec:
        """Words of an attribute."""
        get = attrgetter(path)
        return ColumnHead(head, numeric=False, wide=wide), lambda item: text_cell(get(item))

    def source(self) -> Spec:
        """File and line of each item, of an absolute path the file alone."""
        return ColumnHead("Source", numeric=False), lambda item: text_cell(
            PurePath(item.source).name
            if PurePath(item.source).is_absolute()
            else spoken(item.source)
        )

    def scan(self, head: str, path: str) -> Spec:
        """Names of scans as one would say them."""
        get = attrgetter(path)
        return ColumnHead(head, numeric=False), lambda item: text_cell(spoken(get(item)))

    def plain(self, head: str, path: str, digits: int = 2, *, wide: bool = False) -> Spec:
        """A number without a unit."""
        get = attrgetter(path)
        return ColumnHead(head, wide=wide), lambda item: number_cell(
            get(item), self.style.plain(get(item), digits)
        )

    def metres(self, head: str, get: Callable[[Any], float | None]) -> Spec:
        """Coordinates [m]."""
        return ColumnHead(head, "m"), lambda item: number_cell(
            get(item), self.style.value(get(item), "m")
        )

    def mm(
        self, head: str, get: Callable[[Any], float | None], digits: int = 2, *, wide: bool = False
    ) -> Spec:
        """Small lengths, given in metres and written in millimetres."""
        return ColumnHead(head, "mm", wide=wide), lambda item: number_cell(
            get(item), self.style.small(get(item), "m", digits)
        )

    def angle(
        self,
        head: str,
        get: Callable[[Any], float | None],
        *,
        full_circle: bool = False,
        wide: bool = False,
    ) -> Spec:
        """Angles, given in radians and written in the chosen unit."""
        return ColumnHead(head, self.style.value_unit("rad"), wide=wide), lambda item: number_cell(
            get(item), self.style.value(get(item), "rad", full_circle=full_circle)
        )

    def small_angle(
        self, head: str, get: Callable[[Any], float | None], *, wide: bool = False
    ) -> Spec:
        """Sigmas of angles, given in radians."""
        return ColumnHead(head, self.style.small_unit("rad"), wide=wide), lambda item: number_cell(
            get(item), self.style.small(get(item), "rad")
        )

    def axes(self, prefix: str, path: str, make: Callable[..., Spec], **options: Any) -> list[Spec]:
        """One column for each of E, N and U of a triple."""
        get = attrgetter(path)
        return [
            make(prefix + axis, lambda item, k=k: get(item)[k], **options)
            for k, axis in enumerate(AXES)
        ]

    def bearing(self, head: str, get: Callable[[Any], float | None], *, wide: bool = False) -> Spec:
        """Directions of axes, to a tenth of a gon or degree."""
        unit = "gon" if self.style.angle == "gon" else "deg"
        return ColumnHead(
            head, unit if unit == "gon" else "°", wide=wide
        ), lambda item: number_cell(
            get(item), "" if get(item) is None else format_angle(get(item) or 0.0, unit, 1)
        )

    def ellipse(self, *, wide: bool = False) -> list[Spec]:
        """Ellipse in plan and height interval of a point or station."""
        return [
            self.mm("ellipse a", lambda p: p.ellipse and p.ellipse.major, wide=wide),
            self.mm("ellipse b", lambda p: p.ellipse and p.ellipse.minor, wide=wide),
            self.bearing("azimuth", lambda p: p.ellipse and p.ellipse.azimuth, wide=wide),
            self.mm("± U", lambda p: p.height_interval, wide=wide),
        ]


def millimetres(head: str, get: Any, *, wide: bool = False) -> Spec:
    """Millimetres, without decimals where they would be more than a metre."""
    spec = ("mm0~", "mm2~")
    return column(head, get, lambda v, _: written(v, spec[v < 1]), unit="mm", wide=wide)
