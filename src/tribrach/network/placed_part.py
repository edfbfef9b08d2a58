"""Leaves out points that the observations cannot place, where a file's own program does so.

GNU Gama and Comp3D compute a network without the points for which they find no approximate
coordinates. Their files are read in the same way; all others end with the ties that are missing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import NoStartValues
from tribrach.network.identity import file_and_line
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import ObservationTable, Survey

#: observations that a sentence names
_NAMED = 10
#: how often what hangs on points that are left out is looked for
_ROUNDS = 20


def placed_part(survey: Survey) -> Survey:
    """The survey without points that cannot be placed, and without what was observed of them."""
    if not survey.leaves_out_unplaced:
        return survey
    part, network = survey, survey.network()
    everywhere = set(network.start.layout.names["point"])
    for _ in range(_ROUNDS):
        try:
            find_start(network)
        except NoStartValues as error:
            left_out = {name for family, name in error.unplaced if family == "point"}
            kept = {*network.start.layout.names["point"]} - left_out
            if not left_out or 2 * len(kept) <= len(everywhere):
                raise
            part = _without(part, left_out)
            network = part.network()
        else:
            break
    return part


def _without(survey: Survey, names: set[str]) -> Survey:
    """The survey without points and without the observations that refer to them."""
    masks = [_untouched(table, names) for table in survey.tables()]
    sources: dict[str, dict[str, None]] = {name: {} for name in sorted(names)}
    for table, keep in zip(survey.tables(), masks, strict=True):
        for row in np.flatnonzero(~keep).tolist():
            for name in names & _names(table, row):
                sources[name][str(table.columns["source"][row])] = None
    sentences = [_sentence(n, sorted(s, key=file_and_line)) for n, s in sources.items()]
    return replace(
        survey.part(masks),
        points={name: given for name, given in survey.points.items() if name not in names},
        warnings=[*survey.warnings, *sentences],
    )


def _untouched(table: ObservationTable, names: set[str]) -> NDArray[np.bool_]:
    """Which observations (n,) refer to none of the points."""
    if not names & {*table.names("point"), *table.names("position")}:
        return np.ones(table.n, dtype=bool)
    return np.array([not names & _names(table, row) for row in range(table.n)], dtype=bool)


def _names(table: ObservationTable, row: int) -> set[str]:
    """Names of points that an observation refers to."""
    return {
        str(np.broadcast_to(table.columns[reference.name], table.n)[row])
        for reference in table.kind.references()
        if reference.family in ("point", "position") and reference.name in table.columns
    }


def _sentence(name: str, sources: list[str]) -> str:
    sources = [source for source in sources if source]
    more = f" and {len(sources) - _NAMED} more" if len(sources) > _NAMED else ""
    lines = f" ({', '.join(sources[:_NAMED])}{more})" if sources else ""
    own = "observation" if len(sources) == 1 else "observations"
    return f"Point {name} cannot be placed: it is left out with its {own}{lines}."
