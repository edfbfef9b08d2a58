"""Planned observations from a CSV file: from where to where, of which kind, how precise.

``from,to,kind`` and sigmas that differ from the instrument's. Values follow from the approximate
coordinates; ``total_station`` stands for direction, zenith angle and slope distance together.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tribrach._types import Array, Index
from tribrach.io.survey.csv import columns
from tribrach.io.survey.csv.columns import SIGHT_KINDS
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.csv.sights import SightReader
from tribrach.network.survey import Survey
from tribrach.observations.declaration import Planned, SightLength, SightLine
from tribrach.observations.gnss import GnssBaselines, GnssPositions

#: sights that a table may plan
_SIGHTS = {name: entry for name, entry in SIGHT_KINDS.items() if entry[1].planned is not Planned.NO}


#: kinds that a table may plan
PLANNED = ("total_station", *_SIGHTS, GnssPositions.kind, GnssBaselines.kind, "scan")


def read_planned(
    path: Path, context: Context, places: Mapping[str, Array]
) -> tuple[Survey, list[tuple[str, str]]]:
    """Survey of planned observations, and the sights (station, target) of planned scans.

    places : approximate coordinates (3,) of points in the work frame [m]. Values are not measured;
    a prediction gives them theirs.
    """
    table = read_table(Path(path))
    if table.layout is not columns.PLANNED:
        raise table.error(
            None,
            f"this is a table of {table.layout.name}, not of planned observations",
            "give it the columns from, to and kind",
        )
    reader = _PlannedReader(table, context, places)
    reader.read()
    return reader.survey, reader.scans


class _PlannedReader(SightReader):
    """Planned observations with the sigmas of the instrument along lines that are not measured."""

    def __init__(self, table: CsvTable, context: Context, places: Mapping[str, Array]) -> None:
        super().__init__(table, context)
        self.places = places
        self.scans: list[tuple[str, str]] = []

    def read(self) -> None:
        """All rows."""
        kinds = np.array([word.lower() for word in self.table.words["kind"]], dtype=object)
        self.table.refuse(
            np.flatnonzero([kind not in PLANNED for kind in kinds]),
            lambda row: f"kind is {kinds[row]!r}",
            f"write one of {', '.join(PLANNED)}",
        )
        self._check_repetitions()
        planned = {}
        for name, (_, sight) in _SIGHTS.items():
            whole = sight.planned is Planned.TOTAL_STATION
            both = (kinds == name) | ((kinds == "total_station") & whole)
            if both.any():
                planned[name] = np.flatnonzero(both)
        self.occupy(planned)
        for name, rows in planned.items():
            self._plan(name, rows)
        self._gnss(np.flatnonzero(kinds == GnssPositions.kind), baseline=False)
        self._gnss(np.flatnonzero(kinds == GnssBaselines.kind), baseline=True)
        scans = np.flatnonzero(kinds == "scan")
        ends = [self.table.names(side, scans) for side in ("from", "to")]
        self.scans = list(zip(*ends, strict=True))

    def sigmas_of(self, name: str) -> tuple[str, ...]:
        """Columns that hold a kind's sigma."""
        return (f"sigma_{name}", *_SIGHTS[name][1].sigmas)

    def lengths_of(self, rows: Index) -> Array:
        """Lengths (n,) of planned sights [m]."""
        lengths: Array = np.linalg.norm(self._ends_between(rows)[2], axis=1)
        return lengths

    def _check_repetitions(self) -> None:
        self.repetitions(self.all)

    def _ends_between(self, rows: Index) -> tuple[list[str], list[str], Array]:
        """Names of both ends and the vectors (n, 3) between them."""
        start, end = (self.table.names(side, rows) for side in ("from", "to"))
        xyz = []
        for side in (start, end):
            for name, row in zip(side, rows, strict=True):
                if name not in self.places:
                    raise self.table.error(
                        int(row),
                        f"{name} has no approximate coordinates",
                        "add it to a file of points, with role approximate",
                    )
            xyz.append(np.array([self.places[name] for name in side]))
        return start, end, xyz[1] - xyz[0]

    def _plan(self, name: str, rows: Index) -> None:
        """Planned values of one kind; lengths are real ones, others are placeholders."""
        start, end, chord = self._ends_between(rows)
        length = np.linalg.norm(chord, axis=1)
        level = np.linalg.norm(chord[:, :2], axis=1)
        given = self.table.number("length")[rows]
        kind, sight = _SIGHTS[name]
        values = {
            SightLength.NO: np.ones(len(rows)),
            SightLength.SLOPE: np.maximum(length, 1e-3),
            SightLength.LEVEL: level,
        }[sight.length]
        line = SightLine(
            values,
            level,
            np.where(np.isnan(given), level, given),
            self.repetitions(rows),
            planned=True,
            ends=self.occupied[name].ends,
        )
        self.add(
            kind,
            rows,
            values=values,
            sigma=self.sigma(
                self.sigmas_of(name), rows, lambda: kind.instrument_sigma(self.precision, line)
            ),
            start=start,
            end=end,
            **self.further(name, rows),
        )

    def _gnss(self, rows: Index, *, baseline: bool) -> None:
        """Planned satellite positions of the points ``from``, or vectors to ``to``."""
        if len(rows) == 0:
            return
        plan, up = self.precision.gnss_plan, self.precision.gnss_up
        factor = np.sqrt(2.0) if baseline else 1.0
        sigma = np.stack(
            [
                self.sigma(
                    (f"sigma_{axis}",),
                    rows,
                    lambda value=value: (  # type: ignore[misc]
                        None if value is None else np.full(len(rows), factor * value)
                    ),
                )
                for axis, value in (("e", plan), ("n", plan), ("u", up))
            ],
            axis=1,
        )
        sigma /= np.sqrt(self.repetitions(rows))[:, None]
        if baseline:
            start, end, chord = self._ends_between(rows)
            self.add(GnssBaselines, rows, values=chord, sigma=sigma, start=start, end=end)
            return
        names = self.table.names("from", rows)
        for name, row in zip(names, rows, strict=True):
            if name not in self.places:
                raise self.table.error(
                    int(row), f"{name} has no approximate coordinates", "add it to a file of points"
                )
        self.add(
            GnssPositions,
            rows,
            values=np.array([self.places[name] for name in names]),
            sigma=sigma,
            position=names,
        )
