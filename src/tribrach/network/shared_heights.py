"""Heights of instruments and targets as unknowns that the sights of a set-up or a target share.

A height that nobody measured, or that was measured with a sigma worth counting, is one scalar for
all sights that were made with it: the scalar is the whole height over the mark, and the sights'
own heights become zero (method section 2.3). A measured one is observed by a prior (method section
2.13).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.geodesy.site import FlatSite
from tribrach.network.survey import ObservationTable, Survey, as_column
from tribrach.observations.control import ScalarPriors
from tribrach.observations.declaration import ObservedAxes

#: heights over marks in one name that differ by more than this are two [m]
_SAME = 1e-6


@dataclass(frozen=True)
class SharedHeight:
    """One height over a mark that several sights have in common."""

    end: Literal["instrument", "target"]  #: what stands over the mark
    name: str  #: of the unknown
    height: float | None = None  #: what was measured [m], None for what the sights say
    #: its standard deviation [m], None for a height that is unknown: then it starts at ``height``
    #: and is not held by it
    sigma: float | None = None
    source: str = ""  #: where this is said, for messages


def has_shared_heights(table: ObservationTable) -> bool:
    """Has the kind of a table heights of instrument and target that may be unknowns?"""
    return {"height_instrument_unknown", "height_target_unknown"} <= {
        f.name for f in fields(table.kind)
    } and any(columns.heights for columns in table.kind.facts.csv)


def share_heights(
    survey: Survey,
    shared: SharedHeight,
    rows: Mapping[int, NDArray[np.bool_]],
) -> bool:
    """Make one height of chosen sights an unknown of the survey.

    Sights on a flat site whose value no height changes (directions, horizontal distances) are left
    as they are; so are those of an unknown that no zenith angle and no slope distance sees.

    ``rows`` (n,): number of a table of the survey and the sights in it that were made with the
    height.
    """
    field_name = f"height_{shared.end}"
    tables = survey.tables()
    chosen = {k: mask for k, mask in rows.items() if mask.any() and has_shared_heights(tables[k])}
    seen = [k for k in chosen if tables[k].kind.facts.axes is ObservedAxes.SPACE]
    if not seen:
        return False
    if isinstance(survey.site, FlatSite):
        chosen = {k: chosen[k] for k in seen}
    start = shared.height
    if start is None:
        start = _common(shared, [_heights(tables[k], field_name)[m] for k, m in chosen.items()])
    for k, mask in chosen.items():
        table = tables[k]
        names = _names(table, f"{field_name}_unknown")
        taken = mask & (names != "")
        if taken.any():
            raise InputError(
                f"{shared.name} and {names[taken][0]} are both unknown heights of one sight",
                record=table.columns["source"][int(np.argmax(taken))] or shared.source or None,
                cure="keep one of them",
            )
        heights = np.where(mask, 0.0, _heights(table, field_name))
        names[mask] = shared.name
        table.columns |= {field_name: heights, f"{field_name}_unknown": names}
    survey.scalars[shared.name] = (start, True)
    if shared.sigma is not None:
        survey.add(
            ScalarPriors,
            values=[start],
            sigma=[shared.sigma],
            scalar=[shared.name],
            source=[shared.source],
            group="heights over marks",
        )
    return True


def _heights(table: ObservationTable, name: str) -> Any:
    """Heights (n,) of a table, zero where it has none."""
    return as_column(table.columns.get(name, 0.0), table.n).astype(float)


def _names(table: ObservationTable, name: str) -> NDArray[Any]:
    """Names (n,) of unknowns of a table, a copy."""
    return as_column(table.columns.get(name, ""), table.n).astype(object).copy()


def _common(shared: SharedHeight, parts: list[Any]) -> float:
    """The one height that the sights give."""
    heights = np.concatenate(parts)
    given = heights[heights != 0]
    if len(given) and np.ptp(given) > _SAME:
        raise InputError(
            f"the sights that share {shared.name} give heights from {given.min():.4f} to "
            f"{given.max():.4f} m",
            record=shared.source or None,
            cure="name each height, or give the one height_m of all of them",
        )
    if shared.sigma is not None and not len(given):
        raise InputError(
            f"{shared.name} has a sigma and no value",
            record=shared.source or None,
            cure="give the height that was measured, or leave its sigma out",
        )
    return float(given[0]) if len(given) else 0.0
