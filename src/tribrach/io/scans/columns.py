"""From the columns of a file, whatever they are called there, to points and fields."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.scans.units import named_unit
from tribrach.io.survey.csv.headings import coordinate_word
from tribrach.scan.length_unit import LengthUnit
from tribrach.scan.scan import Chunk, Field

_RGB = ("red", "green", "blue")
_NAMES: dict[str, str] = {
    other: name
    for name, others in {
        "x": "x e cartesianx lon long longitude lng",
        "y": "y n cartesiany lat latitude",
        "z": "z u h cartesianz",
        "intensity": "intensity i intensities",
        "red": "red r diffusered",
        "green": "green g diffusegreen",
        "blue": "blue b diffuseblue",
        "time": "time gpstime timestamp t",
        "return_number": "returnnumber",
        "number_of_returns": "numberofreturns",
        "row": "row rowindex",
        "column": "column columnindex col",
        "normal_x": "nx normalx",
        "normal_y": "ny normaly",
        "normal_z": "nz normalz",
    }.items()
    for other in others.split()
}
#: coordinates by the words of tables
_AXES = {"easting": "x", "x": "x", "northing": "y", "y": "y", "height": "z"}
#: what begins like this is an angle
_ANGLES = ("lon", "lng", "lat")
#: a name with its unit in brackets or behind an underscore
_UNIT = re.compile(r"(?P<name>.+?)(?:\s*[\[(](?P<a>[^\])]+)[\])]|(?:_|, ?)(?P<b>[A-Za-z]+))")
#: types of our own fields; all others keep those of the file
_TYPES = {
    "intensity": "float32",
    **dict.fromkeys(_RGB, "uint16"),
    "time": "float64",
    "return_number": "uint8",
    "number_of_returns": "uint8",
    "row": "int32",
    "column": "int32",
    **dict.fromkeys(("normal_x", "normal_y", "normal_z"), "float32"),
}


def known_name(name: str) -> str | None:
    """Our name of a column: ``x``, ``y``, ``z`` or a field of the table; None if it is another.

    Case, ``scalar_``, underscores, quotes and a unit after the name do not matter.
    """
    bare = (_with_unit(name)[0] if _with_unit(name)[1] else name).strip().lower()
    scalar = bare.startswith("scalar_")
    bare = re.sub(r"[\s_\"'#/-]", "", bare.removeprefix("scalar_"))
    # a scalar field of one letter is none of ours: its name would be whole
    if scalar and len(bare) == 1:
        return None
    return _NAMES.get(bare) or _AXES.get(coordinate_word(bare) or "")


def column_unit(name: str) -> LengthUnit | None:
    """The unit that stands after the name of a coordinate: ``X [mm]``, ``easting_ft``."""
    if known_name(name) not in ("x", "y", "z"):
        return None
    return (
        named_unit("deg") if name.strip("\"' ").lower().startswith(_ANGLES) else _with_unit(name)[1]
    )


def _with_unit(name: str) -> tuple[str, LengthUnit | None]:
    """A name without its unit, and the unit; the whole name where it has none."""
    match = _UNIT.fullmatch(name.strip().strip("\"'"))
    unit = None if match is None else named_unit(match["a"] or match["b"])
    return (name, None) if match is None or unit is None else (match["name"], unit)


@dataclass(frozen=True)
class ColumnRoles:
    """Which columns of a file are coordinates and which are fields."""

    xyz: tuple[str, str, str]  #: names of the coordinates in the file
    fields: tuple[Field, ...]  #: the fields of the scan
    sources: tuple[str, ...]  #: their names in the file
    factors: tuple[float, ...]  #: that stretch colours to 65535, 1 for everything else

    def coordinates(self, columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
        """Points (n, 3) [m] of columns, finite or not."""
        with np.errstate(invalid="ignore"):  # a signalling NaN is one all the same
            return np.stack([columns[name].astype(np.float64) for name in self.xyz], axis=1)

    def chunk(
        self,
        columns: Mapping[str, NDArray[Any]],
        path: Path,
        *,
        extra: Mapping[str, NDArray[Any]] | None = None,
        zero_is_nothing: bool = False,
    ) -> Chunk:
        """Points whose coordinates are finite, with their fields.

        ``columns``: (n,) or (n, k) by name in the file; ``zero_is_nothing``: a point at 0, 0, 0
        stands for a direction without a return.
        """
        xyz = self.coordinates(columns)
        valid = np.asarray(np.isfinite(xyz).all(axis=1))
        if zero_is_nothing:
            valid &= xyz.any(axis=1)
        keep: Any = slice(None) if valid.all() else valid
        values = {name: column[keep] for name, column in (extra or {}).items()}
        for field, source, factor in zip(self.fields, self.sources, self.factors, strict=True):
            column = columns[source][keep]
            if factor != 1:
                with np.errstate(over="ignore", invalid="ignore"):  # what does not fit is refused
                    column = column * np.float64(factor)
            values[field.name] = cast(column, np.dtype(field.dtype), field.name, path)
        return Chunk(xyz[keep], values, int(len(valid) - np.count_nonzero(valid)))


def arranged(
    types: Mapping[str, str],
    sample: Mapping[str, NDArray[Any]],
    path: Path,
    intensity: tuple[float | None, float | None] = (None, None),
) -> ColumnRoles:
    """The roles of the columns of a file, by their names."""
    ours: dict[str, str] = {}
    # a column called y goes before one called n, which may count the points
    for name in sorted(types, key=lambda one: one.strip().lower() not in ("x", "y", "z")):
        known = known_name(name)
        if known is not None:
            ours.setdefault(known, name)
    if not {"x", "y", "z"} <= ours.keys():
        listed = ", ".join(list(types)[:12]) or "none"
        what = f"no columns x, y and z among the columns ({listed})"
        raise InputError(what, file=path, cure="name the columns in the first line")
    if any(sample[ours[axis]].ndim > 1 for axis in "xyz"):
        what = "x, y and z have several values for one point"
        raise InputError(what, file=path, cure="export the file again")
    back = {source: name for name, source in ours.items()}
    scale = _colour_factor([sample[ours[c]] for c in _RGB if c in ours])
    fields, sources, factors, used = [], [], [], {"x", "y", "z"}
    for source, dtype in types.items():
        # so CloudCompare and our own writer mark what is no coordinate
        name = back.get(source, source.removeprefix("scalar_") or source)
        if name in ("x", "y", "z") and source in back:
            continue
        while name in used:
            name += "_2"
        used.add(name)
        limits = intensity if name == "intensity" else (None, None)
        step = 1.0 if np.dtype(dtype).kind in "iu" and name == "intensity" else None
        fields.append(Field(name, _TYPES.get(name, dtype), *limits, step=step))
        sources.append(source)
        factors.append(scale if name in _RGB else 1.0)
    return ColumnRoles(
        (ours["x"], ours["y"], ours["z"]), tuple(fields), tuple(sources), tuple(factors)
    )


def _colour_factor(channels: Sequence[NDArray[Any]]) -> float:
    """Factor that stretches colours to 65535: by their type, for text and floats by the values."""
    if not channels or all(channel.dtype == np.uint8 for channel in channels):
        return 257.0
    if all(channel.dtype.kind in "iu" and channel.dtype.itemsize == 2 for channel in channels):
        return 1.0
    values = np.concatenate([np.asarray(c, dtype=float) for c in channels])
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return 257.0
    if values.max() <= 1 and (values % 1).any():
        return 65535.0
    return 257.0 if values.max() <= 255 else 1.0


def cast(column: NDArray[Any], kind: np.dtype[Any], name: str, path: Path) -> NDArray[Any]:
    """A column in another type, as a fresh contiguous array; rounded if the type is a whole number.

    ``column`` (n,): values; ``name``, ``path``: of the column and the file, for messages.
    """
    if kind.kind in "iu" and column.dtype != kind and len(column):
        info = np.iinfo(kind)
        low, high = column.min(), column.max()
        if not (low >= info.min - 0.5 and high <= info.max + 0.5):
            wrong = low if not low >= info.min - 0.5 else high
            raise InputError(
                f"the value {wrong:g} does not lie within {info.min} and {info.max}",
                file=path,
                record=f"column {name}",
                cure="correct it or remove the column",
            )
        if column.dtype.kind == "f":
            column = np.rint(column)
    with np.errstate(over="ignore", invalid="ignore"):  # too large is infinite
        return np.array(column, dtype=kind)
