"""Columns of numbers from the JSON of a comparison, with one row for each test site.

``range`` [m] and ``incidence`` [deg] of the site; figures by their place, such as ``c2c.mean`` or
``m3c2.std`` [mm], shares and ratios as they are; a name without a place is one of ``c2c``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.io.json_file import read_json
from tribrach.io.number_table import NumberTable
from tribrach.units import LARGEST, too_large

_CURE = "give what tribrach compare wrote with --json and --sites"
#: units by the last word of a name; all others are lengths
_UNITS = {"range": ("m", 1.0), "incidence": ("deg", 180 / math.pi)} | dict.fromkeys(
    ("n", "count", "beyond", "changed", "lattice", "ratio", "noise_ratio", "noise_ratio_error"),
    ("", 1.0),
)
_LENGTHS = ("mm", 1e3)


def read_comparison(path: Path, names: Sequence[str]) -> NumberTable:
    """Named figures of all sites that have all of them; the remarks list the other sites."""
    try:
        sites = read_json(path)["sites"]
        rows = [(str(site["name"]), [_figure(site, name) for name in names]) for site in sites]
    except (ValueError, TypeError, KeyError) as error:
        raise InputError("this is no JSON of a comparison", file=path, cure=_CURE) from error
    whole = [row for row in rows if None not in row[1]]
    if not whole:
        raise InputError(
            f"no site has {', '.join(names)}",
            file=path,
            cure="compare with the poses of both clouds, and look at the names of the figures",
        )
    values = np.array([row[1] for row in whole], dtype=np.float64)
    if too_large(values):
        name = whole[int(np.argmax((np.abs(values) >= LARGEST).any(axis=1)))][0]
        raise InputError(
            f"a figure of site {name} is beyond any measurement", file=path, cure=_CURE
        )
    units = {name: _UNITS.get(name.rpartition(".")[2], _LENGTHS) for name in names}
    lost = [name for name, row in rows if None in row]
    remarks = (f"Left out for want of a figure: {', '.join(lost)}.",) if lost else ()
    return NumberTable(
        path,
        {name: units[name][1] * values[:, k] for k, name in enumerate(names)},
        {name: units[name][0] for name in names},
        remarks,
    )


def _figure(site: dict[str, Any], name: str) -> float | None:
    """A figure of a site, None if it does not have it."""
    places = name.split(".") if "." in name or name in site else ["c2c", name]
    value: Any = site
    for place in places:
        if not isinstance(value, dict):
            return None
        value = value.get(place)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)
