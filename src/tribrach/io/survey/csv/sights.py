"""Sights, angles and levelling from a CSV file: what a total station or a level measures."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.io.survey.csv.reader import Reader
from tribrach.observations.base import Observations
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    Distances,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)

__all__ = ["AngleReader", "SightReader"]

KINDS: dict[str, type[Observations]] = {
    "direction": Directions,
    "zenith": ZenithAngles,
    "slope_distance": SlopeDistances,
    "horizontal_distance": HorizontalDistances,
    "distance": Distances,
    "azimuth": Azimuths,
    "height_difference": HeightDifferences,
}


#: quantities that are lengths of the sight
LENGTHS = ("slope_distance", "horizontal_distance", "distance")


class _Sighted(Reader):
    """What sights and angles share: heights of both ends and repetitions."""

    def heights(self, rows: Index) -> dict[str, Any]:
        """Heights of instrument and target [m], zero where not given."""
        names = ("height_instrument", "height_target")
        return {name: np.nan_to_num(self.table.number(name)[rows]) for name in names}

    def repetitions(self, rows: Index) -> Array:
        """How often each value was measured; 1 where not given."""
        given = self.table.number("repetitions")[rows]
        bad = np.flatnonzero(given < 1)
        if len(bad):
            row = int(rows[bad[0]])
            raise self.table.error(row, f"repetitions is {given[bad[0]]:g}", "give 1 or more")
        return np.where(np.isnan(given), 1.0, given)


class AngleReader(_Sighted):
    """Angles ``at`` an instrument, clockwise ``from`` a backsight ``to`` a foresight."""

    def read(self) -> None:
        """All angles of the file."""
        rows = self.all
        precision = self.precision
        sigma = self.sigma(
            ("sigma_angle", "sigma"), rows, lambda: precision.of_angles(self.repetitions(rows))
        )
        self.add(
            Angles,
            rows,
            values=self.table.columns("angle")[:, 0],
            sigma=sigma,
            start=self.table.names("at", rows),
            end=self.table.names("from", rows),
            foresight=self.table.names("to", rows),
            **self.heights(rows),
        )


class SightReader(_Sighted):
    """Sights ``from`` an instrument ``to`` a target, each with one or several values."""

    def read(self) -> None:
        """All values of the file; a cell that is empty was not measured."""
        measured = [name for name in KINDS if name in self.table.numbers]
        rows = {name: np.flatnonzero(~np.isnan(self.table.numbers[name])) for name in measured}
        if not any(len(found) for found in rows.values()):
            raise self.table.error(
                None, "no row has a measured value", "add a column such as direction_gon"
            )
        if self.table.has("sigma") and len(measured) > 1:
            raise self.table.error(
                None,
                f"{self.table.titles['sigma']} could mean {' or '.join(measured)}",
                f"name it sigma_{measured[0]} with its unit",
            )
        for name in measured:
            if len(rows[name]):
                self._add(name, rows[name])

    def _add(self, name: str, rows: Index) -> None:
        values = self.table.numbers[name][rows]
        if name in LENGTHS and not (values > 0).all():
            row = int(rows[np.flatnonzero(~(values > 0))[0]])
            raise self.table.error(row, f"{name} is not above zero", "give a length above zero")
        general = ("sigma_distance", "sigma") if name in LENGTHS else ("sigma",)
        columns = tuple(dict.fromkeys((f"sigma_{name}", *general)))
        self.add(
            KINDS[name],
            rows,
            values=values,
            sigma=self.sigma(columns, rows, self._default(name, rows)),
            start=self.table.names("from", rows),
            end=self.table.names("to", rows),
            **self._further(name, rows),
        )

    def _further(self, name: str, rows: Index) -> dict[str, Any]:
        """What a kind wants besides its value and its ends."""
        if name == "height_difference":
            heights = self.heights(rows)
            # measured from the instrument's axis to the target, if heights are given
            return {
                "height_start": heights["height_instrument"],
                "height_end": heights["height_target"],
            }
        further: dict[str, Any] = {} if name == "distance" else self.heights(rows)
        if name == "direction":
            further["orientation"] = self._orientations(rows)
        if name == "zenith":
            further["refraction"] = self.precision.refraction
        return further

    def _orientations(self, rows: Index) -> list[str]:
        """One orientation unknown for each instrument and set of the file."""
        sets = self.table.words.get("set", [""] * len(self.table))
        file = self.table.name
        return [
            f"orientation of {start}{f', set {sets[row]}' if sets[row] else ''} ({file})"
            for start, row in zip(self.table.names("from", rows), rows, strict=True)
        ]

    def _default(self, name: str, rows: Index) -> Callable[[], Array | None]:
        """The instrument's sigma for a quantity."""
        precision, repetitions = self.precision, self.repetitions(rows)
        if name in ("slope_distance", "horizontal_distance"):
            return partial(precision.of_distances, self.table.numbers[name][rows], repetitions)
        if name == "height_difference":
            return partial(precision.of_lines, self.table.number("length")[rows])
        if name not in ("direction", "zenith"):
            return lambda: None
        by_reading = precision.of_directions if name == "direction" else precision.of_zeniths
        end = precision.centring if name == "direction" else precision.height

        def angle() -> Array | None:
            lengths = self._lengths[rows]
            unknown = int(np.isnan(lengths).sum())
            if unknown and end:
                self.survey.warnings.append(
                    f"{self.table.path.name}: {unknown} of {len(rows)} {name}s have no measured "
                    "length, so that errors of centring and heights are not counted in them"
                )
            return by_reading(lengths, repetitions)

        return angle

    @cached_property
    def _lengths(self) -> Array:
        """Length [m] of each row's sight: its own, or the same line's elsewhere."""
        own = self.all * np.nan
        for name in LENGTHS:
            own = np.where(np.isnan(own), self.table.number(name), own)
        ends = zip(self.table.words["from"], self.table.words["to"], strict=True)
        lines = [frozenset(pair) for pair in ends]
        known = {line: x for line, x in zip(lines, own, strict=True) if not np.isnan(x)}
        return np.array([known.get(line, np.nan) for line in lines])
