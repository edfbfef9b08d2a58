"""Lists of coordinates: a table with units in its heads, or lines after a template."""

from __future__ import annotations

import csv
import io
import math
import string
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tribrach.errors import InputError
from tribrach.io.delivery.content import Delivery

#: columns of positions: head with its unit, digits, value
_COLUMNS: dict[str, tuple[int | None, Callable[[Any], Any]]] = {
    "point": (None, lambda p: p.name),
    "role": (None, lambda p: p.role),
    "code": (None, lambda p: p.code),
    "easting_m": (5, lambda p: p.xyz[0]),
    "northing_m": (5, lambda p: p.xyz[1]),
    "height_m": (5, lambda p: p.xyz[2]),
    "sigma_easting_mm": (3, lambda p: 1e3 * p.sigma[0]),
    "sigma_northing_mm": (3, lambda p: 1e3 * p.sigma[1]),
    "sigma_height_mm": (3, lambda p: 1e3 * p.sigma[2]),
}
_MOVED: dict[str, tuple[int | None, Callable[[Any], Any]]] = {
    "point": (None, lambda m: m.name),
    "from_epoch": (None, lambda m: m.epochs[0]),
    "to_epoch": (None, lambda m: m.epochs[1]),
    "verdict": (None, lambda m: m.verdict),
    "easting_m": (5, lambda m: m.xyz[0]),
    "northing_m": (5, lambda m: m.xyz[1]),
    "height_m": (5, lambda m: m.xyz[2]),
    "d_easting_mm": (3, lambda m: 1e3 * m.vector[0]),
    "d_northing_mm": (3, lambda m: 1e3 * m.vector[1]),
    "d_height_mm": (3, lambda m: 1e3 * m.vector[2]),
    "sigma_d_easting_mm": (3, lambda m: 1e3 * math.sqrt(m.covariance[0, 0])),
    "sigma_d_northing_mm": (3, lambda m: 1e3 * math.sqrt(m.covariance[1, 1])),
    "sigma_d_height_mm": (3, lambda m: 1e3 * math.sqrt(m.covariance[2, 2])),
}


def columns_of(delivery: Delivery) -> tuple[Mapping[str, int | None], list[dict[str, Any]]]:
    """Heads with their digits, None for texts, and rows; None where there is no number."""
    table: Mapping[str, tuple[int | None, Callable[[Any], Any]]]
    items: Sequence[Any]
    table, items = _COLUMNS, delivery.positions
    if delivery.moves:
        table, items = _MOVED, delivery.moves
    values = [(head, value) for head, (_, value) in table.items()]
    rows = [{head: value(item) for head, value in values} for item in items]
    for row in rows:
        for head, (digits, _) in table.items():
            if digits is not None:
                row[head] = float(row[head]) if math.isfinite(row[head]) else None
    return {head: digits for head, (digits, _) in table.items()}, rows


def write(delivery: Delivery) -> bytes:
    """A table with commas, in UTF-8."""
    heads, rows = columns_of(delivery)
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    lines.writerow(heads)
    for row in rows:
        lines.writerow(
            "" if row[h] is None else row[h] if d is None else f"{row[h]:.{d}f}"
            for h, d in heads.items()
        )
    return out.getvalue().encode("utf-8")


class _Fields(string.Formatter):
    """Fills the fields of a template; a number that is not known is empty, attributes are none."""

    def get_field(self, field_name: str, args: Any, kwargs: Any) -> Any:
        """The value of a field, which is a column and nothing else."""
        if field_name not in kwargs:
            raise KeyError(field_name)
        return kwargs[field_name], field_name

    def format_field(self, value: Any, format_spec: str) -> Any:
        """A value in its format; what is not known takes the width of one that is."""
        if value is None:
            return " " * len(format(0.0, format_spec))
        return format(value, format_spec)


def write_template(delivery: Delivery, template: str) -> bytes:
    """A line for each position after a template, such as ``{point:>8} {easting_m:12.4f}``."""
    heads, rows = columns_of(delivery)
    fill, line = _Fields(), 0
    out: list[str] = []
    try:
        for row in rows:
            out.append(fill.vformat(template, (), row))
    except KeyError as error:
        raise InputError(
            f"the template has a field {error.args[0]!r}", cure=f"use {', '.join(heads)}"
        ) from None
    except (ValueError, IndexError, TypeError) as error:
        raise InputError(
            f"the template cannot be filled for {rows[line]['point']} ({error})",
            cure="write fields as {point:>8} and {easting_m:12.4f}",
        ) from None
    return "".join(f"{text}\n" for text in out).encode("utf-8")
