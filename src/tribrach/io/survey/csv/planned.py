"""Planned observations from a CSV file: from where to where, of which kind, how precise.

``from,to,kind`` and sigmas that differ from the instrument's. Values follow from the approximate
coordinates; ``total_station`` stands for direction, zenith angle and slope distance together.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.csv.sights import KINDS, SightReader
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssBaselines, GnssPositions

__all__ = ["PLANNED", "read_planned"]

_TOTAL_STATION = ("direction", "zenith", "slope_distance")


#: kinds that a table may plan
PLANNED = ("total_station", *KINDS, "gnss_position", "gnss_baseline", "scan")


def read_planned(
    path: Path, context: Context, places: Mapping[str, Array]
) -> tuple[Survey, list[tuple[str, str]]]:
    """Survey of planned observations, and the sights (station, target) of planned scans.

    places : approximate coordinates (3,) of points in the work frame [m]. Values are not measured;
    a prediction gives them theirs.

    Raises
    ------
    InputError : a kind that there is not, a point without coordinates, no sigma.
    """
    table = read_table(Path(path))
    if table.kind.name != "planned observations":
        raise table.error(
            None,
            f"this is a table of {table.kind.name}, not of planned observations",
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
        for row, kind in enumerate(kinds):
            if kind not in PLANNED:
                raise self.table.error(
                    row, f"kind is {kind!r}", f"write one of {', '.join(PLANNED)}"
                )
        self._check_repetitions()
        for name in KINDS:
            both = (kinds == name) | ((kinds == "total_station") & (name in _TOTAL_STATION))
            rows = np.flatnonzero(both)
            if len(rows):
                self._plan(name, rows)
        self._gnss(np.flatnonzero(kinds == "gnss_position"), baseline=False)
        self._gnss(np.flatnonzero(kinds == "gnss_baseline"), baseline=True)
        scans = np.flatnonzero(kinds == "scan")
        ends = [self.table.names(side, scans) for side in ("from", "to")]
        self.scans = list(zip(*ends, strict=True))

    def _check_repetitions(self) -> None:
        self.repetitions(self.all)

    def _ends(self, rows: Index) -> tuple[list[str], list[str], Array]:
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
        start, end, chord = self._ends(rows)
        length = np.linalg.norm(chord, axis=1)
        level = np.linalg.norm(chord[:, :2], axis=1)
        precision, repetitions = self.precision, self.repetitions(rows)
        given = self.table.number("length")[rows]
        defaults: dict[str, Any] = {
            "direction": lambda: precision.of_directions(level, repetitions),
            "zenith": lambda: precision.of_zeniths(level, repetitions),
            "slope_distance": lambda: precision.of_distances(length, repetitions),
            "horizontal_distance": lambda: precision.of_distances(level, repetitions),
            "distance": lambda: precision.of_distances(length, repetitions),
            "height_difference": lambda: precision.of_lines(
                np.where(np.isnan(given), level, given)
            ),
        }
        columns: tuple[str, ...] = (f"sigma_{name}",)
        if name in ("slope_distance", "horizontal_distance"):
            columns = (f"sigma_{name}", "sigma_distance")
        values = level if name == "horizontal_distance" else np.maximum(length, 1e-3)
        self.add(
            KINDS[name],
            rows,
            values=values if "distance" in name else np.ones(len(rows)),
            sigma=self.sigma(columns, rows, defaults.get(name, lambda: None)),
            start=start,
            end=end,
            **self._further(name, rows),
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
            start, end, chord = self._ends(rows)
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
