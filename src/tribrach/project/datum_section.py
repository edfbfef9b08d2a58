"""The section ``[datum]`` of a project, and the same in one string."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import model_validator

from tribrach.errors import InputError
from tribrach.network.network import Datum
from tribrach.project.section import Section

__all__ = ["DatumSection", "parse_datum"]


def parse_datum(words: str) -> Datum:
    """A datum from ``control``, ``free``, ``free:A,B`` or ``fixed:A,B``.

    Raises
    ------
    InputError : anything else.
    """
    kind, _, rest = words.partition(":")
    kind, names = kind.strip(), tuple(n.strip() for n in rest.split(",") if n.strip())
    if kind == "control" and not names:
        return Datum("control")
    if kind == "free":
        return Datum("free", names)
    if kind == "fixed" and names:
        return Datum("fixed", names)
    raise InputError(f"{words!r} is no datum", cure="write control, free, free:A,B,C or fixed:A,B")


class DatumSection(Section):
    """Control as given, inner constraints over points, or points held at their coordinates.

    Also written as one string, ``datum = "free:A,B"``.
    """

    kind: Literal["control", "free", "fixed"] = "control"
    points: tuple[str, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _from_words(cls, data: Any) -> Any:
        if not isinstance(data, str):
            return data
        try:
            datum = parse_datum(data)
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error
        return {"kind": datum.kind, "points": datum.names}

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind == "fixed" and not self.points:
            raise ValueError("a fixed datum names its points")
        if self.kind == "control" and self.points:
            raise ValueError("the datum control takes no points: the files of points say which")
        return self
