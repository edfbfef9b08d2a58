"""Comp3D's observation files (``.obs``) and the files they name (``.xyz .bas .axe .eq``).

``code from to value sigma [sigma_rel [hi ht]]`` with sigma_rel per metre for lengths and in
metres across the line for angles; a negative code or sigma switches an observation off. Code 9
(centring) is two offsets of zero with the two sigmas. Code 7 opens a round of directions; a 5
belongs to the last round of its station.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.survey.comp3d_frames import read_axis, read_equal, read_frame
from tribrach.io.survey.comp3d_points import SMALLEST_SIGMA, Points
from tribrach.io.survey.comp3d_records import Observed, SightRecord
from tribrach.io.survey.comp3d_text import Line, Problems, read_lines

__all__ = ["read_observations"]

_SIMPLE = (1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 15)
#: codes that points with a height only, or with a plan position only, can take part in
_HEIGHT_CODES, _PLAN_CODES = {4, 21}, {2, 5, 7, 8, 9, 14, 15}


def read_observations(
    path: Path, shown: str, points: Points, unit: float, problems: Problems
) -> Observed:
    """Observations of a file and all files it names.

    unit : radians of the files' angular unit.

    Raises
    ------
    InputError : a malformed line, an unknown code, a sigma too close to zero, a missing file.
    """
    reader = _Reader(points, unit, problems)
    for line in read_lines(path, shown, problems):
        try:
            reader.take(line)
        except InputError as error:
            problems.refuse(error)
    return reader.observed


@dataclass
class _Reader:
    points: Points
    unit: float
    problems: Problems
    observed: Observed = field(default_factory=Observed)
    rounds: dict[str, list[str]] = field(default_factory=dict)

    def take(self, line: Line) -> None:
        """Add what a line says."""
        code = line.integer(0, "the observation code")
        if abs(code) in _SIMPLE:
            self._sight(line, code)
        elif code in (11, 12, 19):
            frame = read_frame(line, code, self.unit, self.problems)
            self._check(line, frame.origin)
            kept = tuple(e for e in frame.entries if not self._left_out(e.line, e.target))
            if kept and not self._left_out(line, frame.origin):
                self.observed.frames.append(
                    type(frame)(code, frame.origin, frame.levelled, frame.height, kept, line)
                )
        elif code == 18:
            axis = read_axis(line, self.problems)
            self._check(line, axis.origin)
            self.observed.axes.append(axis)
        elif code in (21, 22):
            self.observed.equals.append(read_equal(line, code, self.problems))
        else:
            raise line.error(f"unknown observation code {code}")

    def _check(self, line: Line, name: str) -> None:
        """Refuse a point without three dimensions as an origin."""
        record = self.points.records.get(name)
        if record is not None and not all(record.used):
            raise line.error(f"point {name} is not three-dimensional", "give it code 0 to 3")

    def _left_out(self, line: Line, *names: str) -> bool:
        """True, with a warning, if a line refers to a point that is left out."""
        for name in names:
            other = self.points.left_out.get(name)
            if other is not None:
                self.problems.warnings.append(
                    f"{line.source} is not used: {other.source} leaves point {name} out."
                )
                return True
        return False

    def _sight(self, line: Line, signed: int) -> None:
        """Add a plain observation."""
        code = abs(signed)
        if len(line.fields) < 3:
            raise line.error("the observation has no points")
        start, end = line.fields[1:3]
        numbers = line.numbers(3, f"the observation from {start} to {end}")
        if len(numbers) not in (2, 3, 5):
            raise line.error(
                f"{len(numbers)} numbers after {start} {end}",
                "give value, sigma, then nothing, sigma_rel, or sigma_rel hi ht",
            )
        if start == end:
            raise line.error(f"point {start} is observed from itself")
        value, own = numbers[:2]
        relative = numbers[2] if len(numbers) > 2 else 0.0
        heights = (numbers[3], numbers[4]) if len(numbers) == 5 else (0.0, 0.0)
        self._check_sight(line, code, value, own, relative)
        circle = self._circle(code, start, line)
        if self._left_out(line, start, end):
            return
        off = "" if signed > 0 else "its code is negative in the file"
        off = off or self._dimension(code, start, end)
        if code == 9:
            north = relative if abs(relative) >= SMALLEST_SIGMA else own
            pairs = [(14, 0.0, own, 0.0), (15, 0.0, north, 0.0)]
        else:
            factor = self.unit if code in (5, 6, 7, 8) else 1.0
            pairs = [(code, value * factor, own * factor, relative)]
        for kind, measured, sigma, by_distance in pairs:
            reason = off or ("" if sigma > 0 else "its sigma is negative in the file")
            ends = (start, end, measured, abs(sigma), by_distance, *heights)
            self.observed.sights.append(SightRecord(kind, *ends, circle, reason, line))

    def _check_sight(
        self, line: Line, code: int, value: float, own: float, relative: float
    ) -> None:
        """Refuse values and sigmas that cannot be meant."""
        if abs(own) < SMALLEST_SIGMA:
            raise line.error(f"sigma is {own:g}", "give a standard deviation above zero")
        if relative < 0 and code != 9:
            raise line.error(f"relative sigma is {relative:g}", "give zero or more")
        if code in (1, 2, 3) and value < 0 and own > 0:
            raise line.error(f"distance is {value:g} m")
        if code in (5, 6, 7, 8) and abs(value * self.unit) > 2 * pi:
            raise line.error(f"angle {value:g} is more than a full circle")

    def _circle(self, code: int, start: str, line: Line) -> str:
        """Name of the orientation unknown of a direction, "" for other codes."""
        if code not in (5, 7):
            return ""
        rounds = self.rounds.setdefault(start, [])
        if code == 7 or not rounds:
            if code == 5:
                self.problems.warnings.append(
                    f"{line.source}: direction without a 7 before it opens a round at {start}."
                )
            rounds.append(f"orientation {start} ({line.source})")
        return rounds[-1]

    def _dimension(self, code: int, *names: str) -> str:
        """Why points without height or plan position make an observation unusable, or ""."""
        for name in names:
            record = self.points.records.get(name)
            if record is None or all(record.used):
                continue
            if not record.used[0] and code not in _HEIGHT_CODES:
                return f"point {name} has a height only"
            if not record.used[2] and code not in _PLAN_CODES:
                return f"point {name} has no height"
        return ""
