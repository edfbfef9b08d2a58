"""What the user says of files of scans that do not say it themselves, while they are read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from tribrach.errors import InputError
from tribrach.io.scans.units import named_unit
from tribrach.scan.length_unit import LengthUnit


@dataclass(frozen=True)
class ScanReading:
    """Settings for reading files of scans."""

    unit: LengthUnit | None = None  #: what coordinates are counted in
    #: names of the columns of text, ``-`` for one that is left out
    columns: tuple[str, ...] | None = None
    decimal: str | None = None  #: what stands before decimals, a point or a comma


_NOTHING = ScanReading()
_TOLD: ContextVar[ScanReading] = ContextVar("how scans are read", default=_NOTHING)


def reading() -> ScanReading:
    """The settings that hold now."""
    return _TOLD.get()


@contextmanager
def as_told(
    unit: str | None = None, columns: str | None = None, decimal: str | None = None
) -> Iterator[None]:
    """A block in which files of scans are read as the user says.

    ``unit``: of coordinates, such as ``mm`` or ``ft``; ``columns``: names of the columns of text,
    with blanks or commas between them.
    """
    known = None
    if unit is not None:
        known = named_unit(unit)
        if known is None or known.factors is None:
            raise InputError(f"{unit!r} is no unit of length", cure="say m, mm, cm, ft or usft")
        known = LengthUnit(known.names, known.factors, "as given")
    names = None if columns is None else tuple(columns.replace(",", " ").split())
    mark = None if decimal is None else {"point": ".", "comma": ","}[decimal]
    token = _TOLD.set(ScanReading(known, names, mark))
    try:
        yield
    finally:
        _TOLD.reset(token)
