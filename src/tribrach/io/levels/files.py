"""Survey of files of digital levels: every pair of staff readings is a height difference.

Double readings (BFFB) are two height differences of a set-up. Heights that were keyed in at the
start of a line are given; those that the instrument computed are not used. Loops, double runs and
lines between given heights are closed before anything is adjusted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError, RefusalCollector
from tribrach.instruments.precision import Precision
from tribrach.io.levels import dini, gsi, kolida
from tribrach.io.levels.readings import LevelFile, LevelLine, LevelSetup, StaffReading
from tribrach.io.totalstation.text import head
from tribrach.network.facts import Fact, facts_of
from tribrach.network.identity import names_apart
from tribrach.network.level_closures import LevelClosure, LevelSection, level_closures
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.sentences import Sentence

#: modules of the formats, by what they are called
_FORMATS: dict[str, Any] = {
    "Leica GSI of a level": gsi,
    "DiNi of Trimble or Zeiss": dini,
    "Kolida DL": kolida,
}
#: of a level that nobody has described, for a line of one kilometre [m]
TYPICAL = 1e-3
#: misclosures and double readings beyond this many sigmas are told
_LIMIT = 3.0
#: length of a set-up whose distances are not known [m]
_USUAL = 60.0
#: an intermediate sight must agree with the height that the file has of it [m]
_AGREES = 5e-3
#: sentences of one kind
_MOST = 8


@dataclass(frozen=True)
class Levelled(Fact):
    """What files of levels hold, and how their lines close."""

    files: tuple[LevelFile, ...]
    #: lines between points, as means of their readings
    sections: tuple[LevelSection, ...]
    closures: tuple[LevelClosure, ...]
    doubles: tuple[float, ...]  #: set-ups with double readings, and the differences of those [m]


def recognised(path: Path) -> bool:
    """True if a file begins as one of a digital level."""
    return _format_of(path) is not None


def format_name(path: Path) -> str:
    """The format of such a file in words."""
    return _format_of(path) or ""


def _format_of(path: Path) -> str | None:
    """The format that the beginning of a file shows."""
    text = head(path, 20_000)
    return next((name for name, format in _FORMATS.items() if format.sniff(text)), None)


def read(
    paths: Sequence[Path],
    precision: Precision | None = None,
    labels: Mapping[Path, str] | None = None,
) -> Survey:
    """Survey of files of levels.

    ``precision``: of the level, a millimetre for a line of one kilometre if it says nothing of
    levelling; ``labels``: what tells files of the same name apart, by path.
    """
    apart = names_apart(paths) if labels is None else labels
    files = []
    with RefusalCollector() as refused:
        for path in paths:
            with refused.record():
                name = _format_of(path)
                if name is None:
                    raise InputError(
                        "this is no file of a known digital level",
                        file=path,
                        cure="export it as GSI or M5, or give height differences as CSV",
                    )
                files.append(_FORMATS[name].read(path))
    survey = Survey()
    sigma = None if precision is None else precision.levelling
    if sigma is None:
        sigma = TYPICAL
        survey.warnings.append(
            "The level is not described: 1 mm for a line of one kilometre is assumed. State its "
            "sigma in a project ([instruments])."
        )
    sections: list[LevelSection] = []
    doubles: list[float] = []
    given: dict[str, float] = {}
    files, turning = _own_turning_points(files)
    if turning:
        survey.warnings.append(
            f"{turning} turning points have numbers that several lines use: they are other points "
            "in every line."
        )
    nothing = list[str]()
    for file in files:
        _Writer(survey, file, apart[file.path], sigma).write(sections, doubles)
        for name, (height, line) in file.given.items():
            if height == 0:
                nothing.append(name)
                continue
            if name in given:
                continue
            given[name] = height
            survey.point(
                name, (np.nan, np.nan, height), free=(False, False, False), role="control",
                source=f"{apart[file.path]}:{line}",
            )  # fmt: skip
    if nothing:
        survey.warnings.append(
            f"The height 0.000 m at the start of lines ({', '.join(nothing[:_MOST])}) stands for "
            "none: state heights in a project or a list of points."
        )
    closures = level_closures(sections, given, _LIMIT * sigma)
    survey.facts += (Levelled(tuple(files), tuple(sections), tuple(closures), tuple(doubles)),)
    survey.warnings += _closure_words(closures)
    if not given:
        survey.datum = Datum("free")
        survey.warnings.append("The files give no height: all points carry the datum.")
    return survey


def _own_turning_points(files: list[LevelFile]) -> tuple[list[LevelFile], int]:
    """Files in which a numbered turning point is one of its line; how many there are.

    Levels number turning points from one on in every line. Ends of lines, points with a height and
    points with a name are the same wherever they occur.
    """
    lines = [line for file in files for line in file.lines]
    inside = [
        {s.fore[0].point for s in line.setups[:-1] if s.fore}
        | {s.back[0].point for s in line.setups[1:]}
        for line in lines
    ]
    marks = {name for file in files for name in file.given}
    marks |= {name for line in lines for name in (line.start, line.end)}
    count = Counter(name for names in inside for name in names if name.isdigit())
    again = {name for name, n in count.items() if n > 1} - marks
    if not again:
        return files, 0
    out, number = [], 0
    for file in files:
        renamed = []
        for line in file.lines:
            number += 1
            renamed.append(_renamed(line, {name: f"{name} (line {number})" for name in again}))
        out.append(replace(file, lines=tuple(renamed)))
    return out, sum(count[name] for name in again)


def _renamed(line: LevelLine, names: Mapping[str, str]) -> LevelLine:
    """A line with other names of some points."""

    def each(readings: list[StaffReading]) -> list[StaffReading]:
        """The readings with these names."""
        return [replace(r, point=names.get(r.point, r.point)) for r in readings]

    return LevelLine(
        tuple(LevelSetup(each(s.back), each(s.fore), each(s.side)) for s in line.setups)
    )


def leave_to(survey: Survey, known: Collection[str]) -> None:
    """Take heights out that were keyed in, of points that something else gives a height of."""
    keyed = {
        name for fact in facts_of(survey.facts, Levelled) for f in fact.files for name in f.given
    }
    double = sorted(keyed & set(known) & survey.points.keys())
    for name in double:
        del survey.points[name]
    if double:
        listed = ", ".join(double[:_MOST]) + (" and more" if len(double) > _MOST else "")
        survey.warnings.append(
            f"Heights of {listed} that were keyed into the level are not used: they are given "
            "elsewhere."
        )


def _closure_words(closures: Sequence[LevelClosure]) -> list[str]:
    """That lines close, and those that do not."""
    bad = sorted((c for c in closures if not c.passed), key=lambda c: c.limit - abs(c.misclosure))
    out = [f"Before the adjustment {c.sentence()}: level it again." for c in bad[:_MOST]]
    if len(bad) > _MOST:
        out.append(f"{len(bad) - _MOST} more closures are beyond their limits.")
    return out


class _Writer:
    """Adds the set-ups of a file to a survey."""

    def __init__(self, survey: Survey, file: LevelFile, label: str, sigma: float) -> None:
        self.survey, self.file, self.label, self.sigma = survey, file, label, sigma
        self.rows: list[tuple[str, str, float, float, int]] = []
        #: heights by what was read so far, where the start is known
        self.heights = {name: height for name, (height, _) in file.given.items()}
        self.strange: list[tuple[int, str]] = []
        self.unknown = 0

    def write(self, sections: list[LevelSection], doubles: list[float]) -> None:
        """All lines."""
        for line in self.file.lines:
            for setup in line.setups:
                if setup.whole:
                    self._setup(setup, doubles)
                    length = setup.length if np.isfinite(setup.length) else _USUAL
                    start, end = setup.back[0].point, setup.fore[0].point
                    sections.append(LevelSection(start, end, setup.difference, length))
                    if start in self.heights:
                        self.heights.setdefault(end, self.heights[start] + setup.difference)
                self._sides(setup)
        self._say()
        if not self.rows:
            raise InputError(
                "no set-up of the file can be used",
                file=self.file.path,
                cure="give the whole file as the level wrote it",
            )
        starts, ends, values, sigmas, lines = (list(c) for c in zip(*self.rows, strict=True))
        self.survey.add(
            HeightDifferences,
            values=values,
            sigma=sigmas,
            start=starts,
            end=ends,
            source=[f"{self.label}:{n}" for n in lines],
        )

    def _sigma(self, length: float) -> float:
        """Sigma of one height difference along a set-up [m]."""
        if not np.isfinite(length):
            self.unknown += 1
            length = _USUAL
        return self.sigma * float(np.sqrt(max(length, 1.0) / 1000))

    def _setup(self, setup: LevelSetup, doubles: list[float]) -> None:
        """The pairs of a set-up, or its mean where readings have no partner."""
        start, end = setup.back[0].point, setup.fore[0].point
        pairs = setup.pairs() if len(setup.back) == len(setup.fore) else []
        sigma = self._sigma(setup.length)
        if not pairs:
            self.rows.append((start, end, setup.difference, sigma, setup.fore[0].line))
            return
        # together the pairs of a set-up are as good as the level is said to be
        own = sigma * float(np.sqrt(len(pairs)))
        differences = [b.value - f.value for b, f in pairs]
        for difference, (_, fore) in zip(differences, pairs, strict=True):
            self.rows.append((start, end, difference, own, fore.line))
        if len(pairs) > 1:
            spread = max(differences) - min(differences)
            doubles.append(spread)
            if spread > _LIMIT * own * np.sqrt(2):
                self.strange.append(
                    (
                        pairs[-1][1].line,
                        Sentence(
                            "the double readings from {start} to {end} differ by {spread:mm1}",
                            start=start,
                            end=end,
                            spread=spread,
                        ),
                    )
                )

    def _sides(self, setup: LevelSetup) -> None:
        """Intermediate sights, each from the backsight of its set-up."""
        if not setup.side or not setup.back:
            return
        start = setup.back[0].point
        horizon = float(np.mean([r.value for r in setup.back]))
        near = float(np.mean([r.distance for r in setup.back]))
        for side in setup.side:
            if side.point == start:
                continue
            difference = horizon - side.value
            known = self.heights.get(start)
            if known is not None and abs(known + difference - side.height) > _AGREES:
                self.strange.append(
                    (
                        side.line,
                        Sentence(
                            "the intermediate sight to {name} is left out: the file has the height "
                            "{file:3} m, and its set-up gives {own:3} m, so lines are missing",
                            name=side.point,
                            file=side.height,
                            own=known + difference,
                        ),
                    )
                )
                continue
            sigma = self._sigma(near + side.distance)
            self.rows.append((start, side.point, difference, sigma, side.line))

    def _say(self) -> None:
        """Report oddities and assumptions."""
        told = [*self.file.problems, *self.strange]
        self.survey.warnings += [
            f"{self.label}:{line}: {what}." for line, what in sorted(told)[:_MOST]
        ]
        if len(told) > _MOST:
            self.survey.warnings.append(f"{self.label}: {len(told) - _MOST} more of this kind.")
        if self.unknown:
            self.survey.warnings.append(
                f"{self.label}: {self.unknown} sights have no distance; set-ups of {_USUAL:.0f} m "
                "are assumed for their sigmas."
            )
