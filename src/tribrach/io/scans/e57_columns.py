"""Which column of an E57 scan becomes which field, and through which buffer?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.e57_pages import child, number
from tribrach.scan.scan import Field

__all__ = ["CARTESIAN", "SPHERICAL", "Column", "columns", "integer_type"]

Values = NDArray[Any]

CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLOURS = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}
_KNOWN = {
    "intensity": ("intensity", "float32"),
    **{theirs: (ours, "uint16") for theirs, ours in _COLOURS.items()},
    "timeStamp": ("time", "float64"),
    "returnIndex": ("return_number", "uint8"),
    "returnCount": ("number_of_returns", "uint8"),
    "rowIndex": ("row", "int32"),
    "columnIndex": ("column", "int32"),
    "normalX": ("normal_x", "float32"),
    "normalY": ("normal_y", "float32"),
    "normalZ": ("normal_z", "float32"),
}
#: columns that say which values of others mean nothing
_FLAGS = {
    "isIntensityInvalid": ("intensity",),
    "isColorInvalid": ("red", "green", "blue"),
    "isTimeStampInvalid": ("time",),
}
#: buffers that pye57 takes by type; other integers go through "q", for "l" is 32 bits to it
_BUFFERS = {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "float32": "f", "float64": "d"}
_INTEGERS = ("uint8", "int8", "uint16", "int16", "int32", "uint32", "int64")


@dataclass(frozen=True)
class Column:
    """A column on its way from the file into a field.

    path : its name in the file; field : what it becomes; buffer : type character of the buffer;
    low, high : limits that colours are stretched from; flag : the column that invalidates it.
    """

    path: str
    field: Field
    buffer: str
    low: float = 0.0
    high: float = 65535.0
    flag: str | None = None

    def values(self, raw: Values, invalid: Values | None) -> Values:
        """The field from what the buffer holds (n,); invalid (n,) : values that mean nothing.

        These become zero, intensities the low limit.

        Raises
        ------
        InputError : values beyond the field's type.
        """
        out = self._converted(raw)
        if invalid is not None and invalid.any():
            nothing = self.field.low if self.field.name == "intensity" else None
            out[invalid.astype(bool)] = 0 if nothing is None else nothing
        return out

    def _converted(self, raw: Values) -> Values:
        """A new array of the field's type."""
        if self.field.name in _COLOURS.values():
            if (self.low, self.high) == (0, 65535) and raw.dtype == np.uint16:
                return raw.copy()
            if (self.low, self.high) == (0, 255) and raw.dtype != np.float64:
                wide: Values = np.multiply(np.minimum(raw, 255), 257, dtype=np.uint16)
                return wide
            share = (raw.astype(np.float64) - self.low) / max(self.high - self.low, 1e-300)
            whole: Values = np.rint(65535 * np.clip(np.nan_to_num(share), 0, 1))
            return whole.astype(np.uint16)
        if self.field.name == "return_number":  # counted from zero in the file
            return np.clip(raw.astype(np.int64) + 1, 0, 255).astype(np.uint8)
        kind = np.dtype(self.field.dtype)
        if raw.dtype == np.longlong and kind.itemsize < 8 and len(raw):
            limits = np.iinfo(kind)
            if raw.min() < limits.min or raw.max() > limits.max:
                raise InputError(f"values of {self.path} do not fit {kind.name}")
        return raw.astype(kind)


def integer_type(low: float | None, high: float | None) -> str:
    """The smallest integers that hold low to high; 64 bits if that is not said."""
    if low is None or high is None:
        return "int64"
    fits = (n for n in _INTEGERS if np.iinfo(n).min <= low and high <= np.iinfo(n).max)
    return next(fits, "int64")


def columns(
    scan: etree._Element, prototype: etree._Element, taken: Sequence[str], notes: dict[str, str]
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """Columns besides those that coordinates are made of, and sentences about the odd ones.

    taken : columns that are coordinates; notes : descriptions by name of a column.
    """
    found: list[Column] = []
    odd: list[str] = []
    for element in prototype:
        if not isinstance(element.tag, str):
            continue
        local = etree.QName(element).localname
        path = f"{element.prefix}:{local}" if element.prefix else local
        if path in taken:
            continue
        if element.get("type") not in ("Float", "Integer", "ScaledInteger"):
            odd.append(f"column {path} holds no numbers and is left out")
            continue
        column = _column(scan, element, local, path, notes.get(local, ""))
        if column.field.name in {one.field.name for one in found}:
            column = replace(column, field=replace(column.field, name=path))
        found.append(column)
        if column.field.name in _COLOURS.values() and column.high <= column.low:
            odd.append(f"the limits of {path} are empty")
    flags = {n: f for f, names in _FLAGS.items() for n in names if f in {c.path for c in found}}
    return tuple(replace(c, flag=flags.get(c.field.name)) for c in found), tuple(odd)


def _column(
    scan: etree._Element, element: etree._Element, local: str, path: str, note: str
) -> Column:
    """One column by its element of the prototype."""
    low, high = _limits(element)
    kind = _type(element, low, high)
    known = _KNOWN.get(local) if element.prefix is None or local.startswith("normal") else None
    name, own = known or (local, kind)
    if local in _COLOURS:
        low, high = _stated(scan, "colorLimits", local, low, high)
        low, high = (0.0, 255.0) if low is None or high is None else (low, high)
        buffer = {"uint8": "B", "uint16": "H"}.get(kind, "d")
        return Column(path, Field(name, own, 0.0, 65535.0), buffer, low, high)
    if name == "intensity":
        low, high = _stated(scan, "intensityLimits", "intensity", low, high)
        return Column(path, Field(name, own, low, high), "f")
    if name == "return_number":  # its limits count from zero
        low = high = None
    buffer = _BUFFERS.get(own if np.dtype(own).kind == "f" else kind, "q")
    buffer = "d" if kind == "float64" else buffer
    return Column(path, Field(name, own, low, high, note), buffer)


def _type(element: etree._Element, low: float | None, high: float | None) -> str:
    """What a column holds, as numpy calls it."""
    if element.get("type") == "Integer":
        return integer_type(low, high)
    single = element.get("type") == "Float" and element.get("precision") == "single"
    return "float32" if single else "float64"


def _limits(element: etree._Element) -> tuple[float | None, float | None]:
    """Limits of a column, scaled; None where it has none."""
    try:
        low, high = (float(element.attrib[k]) for k in ("minimum", "maximum"))
        if element.get("type") == "ScaledInteger":
            scale, offset = float(element.get("scale", "1")), float(element.get("offset", "0"))
            low, high = low * scale + offset, high * scale + offset
    except (KeyError, ValueError):
        return None, None
    return (low, high) if np.isfinite([low, high]).all() else (None, None)


def _stated(
    scan: etree._Element, group: str, name: str, low: float | None, high: float | None
) -> tuple[float | None, float | None]:
    """Limits that the scan states, else those of the column."""
    stated = tuple(number(child(scan, group, f"{name}{end}")) for end in ("Minimum", "Maximum"))
    return (low, high) if None in stated else (stated[0], stated[1])
