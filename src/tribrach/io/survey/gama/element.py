"""An element of a GNU Gama file with its attributes as typed values.

Every error names file and line. Attributes that the format does not have are refused: a misspelt
``stdev`` would otherwise silently weigh an observation with the default.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from tribrach.errors import InputError, RefusalCollector
from tribrach.units import CC, LARGEST, SEC, parse_angle

T = TypeVar("T")


#: older files leave it out
NAMESPACE = "{http://www.gnu.org/software/gama/gama-local}"

_SIGHT = "from to val stdev from_dh to_dh extern"


#: attributes of each element that takes part in the adjustment
ATTRIBUTES = {
    "network": "axes-xy angles epoch",
    "points-observations": (
        "distance-stdev direction-stdev angle-stdev zenith-angle-stdev azimuth-stdev"
    ),
    "point": "id x y z fix adj extern",
    "obs": "from orientation from_dh",
    "direction": "to val stdev from_dh to_dh extern",
    "distance": _SIGHT,
    "s-distance": _SIGHT,
    "z-angle": _SIGHT,
    "azimuth": _SIGHT,
    "angle": "from bs fs val stdev from_dh bs_dh fs_dh extern",
    "height-differences": "",
    "coordinates": "",
    "vectors": "",
    "dh": "from to val stdev dist extern",
    "vec": "from to dx dy dz from_dh to_dh extern",
    "cov-mat": "dim band",
}

#: the same as words
_KNOWN = {tag: tuple(names.split()) for tag, names in ATTRIBUTES.items()}


@dataclass(frozen=True)
class Element:
    """``node`` of a file that sources call ``label``; ``refused`` gathers refused elements."""

    node: Any
    path: Path
    label: str = ""
    refused: RefusalCollector = field(default_factory=RefusalCollector)

    def __post_init__(self) -> None:
        known = _KNOWN.get(self.tag)
        if known is None:
            return
        for name in self.node.attrib:
            if name not in known and not name.startswith("{"):
                cure = f"use {', '.join(known)}" if known else "leave it out"
                raise self.error(f"<{self.tag}> has no attribute {name}", cure)

    @property
    def tag(self) -> str:
        """Name without the namespace, which older files leave out."""
        return local_name(self.node)

    @property
    def source(self) -> str:
        """``file:line``."""
        return f"{self.file}:{self.node.sourceline}"

    @property
    def file(self) -> str:
        """What sources call the file."""
        return self.label or self.path.name

    def error(self, what: str, cure: str | None = None) -> InputError:
        """An error with file and line, to be raised."""
        return InputError(what, file=self.path, line=self.node.sourceline, cure=cure)

    def children(self, allowed: Collection[str] | None = None) -> Iterator[Element]:
        """Child elements without comments; those that are not allowed here are refused."""
        for node in self.node:
            child = self.allowed(node, allowed)
            if child is not None:
                yield child

    def named(self, name: str) -> Iterator[Element]:
        """Child elements of one name, in any namespace."""
        for node in self.node.iterchildren(f"{{*}}{name}"):
            child = self.allowed(node, None)
            if child is not None:
                yield child

    def child(self, node: Any) -> Element:
        """A node within this element."""
        return Element(node, self.path, self.label, self.refused)

    def allowed(self, node: Any, names: Collection[str] | None) -> Element | None:
        """A child as an element; None for comments and for what is refused, which is noted."""
        if not isinstance(node.tag, str):
            return None
        with self.refused.record():
            child = self.child(node)
            if names is None or child.tag in names:
                return child
            raise child.error(
                f"<{child.tag}> is unknown in <{self.tag}>", f"use {', '.join(names)}"
            )
        return None

    def has(self, name: str) -> bool:
        """True if an attribute is given."""
        return name in self.node.attrib

    def text(self, name: str, default: str | None = None) -> str:
        """Text of an attribute, without blanks around it."""
        given = self.node.get(name)
        if given is None and default is not None:
            return default.strip()
        text = str(given or "").strip()
        if not text:
            raise self.error(f"<{self.tag}> has no {name}", f"give {name}")
        return text

    def choice(self, name: str, values: Collection[str], default: str) -> str:
        """One of several words."""
        word = self.text(name, default)
        if word not in values:
            raise self.error(f"{name} is {word!r}", f"use {', '.join(v for v in values if v)}")
        return word

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number."""
        if default is not None and not self.has(name):
            return default
        return self.as_number(name, self.text(name))

    def positive(self, name: str, default: float | None = None) -> float:
        """A number above zero."""
        value = self.number(name, default)
        if value <= 0:
            raise self.error(f"{name} of <{self.tag}> is {value:g}", "give a number above zero")
        return value

    def as_number(self, name: str, text: str) -> float:
        """A word as a finite number; ``name`` is for the message."""
        try:
            value = float(text)
        except ValueError as error:
            raise self.error(f"{name} of <{self.tag}> is not a number: {text!r}") from error
        if not math.isfinite(value):
            raise self.error(f"{name} of <{self.tag}> is not a finite number: {text}")
        if abs(value) >= LARGEST:
            raise self.error(f"{name} of <{self.tag}> is {text}, beyond any measurement")
        return value

    def angle(self, name: str) -> tuple[float, float]:
        """An angle [rad] in gon with cc or ``D-M-S`` with arc seconds; unit of its sigma [rad]."""
        text = self.text(name)
        sexagesimal = re.match(r"[+-]?\d+-\d+-", text) is not None
        try:
            value = parse_angle(text, "dms" if sexagesimal else "gon")
        except ValueError as error:
            why = str(error) if sexagesimal else repr(text)
            raise self.error(f"{name} of <{self.tag}> is not an angle: {why}") from error
        if not math.isfinite(value):
            raise self.error(f"{name} of <{self.tag}> is not a finite angle: {text}")
        return value, SEC if sexagesimal else CC


def local_name(node: Any) -> str:
    """Name of a node without its namespace, "" for comments."""
    return node.tag.rpartition("}")[2] if isinstance(node.tag, str) else ""


def checked(element: Element, action: Callable[[], T]) -> T:
    """Result of a call for an element; its errors get the file and line."""
    try:
        return action()
    except InputError as error:
        raise element.error(error.what, error.cure) from error
