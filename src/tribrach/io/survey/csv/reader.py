"""What all kinds of CSV tables share: use and reason, groups, sigmas and their defaults."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.epochs import Passage
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.instruments.precision import Precision
from tribrach.io.survey.csv.file import CsvTable
from tribrach.io.survey.csv.matrix import CoordinateCovariance
from tribrach.network.facts import FrameChange
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations, Use

USES = {"": Use.ACTIVE, "on": Use.ACTIVE, "check": Use.CHECK, "off": Use.OFF}


@dataclass(frozen=True)
class Context:
    """What the project says about a file."""

    precision: Precision = field(default_factory=Precision)  #: of the instrument
    frame: WorkFrame = field(default_factory=WorkFrame)  #: the work frame
    role: str | None = None  #: of points without a role of their own
    #: names of the lever arms of antennas by scanner station
    lever_arms: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: the way of the file's coordinates to the frame and epoch of the job
    carry: Passage | None = None
    #: the same for geocentric and geographic coordinates of files that name no frame
    geocentric: Passage | None = None
    label: str = ""  #: what tells the file from others of the same name
    #: covariances between the coordinates of a file of points
    matrix: CoordinateCovariance | None = None
    #: sigma of easting and northing, and of the height, of points whose file gives none [m]
    sigma_plan: float | None = None
    sigma_up: float | None = None
    sigma_source: str = ""  #: where these come from


class Reader(ABC):
    """A table on its way into a survey."""

    def __init__(self, table: CsvTable, context: Context) -> None:
        self.table = table
        self.precision, self.frame = context.precision, context.frame
        self.role, self.lever_arms = context.role, context.lever_arms
        self.carry, self.geocentric = context.carry, context.geocentric
        self.matrix = context.matrix
        self.sigmas = (context.sigma_plan, context.sigma_plan, context.sigma_up)
        self.sigma_source = context.sigma_source
        self.survey = Survey(site=context.frame.site)
        self.all: Index = np.arange(len(table))
        self.sources: NDArray[Any] = np.empty(len(table), dtype=object)
        self.sources[:] = [table.source(row) for row in range(len(table))]
        self.use = self._uses()

    @abstractmethod
    def read(self) -> None:
        """Fill the survey with the whole table."""

    def _uses(self) -> NDArray[np.int8]:
        """Use of each row, and in ``self.reason`` why it is off."""
        n = len(self.table)
        words = [word.lower() for word in self.table.words.get("use", [""] * n)]
        bad = np.flatnonzero([word not in USES for word in words])
        self.table.refuse(bad, lambda row: f"use is {words[row]!r}", "write on, check or off")
        use = np.array([USES[word] for word in words], dtype=np.int8)
        reason = np.array(self.table.words.get("reason", [""] * n), dtype=object)
        self.reason = np.where(
            (use == Use.OFF) & (reason == ""), "switched off in the file", reason
        )
        return use

    def changed(self, change: FrameChange) -> None:
        """Keep in mind what came in another frame."""
        self.survey.facts += (change,)
        if change.warning is not None:
            self.survey.warnings.append(change.warning)

    def add(
        self,
        kind: type[Observations],
        rows: Index,
        *,
        held_out: bool = False,
        group: str | None = None,
        **columns: Any,
    ) -> None:
        """Add observations of rows of the file; columns (len(rows), ...) or single values.

        held_out : rows that are not switched off become checks; group : of all, instead of the
        file's own column.
        """
        groups = np.full(len(rows), group or "", dtype=object)
        if group is None and "group" in self.table.words:
            groups = np.array(self.table.words["group"], dtype=object)[rows]
        use = self.use[rows]
        use[held_out & (use == Use.ACTIVE)] = Use.CHECK
        columns |= {"source": self.sources[rows], "use": use, "reason": self.reason[rows]}
        for name in dict.fromkeys(groups):
            chosen = {key: _part(column, groups == name) for key, column in columns.items()}
            with located(self.table.path):
                self.survey.add(kind, group=name, **chosen)

    def sigma(
        self, columns: tuple[str, ...], rows: Index, default: Callable[[], Array | None]
    ) -> Array:
        """Sigmas (len(rows),): the first of the columns that is filled, or the instrument's."""
        given = self.given_sigma(columns, rows)
        empty = np.flatnonzero(np.isnan(given))
        if len(empty) == 0:
            return given
        default_sigma = default()
        given = given if default_sigma is None else np.where(np.isnan(given), default_sigma, given)
        self.table.refuse(
            rows[np.isnan(given)],
            f"there is no {columns[0]}",
            "add the column with its unit, or name an instrument in the project",
        )
        return given

    def given_sigma(self, columns: tuple[str, ...], rows: Index) -> Array:
        """Sigmas (len(rows),) of the file: the first of the columns that is filled, or NaN."""
        given = np.full(len(rows), np.nan)
        for column in columns:
            given = np.where(np.isnan(given), self.table.number(column)[rows], given)
        return given

    def covariance(
        self, names: tuple[str, ...], matrix: tuple[str, ...], default: Array | None = None
    ) -> Array:
        """Covariances (n, 3, 3) of all rows: of six columns, three sigmas, or the default."""
        table = self.table
        if any(table.has(name) for name in matrix):
            flat = table.columns(*matrix)
            return flat[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
        if default is not None and not any(table.has(f"sigma_{name}") for name in names):
            return default
        sigma = table.columns(*(f"sigma_{name}" for name in names))
        return sigma[:, :, None] ** 2 * np.eye(3)


@contextmanager
def located(path: Path) -> Iterator[None]:
    """Errors that name a line of the file by its name get the path as it was given."""
    try:
        yield
    except InputError as error:
        name, _, line = (error.record or "").rpartition(":")
        if name != path.name or not line.isdigit():
            raise
        raise InputError(error.what, file=path, line=int(line), cure=error.cure) from None


def _part(column: Any, rows: NDArray[np.bool_]) -> Any:
    """Rows of a column; a single value stays as it is."""
    if isinstance(column, list):
        column = np.array(column, dtype=object)
    return column[rows] if isinstance(column, np.ndarray) and column.ndim else column
