"""Observations on their way into a survey, one after the other as a file has them.

A survey takes the observations of a kind together (:meth:`Survey.add`): each call checks its
columns and makes a table. Files have them mixed, one on a line; a call for each takes a hundred
times as long as its number, and so does everything that later looks at the tables. Here
each becomes one row of columns, and the survey gets one table of each kind and group.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations

#: value, sigma, source and columns of an observation
Row = tuple[Any, float, str, tuple[Any, ...]]


@dataclass
class _Table:
    """Rows of one kind, group and set of columns, and where each went in the survey."""

    kind: type[Observations]
    group: str
    hard: bool
    names: tuple[str, ...]
    rows: list[Row] = field(default_factory=list)
    places: list[tuple[int, int] | None] = field(default_factory=list)

    def into(self, survey: Survey, rows: slice) -> int:
        """Add some of the rows; the number of their table."""
        values, sigmas, sources, items = zip(*self.rows[rows], strict=True)
        columns = map(list, zip(*items, strict=True))
        return survey.add(
            self.kind,
            values=list(values),
            sigma=None if self.hard else np.array(sigmas)[:, None] * np.ones(len(self.kind.units)),
            source=sources,
            group=self.group,
            hard=self.hard,
            **dict(zip(self.names, columns, strict=True)),
        )


class SurveyRows:
    """Rows that become tables of a survey when all of them are there."""

    def __init__(self, survey: Survey) -> None:
        self._survey = survey
        self._tables: dict[tuple[Any, ...], _Table] = {}
        #: table and row in it of each
        self._rows: list[tuple[_Table, int]] = []

    def add(
        self,
        kind: type[Observations],
        value: float | Sequence[float],
        sigma: float,
        source: str,
        columns: dict[str, Any],
        *,
        group: str = "",
        hard: bool = False,
    ) -> int:
        """Take one observation."""
        table = self._table(kind, group, hard, tuple(columns))
        table.rows.append((value, sigma, source, tuple(columns.values())))
        self._rows.append((table, len(table.rows) - 1))
        return len(self._rows) - 1

    def table(self, kind: type[Observations], names: tuple[str, ...]) -> list[Row]:
        """Rows of a kind, to which a reader of many appends what has no number to be told."""
        return self._table(kind, "", hard=False, names=names).rows

    def _table(
        self, kind: type[Observations], group: str, hard: bool, names: tuple[str, ...]
    ) -> _Table:
        key = (kind, group, hard, *names)
        if key not in self._tables:
            self._tables[key] = _Table(kind, group, hard, names)
        return self._tables[key]

    def settle(self, refuse: Callable[[str, InputError], None]) -> None:
        """Give the rows to the survey."""
        for table in self._tables.values():
            n = len(table.rows)
            if n == 0:
                continue
            try:
                number = table.into(self._survey, slice(None))
            except InputError:
                table.places = [self._alone(table, k, refuse) for k in range(n)]
            else:
                table.places = [(number, k) for k in range(n)]

    def _alone(
        self, table: _Table, row: int, refuse: Callable[[str, InputError], None]
    ) -> tuple[int, int] | None:
        """Add one row as a table of its own, of a kind of which not all can be taken."""
        try:
            return table.into(self._survey, slice(row, row + 1)), 0
        except InputError as error:
            refuse(table.rows[row][2], error)
            return None

    def places(self, rows: Sequence[int]) -> list[tuple[int, int]] | None:
        """Table and row in it of some rows, as correlate takes them; None if one is refused."""
        out = []
        for number in rows:
            table, row = self._rows[number]
            place = table.places[row]
            if place is None:
                return None
            out.append(place)
        return out
