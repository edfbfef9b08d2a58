"""Sights, angles and levelling from a CSV file: what a total station or a level measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Literal

import numpy as np

from tribrach._types import Array, Index
from tribrach.io.survey.csv.columns import SIGHT_KINDS
from tribrach.io.survey.csv.reader import Reader, located
from tribrach.network.occupations import Ends, Occupied, occupy, share_refraction
from tribrach.network.shared_heights import SharedHeight, share_heights
from tribrach.observations.base import Observations
from tribrach.observations.declaration import CsvColumns, SightLength, SightLine
from tribrach.observations.sights import Angles, ZenithAngles, face_two_words
from tribrach.sentences import Sentence


class _Sighted(Reader):
    """What sights and angles share: heights of both ends and repetitions."""

    def heights(self, columns: CsvColumns, rows: Index) -> dict[str, Any]:
        """Heights of instrument and target [m] for a kind's fields, zero where not given."""
        given = zip(columns.heights, ("height_instrument", "height_target"), strict=False)
        return {name: np.nan_to_num(self.table.number(title)[rows]) for name, title in given}

    def repetitions(self, rows: Index) -> Array:
        """How often each value was measured; 1 where not given."""
        given = self.table.number("repetitions")[rows]
        bad = np.flatnonzero(given < 1)
        number = self.table.number("repetitions")
        self.table.refuse(
            rows[bad], lambda row: f"repetitions is {number[row]:g}", "give 1 or more"
        )
        return np.where(np.isnan(given), 1.0, given)


class AngleReader(_Sighted):
    """Angles ``at`` an instrument, clockwise ``from`` a backsight ``to`` a foresight."""

    def read(self) -> None:
        """All angles of the file."""
        rows, columns = self.all, Angles.facts.csv[0]
        unknown = np.full(len(rows), np.nan)
        line = SightLine(unknown, unknown, unknown, self.repetitions(rows))
        sigma = self.sigma(
            ("sigma_angle", "sigma"), rows, lambda: Angles.instrument_sigma(self.precision, line)
        )
        self.add(
            Angles,
            rows,
            values=self.table.columns(*columns.values)[:, 0],
            sigma=sigma,
            start=self.table.names("at", rows),
            end=self.table.names("from", rows),
            foresight=self.table.names("to", rows),
            **self.heights(columns, rows),
        )


class SightReader(_Sighted):
    """Sights ``from`` an instrument ``to`` a target, each with one or several values."""

    #: errors of centring that sights have in common, by what was measured
    occupied: dict[str, Occupied]
    bent: dict[str, Any]  #: the column of zenith angles with unknown changes of refraction

    def read(self) -> None:
        """All values of the file; a cell that is empty was not measured."""
        measured = [name for name in SIGHT_KINDS if name in self.table.numbers]
        rows = {name: np.flatnonzero(~np.isnan(self.table.numbers[name])) for name in measured}
        if not any(len(index) for index in rows.values()):
            raise self.table.error(
                None, "no row has a measured value", "add a column such as direction_gon"
            )
        if self.table.has("sigma") and len(measured) > 1:
            raise self.table.error(
                None,
                f"{self.table.titles['sigma']} could mean {' or '.join(measured)}",
                f"name it sigma_{measured[0]} with its unit",
            )
        self.occupy(rows)
        for name in measured:
            if len(rows[name]):
                self._add(name, rows[name])
        for end in ("instrument", "target"):
            self._refuse_heights(end, rows)
            self._share_heights(end)

    def _refuse_heights(self, end: str, measured: dict[str, Index]) -> None:
        """Refuse unknown heights of rows whose values cannot share one: height differences."""
        title = f"height_{end}"
        known = [rows for name, rows in measured.items() if title in SIGHT_KINDS[name][1].heights]
        without = np.setdiff1d(self.all, np.concatenate([np.zeros(0, dtype=np.int64), *known]))
        typed = np.array(self.table.words.get(f"{title}_of", [""] * len(self.table)), dtype=object)
        given = (typed != "") | ~np.isnan(self.table.number(f"sigma_{title}"))
        self.table.refuse(
            without[given[without]],
            f"an unknown height of {end} has no effect on what this row measures",
            f"leave the cell empty; a known {title}_m is used",
        )

    def _share_heights(self, end: Literal["instrument", "target"]) -> None:
        """Heights that are unknowns: those that have a name or a sigma of their own."""
        table, field_name = self.table, f"height_{end}"
        typed = np.array(table.words.get(f"{field_name}_of", [""] * len(table)), dtype=object)
        sigma = table.number(f"sigma_{field_name}")
        for row in np.flatnonzero((typed == "") & ~np.isnan(sigma)):
            typed[row] = self._usual_height(end, int(row))
        for name in dict.fromkeys(typed[typed != ""]):
            rows = np.flatnonzero(typed == name)
            known = sigma[rows][~np.isnan(sigma[rows])]
            if len(known) and (len(known) < len(rows) or np.ptp(known) > 0):
                raise table.error(
                    int(rows[0]),
                    f"the sights that share the height of {end} {name} do not give it one sigma",
                    f"fill {table.titles[f'sigma_{field_name}']} alike in all of their rows",
                )
            shared = SharedHeight(
                end,
                f"height of {end} {name} ({table.name})",
                None,
                float(known[0]) if len(known) else None,
                str(self.sources[rows[0]]),
            )
            tables = self.survey.tables()
            of = [np.isin(t.columns["source"], self.sources[rows]) for t in tables]
            with located(table.path):
                share_heights(self.survey, shared, dict(enumerate(of)))

    def _usual_height(self, end: str, row: int) -> str:
        """What a height with a sigma and no name is shared by: set-up and set, or target."""
        words = self.table.words
        if end == "target":
            height = np.nan_to_num(self.table.number("height_target")[row])
            return Sentence("over {words}, {height:m4}", words=words["to"][row], height=height)
        one = words.get("set", [""] * len(self.table))[row]
        return Sentence("at {words}", words=words["from"][row]) + (f", set {one}" if one else "")

    def _add(self, name: str, rows: Index) -> None:
        kind, columns = SIGHT_KINDS[name]
        values = self.table.numbers[name][rows]
        if columns.length is not SightLength.NO:
            self.table.refuse(
                rows[~(values > 0)], f"{name} is not above zero", "give a length above zero"
            )
        if kind is ZenithAngles and (over := (values > np.pi) & (values < 2 * np.pi)).any():
            values = np.where(over, 2 * np.pi - values, values)
            self.survey.warnings.append(face_two_words(self.sources[rows[over]].tolist()))
        self.add(
            kind,
            rows,
            values=values,
            sigma=self.sigma(self.sigmas_of(name), rows, self._default(name, rows)),
            start=self.table.names("from", rows),
            end=self.table.names("to", rows),
            **self.further(name, rows),
        )

    def sigmas_of(self, name: str) -> tuple[str, ...]:
        """Columns that hold a kind's sigma."""
        return tuple(dict.fromkeys((f"sigma_{name}", *SIGHT_KINDS[name][1].sigmas, "sigma")))

    def occupy(self, rows: Mapping[str, Index]) -> None:
        """Find the errors of centring that sights without a sigma of their own have in common."""
        own = {n: np.isnan(self.given_sigma(self.sigmas_of(n), rows[n])) for n in rows}
        ends = [self._ends(name, rows[name][mask]) for name, mask in own.items()]
        found = occupy(self.survey, self.precision, self.table.name, ends)
        self.occupied = {}
        for (name, mask), one in zip(own.items(), found, strict=True):
            whole = [np.full(len(mask), "", dtype=object) for _ in range(2)]
            whole[0][mask], whole[1][mask] = one.instrument, one.target
            self.occupied[name] = Occupied(*whole)
        self.bent = {}
        if ZenithAngles.kind in rows:
            zeniths = rows[ZenithAngles.kind]
            length = self.lengths_of(zeniths)
            ends_of = self._ends(ZenithAngles.kind, zeniths)
            self.bent = share_refraction(
                self.survey, self.precision, self.table.name, ends_of, length
            )

    def _ends(self, name: str, rows: Index) -> Ends:
        """Where rows of a kind go."""
        start, end = (
            np.array(self.table.names(side, rows), dtype=object) for side in ("from", "to")
        )
        return Ends(SIGHT_KINDS[name][0], start, end, np.full(len(rows), "", dtype=object))

    def lengths_of(self, rows: Index) -> Array:
        """Lengths (n,) of sights [m], NaN where they are not known."""
        lengths: Array = self._lengths[rows]
        return lengths

    def further(self, name: str, rows: Index) -> dict[str, Any]:
        """What a kind wants besides its value and its ends."""
        kind, columns = SIGHT_KINDS[name]
        of_sets = {
            reference.name: self._names_by_set(reference.means, rows)
            for reference in kind.references()
            if reference.by_set
        }
        return (
            self.heights(columns, rows)
            | of_sets
            | kind.instrument_columns(self.precision)
            | self.occupied[name].columns
            | (self.bent if kind is ZenithAngles else {})
        )

    def _names_by_set(self, means: str, rows: Index) -> list[str]:
        """One unknown for each instrument and set of the file."""
        sets = self.table.words.get("set", [""] * len(self.table))
        file = self.table.path.name
        return [
            f"{means} of {start}{f', set {sets[row]}' if sets[row] else ''} ({file})"
            for start, row in zip(self.table.names("from", rows), rows, strict=True)
        ]

    def _default(self, name: str, rows: Index) -> Callable[[], Array | None]:
        """The instrument's sigma for a quantity."""
        kind, _ = SIGHT_KINDS[name]
        line = SightLine(
            self.table.numbers[name][rows],
            self._lengths[rows],
            self.table.number("length")[rows],
            self.repetitions(rows),
            ends=self.occupied[name].ends,
        )

        def sigma() -> Array | None:
            self._warn_of_lengths(kind, line)
            return kind.instrument_sigma(self.precision, line)

        return sigma

    def _warn_of_lengths(self, kind: type[Observations], line: SightLine) -> None:
        """Say where the errors of the ends of a sight cannot be counted."""
        unknown = int((np.isnan(line.sight) & (line.ends > 0)).sum())
        if unknown and kind.sigma_by_length(self.precision):
            self.survey.warnings.append(
                f"{self.table.path.name}: {unknown} of {len(line.sight)} {kind.facts.title}s have "
                "no measured length, so that errors of centring and heights are not counted in "
                "them"
            )

    @cached_property
    def _lengths(self) -> Array:
        """Length [m] of each row's sight: its own, or the same line's elsewhere."""
        own = self.all * np.nan
        for name, (_, columns) in SIGHT_KINDS.items():
            if columns.length is SightLength.NO:
                continue
            own = np.where(np.isnan(own), self.table.number(name), own)
        ends = zip(self.table.words["from"], self.table.words["to"], strict=True)
        lines = [frozenset(pair) for pair in ends]
        known = {line: x for line, x in zip(lines, own, strict=True) if not np.isnan(x)}
        return np.array([known.get(line, np.nan) for line in lines])
