"""Leaves out what a survey names but its observations tell nothing of.

Lists of coordinates mostly name more points than a job observed, and levelling lines or a
trilateration come with all three coordinates of their control, or with fewer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.network.alike_names import alike_groups, alike_hint, look_alike
from tribrach.network.network import axes_in_use, axes_sentence, is_given
from tribrach.network.placed_part import placed_part
from tribrach.network.survey import GivenPoint, ObservationTable, Survey
from tribrach.observations.control import Coordinate
from tribrach.observations.unknowns import FAMILIES

#: points that a sentence names
_NAMED = 8
#: kinds that name points, and nothing but points
_POINTS = ("point", "position")


def observed_part(survey: Survey) -> Survey:
    """The survey without points and without axes that are given and observed by nothing.

    Of a survey in which nothing is observed at all the points stay. Files of programs that leave
    out what cannot be placed are taken so (:mod:`~tribrach.network.placed_part`).
    """
    if all(map(_given, survey.tables())):
        return _axes(survey)
    return placed_part(_axes(_points(survey)))


def _given(table: ObservationTable) -> bool:
    """True for coordinates that were given, not observed."""
    return is_given(table.kind, table.group)


def _points(survey: Survey) -> Survey:
    """Without points that have nothing but given coordinates."""
    observed: set[str] = set()
    for number, table in enumerate(survey.tables()):
        # coordinates that share a covariance with others stay together
        if not _given(table) or number in survey.joint_tables():
            observed |= set().union(*(table.names(family) for family in (*FAMILIES, "position")))
    alone = [name for name in survey.points if name not in observed]
    hints = _hints(observed, survey.points, set(alone))
    if not alone:
        return replace(survey, warnings=[*survey.warnings, *hints]) if hints else survey
    left_out = set(alone)
    parts = []
    for table in survey.tables():
        if not table.names("position") & left_out:
            parts.append([table])
            continue
        names = np.ravel(table.columns["position"])
        keep = np.array([str(name) not in left_out for name in names], dtype=bool)
        parts.append([table.part(keep)] if keep.any() else [])
    points = {name: given for name, given in survey.points.items() if name not in left_out}
    out = replace(survey, points=points, warnings=[*survey.warnings, _sentence(alone), *hints])
    out.replace_tables(parts)
    return out


def _hints(observed: set[str], given: Mapping[str, GivenPoint], alone: set[str]) -> list[str]:
    """Names that may be one point: given but not observed, and observed but not given."""
    out = []
    for group in alike_groups(sorted(observed | set(given))):
        unknown = [name for name in group if name in observed and name not in given]
        unseen = [name for name in group if name in alone]
        known = ", and the one is given and not observed, the other observed and not given"
        out += [alike_hint(a, b, known) for a in unseen for b in unknown]
        seen = [name for name in group if name in observed]
        out += [alike_hint(seen[0], b) for b in seen[1:] if look_alike(seen[0], b)]
    return out


def _sentence(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    several = f"s {', '.join(names[:_NAMED])}{more} are" if len(names) > 1 else f" {names[0]} is"
    return f"Point{several} given and observed by nothing: left out."


def _axes(survey: Survey) -> Survey:
    """Without the plan or the heights of all points if the whole survey knows nothing of them."""
    tables = survey.tables()
    telling = [t for t in tables if not _given(t)] or tables
    used = axes_in_use([t.kind.observed_axes(t.columns) for t in telling], survey.site)
    sentence = axes_sentence(used)
    joint = survey.joint_tables()
    whole = any(given.covariance is not None for given in survey.points.values())
    whole |= any(
        _given(t) and (k in joint or _correlated(t)) and not _within(t, used)
        for k, t in enumerate(tables)
    )
    # coordinates that are correlated with each other are not taken apart
    if sentence is None or whole:
        return survey
    names = dict.fromkeys(n for t in tables for f in _POINTS for n in sorted(t.names(f)))
    blank = GivenPoint(np.full(3, np.nan), np.ones(3, dtype=bool))
    points = {name: survey.points.get(name, blank) for name in (*survey.points, *names)}
    if not any((given.free & ~used).any() for given in points.values()):
        return survey
    out = replace(
        survey,
        points={n: replace(p, free=p.free & used) for n, p in points.items()},
        warnings=[*survey.warnings, sentence],
    )
    out.replace_tables([_of_axes(t, used) if _given(t) else [t] for t in tables])
    return out


def _within(table: ObservationTable, used: NDArray[np.bool_]) -> bool:
    """True if a table of single coordinates has none along axes that are not in use."""
    return table.kind is Coordinate and bool(
        used[np.asarray(table.columns["axis"]).astype(int)].all()
    )


def _correlated(table: ObservationTable) -> bool:
    """True if coordinates E, N, U of a point are correlated."""
    covariance = table.columns["covariance"]
    return bool((covariance * (1 - np.eye(covariance.shape[1]))).any())


def _of_axes(table: ObservationTable, used: NDArray[np.bool_]) -> list[ObservationTable]:
    """Given coordinates along the axes in use, one table for each axis."""
    axes = np.flatnonzero(used)
    if table.kind is Coordinate:
        keep = np.isin(np.asarray(table.columns["axis"]).astype(int), axes)
        return [table.part(keep)] if keep.any() else []
    if len(table.kind.units) == 1:  # heights
        return [table] if used[2] else []
    out = []
    for axis in axes:
        columns: dict[str, Any] = dict(table.columns)
        columns["values"] = columns["values"][:, axis : axis + 1]
        columns["covariance"] = columns["covariance"][:, axis : axis + 1, axis : axis + 1]
        columns["axis"] = np.full(table.n, axis)
        out.append(ObservationTable(Coordinate, table.group, columns, table.n, table.hard))
    return out
