"""Elements of a model as built, as CSV: lengths in millimetres, slopes in millimetres per metre."""

from __future__ import annotations

import csv
import io
from dataclasses import fields
from typing import Any

import numpy as np

from tribrach.comparison.as_designed import ElementTable
from tribrach.units import MM


def elements_csv(elements: ElementTable) -> str:
    """The elements as text, lengths in millimetres and slopes in millimetres per metre."""
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    plain = {"element", "verdict", "guard", "area", "seen", "points", "left_out", "places"}
    names = [field.name for field in fields(elements)]
    slopes = {name for name in names if name.startswith(("tilt", "turn", "plumb"))}
    heads = {name: f"{name}_mm_per_m" for name in slopes}
    heads |= {name: f"{name}_mm" for name in names if name not in plain | slopes}
    lines.writerow([heads.get(name, {"area": "area_m2"}.get(name, name)) for name in names])
    for row in elements.each():
        lines.writerow(_cell(getattr(row, name), 1.0 if name in plain else MM) for name in names)
    return out.getvalue()


def _cell(value: Any, unit: float) -> str:
    """A cell in a unit; empty where nothing is known."""
    if isinstance(value, str):
        return value
    return "" if np.isnan(value) else f"{value / unit + 0.0:.6g}"
