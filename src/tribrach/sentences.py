"""Sentences that keep their figures: text with quantities, written in the unit of a project.

A :class:`Sentence` is made where something is found, of a template and of values in metres, radians
or one. It is a string, with a decimal point and in the units that the template names; a report asks
it for the same in its own notation, so that nobody reads numbers out of finished English.

A field of a template is ``{name}`` for words and counts, or ``{name:unit digits}``: ``{s:mm2}`` is
a length in millimetres with two digits, ``{a:arcsec1}``, ``{a:°0}``, ``{share:%1}``, ``{k:ppm0}``,
``{t:2}`` a plain number, ``{x:g3}`` one with three digits that count, ``{x:g}`` with as many as it
has, six at most. ``~`` behind it leaves the
unit out, for the first of two figures: ``{v:mm2~} ± {s:mm2}``. ``,`` groups thousands, ``+`` always
shows the sign. ``{share:%}`` has the digits that tell it from nothing and from all
(:func:`tribrach.units.percent`).
"""

from __future__ import annotations

import math
import re
import string
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self

from tribrach.units import UNITS, percent

_SPEC = re.compile(
    r"(?P<unit>[^\d,~+]*?)(?P<sign>\+?)(?P<how>g?)(?P<digits>\d*)(?P<group>,?)(?P<bare>~?)"
)
#: by unit the factor from metres, radians or one, and how it stands behind a number
_SCALES: dict[str, tuple[float, str]] = {
    "": (1.0, ""),
    "m": (1.0, " m"),
    "km": (1e-3, " km"),
    "cm": (1e2, " cm"),
    "mm": (1e3, " mm"),
    "ppm": (1e6, " ppm"),
    "%": (1e2, " %"),
    "°": (1 / UNITS["deg"], "°"),
    "degrees": (1 / UNITS["deg"], " degrees"),
    "arcsec": (1 / UNITS["arcsec"], " arcsec"),
    "arc seconds": (1 / UNITS["arcsec"], " arc seconds"),
    "″": (1 / UNITS["arcsec"], "″"),
    "gon": (1 / UNITS["gon"], " gon"),
    "mgon": (1 / UNITS["mgon"], " mgon"),
}
#: a text that begins with the name of a file
_FILE = re.compile(r"[^\s/]+\.[A-Za-z]\w*\b[: ]")
#: units of the other circle
_TURNED = {
    "gon": {"°": "gon", "degrees": "gon", "arcsec": "mgon", "arc seconds": "mgon"},
    "deg": {"gon": "°", "mgon": "arcsec"},
}
_FORMATTER = string.Formatter()
#: digits from which on a number is grouped
_GROUPED = 5


@dataclass(frozen=True)
class Notation:
    """How numbers are written."""

    decimal: str = "."  #: between the whole number and its fraction
    thousands: str = ""  #: between groups of three digits, nothing if empty
    #: unit of the angles in sentences; without it they stay as they were said
    angle: Literal["gon", "deg"] | None = None
    #: between a number and its unit, and around the sign before what it may be wrong by
    space: str = " "

    def words(self, text: str) -> str:
        """A sentence with its figures in this notation; other text as it is."""
        return text.written(self) if isinstance(text, Sentence) else text

    def cell(self, text: str) -> str:
        """The text of a number, with a decimal point, in this notation; what is none stays."""
        if isinstance(text, Sentence):
            return text.written(self)
        plain = self.decimal == "." and not self.thousands
        found = _CELL.fullmatch(text)
        if found is None:
            return text
        sign, whole, fraction, unit = found.groups()
        whole = whole if plain else whole.replace(",", "")
        if self.thousands and len(whole) >= _GROUPED:
            whole = f"{int(whole):,}".replace(",", self.thousands)
        unit = "" if unit is None else self.space + unit[1:]
        return f"{sign}{whole}{'' if fraction is None else self.decimal + fraction}{unit}"


#: a number that fills a cell
_CELL = re.compile(r"([-+]?)(\d[\d,]*)(?:\.(\d+))?( (?:%|mm|″|mgon))?")
#: numbers as they are made
PLAIN = Notation()


class Sentence(str):
    """Text that keeps its figures, written with the units that a project wants.

    Parameters
    ----------
    template : str
        With fields in braces, see above.
    **values
        Of the fields: words, counts, other sentences, quantities in metres, radians or one, and
        objects whose attributes and items the fields name: ``{test.statistic:1}``, ``{pair[0]}``.

    Attributes
    ----------
    values : mapping
        What each field has, by its name in the template.

    Examples
    --------
    >>> Sentence("{name} moved {by:mm1}", name="P7", by=0.00321)
    'P7 moved 3.2 mm'
    """

    template: str
    values: Mapping[str, Any]

    def __new__(cls, template: str, **values: Any) -> Self:
        """Fill the template."""
        fields = [name for _, name, _, _ in _FORMATTER.parse(template) if name is not None]
        return cls.of(
            template, {name: _FORMATTER.get_field(name, (), values)[0] for name in fields}
        )

    @classmethod
    def of(cls, template: str, values: Mapping[str, Any]) -> Self:
        """A sentence of what each of its fields has."""
        made = super().__new__(cls, _filled(template, values, PLAIN))
        made.template, made.values = template, values
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).of, (self.template, self.values)

    def __add__(self, more: str) -> Sentence:
        return Sentence("{own}{more}", own=self, more=more)

    def __radd__(self, before: str) -> Sentence:
        return Sentence("{before}{own}", own=self, before=before)

    def written(self, notation: Notation) -> str:
        """The sentence with its figures in a notation."""
        return _filled(self.template, self.values, notation)


def written(value: float, spec: str, notation: Notation = PLAIN) -> str:
    """A quantity as a field of a template has it: ``written(0.0012, "mm1")`` is 1.2 mm."""
    found = _SPEC.fullmatch(spec)
    if found is None or found["unit"] not in _SCALES:
        raise ValueError(f"no quantity is written as {spec!r}")
    unit = found["unit"]
    factor, behind = _SCALES[unit]
    if spec.rstrip("~") == "%":
        text = percent(value).removesuffix(behind)
    else:
        text = _text(value * factor, found["sign"] + found["group"], found["how"], found["digits"])
    turned = _TURNED.get(notation.angle or "", {}).get(unit)
    if turned is not None and math.isfinite(value):
        factor, behind = _SCALES[turned]
        # as sharp as it would have been
        sharp = max(2, len(text.lstrip("-+").replace(".", "").lstrip("0")))
        size = abs(value * factor)
        digits = max(0, sharp - 1 - math.floor(math.log10(size * (1 + 1e-9)))) if size else 0
        text = f"{value * factor:.{digits}f}"
    behind = "" if found["bare"] else behind.replace(" ", notation.space)
    return notation.cell(text) + behind


def joined(between: str, parts: Iterable[str]) -> str:
    """Parts one behind the other, with their figures."""
    given = list(parts)
    if not any(isinstance(part, Sentence) for part in given):
        return between.join(given)
    between = between.replace("{", "{{").replace("}", "}}")
    fields = {f"part{k}": part for k, part in enumerate(given)}
    return Sentence(between.join(f"{{{name}}}" for name in fields), **fields)


def capital(text: str) -> str:
    """A text that begins with a capital, unless it begins with the name of a file."""
    if not isinstance(text, Sentence):
        return text if _FILE.match(text) else text[:1].upper() + text[1:]
    if text.template[:1] != "{":
        return Sentence.of(text.template[:1].upper() + text.template[1:], text.values)
    name = text.template[1:].split("}")[0]
    value = text.values.get(name)
    if not isinstance(value, str):
        return text
    return Sentence.of(text.template, {**text.values, name: capital(value)})


def stopped(text: str) -> str:
    """A text that ends with a full stop, or with the mark that it has."""
    return text if text.endswith((".", "!", "?")) else text + "."


def scaled(value: Any, spec: str) -> Any:
    """Quantities in the unit of a field: ``scaled(metres, "mm1")``, one or an array."""
    found = _SPEC.fullmatch(spec)
    return value * _SCALES[found["unit"] if found else ""][0]


def _text(value: float, before: str, how: str, digits: str) -> str:
    """Digits of a number, from a million on with a power of ten; ``before`` them a sign."""
    if how and digits and 10 ** int(digits) - 0.5 <= abs(value) < 1e6:
        value, how, digits = float(f"{value:.{digits}g}"), "", "0"
    if not digits and not how:
        return f"{int(value) if value == int(value) else value:{before}}"
    return f"{value:{before}{digits and '.' + digits}{'g' if how else 'f'}}"


def _filled(template: str, values: Mapping[str, Any], notation: Notation) -> str:
    """A template with its values."""
    parts = []
    for text, name, spec, _ in _FORMATTER.parse(template):
        parts.append(text.replace(" ± ", f"{notation.space}±{notation.space}"))
        if name is None:
            continue
        value = values[name]
        if spec:
            parts.append(written(float(value), spec, notation))
        else:
            parts.append(notation.words(value) if isinstance(value, str) else str(value))
    return "".join(parts)
