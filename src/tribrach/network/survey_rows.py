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

__all__ = ["SurveyRows"]


@dataclass
class _Table:
    """Rows of one kind, group and set of columns, and where each went in the survey."""

    kind: type[Observations]
    group: str
    hard: bool
    values: list[Any] = field(default_factory=list)
    sigmas: list[float] = field(default_factory=list)
    sources: list[str] = field(default_factory=list)
    columns: dict[str, list[Any]] = field(default_factory=dict)
    places: list[tuple[int, int] | None] = field(default_factory=list)

    def into(self, survey: Survey, rows: slice) -> int:
        """Add some of the rows; the number of their table."""
        return survey.add(
            self.kind,
            values=self.values[rows],
            sigma=None
            if self.hard
            else np.array(self.sigmas[rows])[:, None] * np.ones(len(self.kind.units)),
            source=self.sources[rows],
            group=self.group,
            hard=self.hard,
            **{name: column[rows] for name, column in self.columns.items()},
        )


class SurveyRows:
    """Rows that become tables of a survey when all of them are there.

    Parameters
    ----------
    survey : Survey
        What they are added to.
    """

    def __init__(self, survey: Survey) -> None:
        self._survey = survey
        self._tables: dict[tuple[Any, ...], _Table] = {}
        #: table and row in it of each
        self._rows: list[tuple[_Table, int]] = []

    def __len__(self) -> int:
        return len(self._rows)

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
        """Take one observation.

        Parameters
        ----------
        kind : type[Observations]
            Its class.
        value : float or sequence of float (rows,)
            Metres and radians.
        sigma : float
            Of each of its values.
        source : str
            ``file:line``.
        columns : dict
            The kind's own fields, one item each; names for those that refer to unknowns.
        group : str
            Name of the variance component; that of the kind if empty.
        hard : bool
            It holds exactly.

        Returns
        -------
        int
            Its number, for :meth:`places`.
        """
        key = (kind, group, hard, *columns)
        table = self._tables.get(key)
        if table is None:
            table = self._tables[key] = _Table(kind, group, hard)
            table.columns = {name: [] for name in columns}
        for name, item in columns.items():
            table.columns[name].append(item)
        table.values.append(value)
        table.sigmas.append(sigma)
        table.sources.append(source)
        self._rows.append((table, len(table.sources) - 1))
        return len(self._rows) - 1

    def settle(self, refuse: Callable[[str, InputError], None]) -> None:
        """Give the rows to the survey.

        Parameters
        ----------
        refuse : callable
            Told the source and the refusal of each row that the survey does not take; the others
            are in it.
        """
        for table in self._tables.values():
            n = len(table.sources)
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
            refuse(table.sources[row], error)
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
