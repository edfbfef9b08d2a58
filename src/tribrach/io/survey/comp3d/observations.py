"""Comp3D's observation files (``.obs``) and the files they name (``.xyz .bas .axe .eq``).

``code from to value sigma [sigma_rel [hi ht]]`` with sigma_rel per metre for lengths and in metres
across the line for angles; a negative code or sigma switches an observation off. Code 9 (centring)
is two offsets of zero with the two sigmas. Code 7 opens a round of directions; a 5 belongs to the
last round of its station. Subframes, baselines, axes and equalities stand in files of their own
that a line names.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import TypeVar

from tribrach.errors import InputError
from tribrach.io.survey.comp3d.points import SMALLEST_SIGMA, Comp3dPoints
from tribrach.io.survey.comp3d.records import (
    AxisRecord,
    CircleRecord,
    EqualRecord,
    FrameEntry,
    FrameRecord,
    Observed,
    PairRecord,
    SightRecord,
)
from tribrach.io.survey.comp3d.text import Problems, TextLine, read_lines

_Item = TypeVar("_Item")

#: codes of plain observations
_SIMPLE = (1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 15)
#: codes that points with a height only, or with a plan position only, can take part in
_HEIGHT_CODES, _PLAN_CODES = {4, 21}, {2, 5, 7, 8, 9, 14, 15}
#: reason of an observation that is switched off by its sigma
_OFF = "its sigma is negative in the file"
#: place of sx, sy, sz and sigma_rel by the number of sigmas of a Cartesian entry, -1 for none
_CARTESIAN = {1: (0, 0, 0, -1), 2: (0, 0, 0, 1), 3: (0, 1, 2, -1), 4: (0, 1, 2, 3), 5: (0, 1, 2, 3)}


def read_frame(line: TextLine, code: int, unit: float, problems: Problems) -> FrameRecord:
    """A subframe (11, 12) or baselines (19) with their file."""
    origin = _name(line)
    path, shown = line.subfile(2)
    extra = line.numbers(3, f"the subframe at {origin}")
    factor = extra[0] if code == 19 and extra else 1.0
    parse: dict[int, Callable[[TextLine], FrameEntry]] = {
        11: _cartesian,
        12: lambda entry: _polar(entry, unit),
        19: lambda entry: _baseline(entry, factor),
    }
    entries = _items(path, shown, line, problems, parse[code])
    for entry in entries:
        if entry.target == origin:
            raise entry.line.error(f"point {origin} is observed from itself")
    height = extra[1] if code == 19 and len(extra) > 1 else 0.0
    levelled = code != 19 and bool(extra) and extra[0] == 1
    return FrameRecord(code, origin, levelled, height, tuple(entries), line)


def read_axis(line: TextLine, problems: Problems) -> AxisRecord:
    """A rotation axis (18) with its file."""
    origin = _name(line)
    path, shown = line.subfile(2)
    circles: list[CircleRecord] = []
    feet: list[tuple[str, TextLine]] = []
    for item in _items(path, shown, line, problems, _axis_item):
        if isinstance(item, CircleRecord):
            circles.append(item)
        else:
            feet.append(item)
    seen: dict[str, TextLine] = {origin: line}
    for circle in circles:
        if circle.point in seen:
            raise circle.line.error(
                f"point {circle.point} is used twice on one axis "
                f"(first at {seen[circle.point].source})"
            )
        seen[circle.point] = circle.line
    return AxisRecord(origin, tuple(circles), tuple(feet), line)


def read_equal(line: TextLine, code: int, problems: Problems) -> EqualRecord:
    """An equality of height differences (21) or distances (22) with its file."""
    path, shown = line.subfile(1)
    pairs = _items(path, shown, line, problems, _pair)
    what = "height difference" if code == 21 else "distance"
    return EqualRecord(code, f"common {what} {shown} ({line.source})", tuple(pairs), line)


def _name(line: TextLine) -> str:
    if len(line.fields) < 2 or line.fields[1].startswith("@"):
        raise line.error("the point of the station is missing")
    return line.fields[1]


def _items(
    path: Path, shown: str, parent: TextLine, problems: Problems, parse: Callable[[TextLine], _Item]
) -> list[_Item]:
    """The lines of a named file, parsed."""
    out = []
    for line in read_lines(path, shown, problems):
        try:
            out.append(parse(line))
        except InputError as error:
            problems.refuse(error)
    if not out:
        raise parent.error(f"{shown} has no observations")
    return out


def _numbers(line: TextLine, first: int, counts: tuple[int, ...], form: str) -> list[float]:
    """The numbers of a line, if their count is allowed."""
    values = line.numbers(first, f"the line of {line.fields[0]}")
    if len(values) not in counts:
        raise line.error(f"{len(values)} numbers after {line.fields[first - 1]}", f"give {form}")
    return values


def _entry(
    line: TextLine, values: list[float], own: list[float], by_distance: list[float], height: float
) -> FrameEntry:
    """An entry with its sigmas checked."""
    if min(abs(s) for s in own) < SMALLEST_SIGMA:
        raise line.error("sigma is zero", "give a standard deviation above zero")
    if min(by_distance) < 0:
        raise line.error(f"relative sigma is {min(by_distance):g}", "give zero or more")
    off = [_OFF if s < 0 else "" for s in own]
    return FrameEntry(
        target=line.fields[0],
        values=(values[0], values[1], values[2]),
        own=(abs(own[0]), abs(own[1]), abs(own[2])),
        by_distance=(by_distance[0], by_distance[1], by_distance[2]),
        height=height,
        off=(off[0], off[1], off[2]),
        covariance=(),
        line=line,
    )


def _cartesian(line: TextLine) -> FrameEntry:
    """``target x y z`` with one to four sigmas and a target height."""
    form = "x y z, then sigma, sigma sigma_rel, or sx sy sz [sigma_rel [ht]]"
    values = _numbers(line, 1, (4, 5, 6, 7, 8), form)
    sigmas = values[3:]
    x, y, z, relative = _CARTESIAN[len(sigmas)]
    by_distance = sigmas[relative] if relative >= 0 else 0.0
    height = sigmas[4] if len(sigmas) == 5 else 0.0
    return _entry(line, values, [sigmas[x], sigmas[y], sigmas[z]], [by_distance] * 3, height)


def _polar(line: TextLine, unit: float) -> FrameEntry:
    """``target alpha beta distance`` with sigmas of angles and distance and a target height."""
    form = "two angles, distance, sigma_angle [sigma_angle_rel] sigma_distance sigma_rel [ht]"
    values = _numbers(line, 1, (6, 7, 8), form)
    sigmas = values[3:]
    across = sigmas.pop(1) if len(sigmas) > 3 else 0.0
    angle, distance, relative = sigmas[:3]
    height = sigmas[3] if len(sigmas) > 3 else 0.0
    if distance > 0 >= values[2]:
        raise line.error(f"distance is {values[2]:g} m", "give its sigma as negative")
    measured = [values[0] * unit, values[1] * unit, values[2]]
    own = [angle * unit, angle * unit, distance]
    return _entry(line, measured, own, [across, across, relative], height)


def _baseline(line: TextLine, factor: float) -> FrameEntry:
    """``target dX dY dZ xx xy xz yy yz zz [ht]`` in ECEF; sigmas scale by ``factor``."""
    values = _numbers(line, 1, (9, 10), "dX dY dZ xx xy xz yy yz zz [ht]")
    upper = values[3:9]
    diagonal = [upper[0], upper[3], upper[5]]
    off = _OFF if min(diagonal) < 0 else ""
    xx, yy, zz = map(abs, diagonal)
    covariance = (xx, upper[1], upper[2], yy, upper[4], zz)
    return FrameEntry(
        target=line.fields[0],
        values=(values[0], values[1], values[2]),
        own=(0.0, 0.0, 0.0),
        by_distance=(0.0, 0.0, 0.0),
        height=values[9] if len(values) > 9 else 0.0,
        off=(off, off, off),
        covariance=tuple(factor**2 * c for c in covariance),
        line=line,
    )


def _axis_item(line: TextLine) -> CircleRecord | tuple[str, TextLine]:
    """``target position point sigma_radius sigma_perpendicular``, or ``L point``."""
    if line.fields[0] == "L" and len(line.fields) == 2:
        return line.fields[1], line
    if len(line.fields) < 3:
        raise line.error("target, position and point are missing")
    radius, plane = _numbers(line, 3, (2,), "sigma_radius sigma_perpendicular")
    if min(abs(radius), abs(plane)) < SMALLEST_SIGMA:
        raise line.error("sigma is zero", "give a standard deviation above zero")
    return CircleRecord(line.fields[0], line.fields[2], radius, plane, line)


def _pair(line: TextLine) -> PairRecord:
    """``point1 point2 sigma``."""
    if len(line.fields) < 2:
        raise line.error("the pair of points is missing")
    (sigma,) = _numbers(line, 2, (1,), "sigma")
    if abs(sigma) < SMALLEST_SIGMA:
        raise line.error(f"sigma is {sigma:g}", "give a standard deviation above zero")
    if line.fields[0] == line.fields[1]:
        raise line.error(f"point {line.fields[0]} is paired with itself")
    return PairRecord(line.fields[0], line.fields[1], sigma, line)


def read_observations(
    path: Path, shown: str, points: Comp3dPoints, unit: float, problems: Problems
) -> Observed:
    """Observations of a file and all files it names."""
    reader = _Reader(points, unit, problems)
    for line in read_lines(path, shown, problems):
        try:
            reader.take(line)
        except InputError as error:
            problems.refuse(error)
    return reader.observed


@dataclass
class _Reader:
    points: Comp3dPoints
    unit: float
    problems: Problems
    observed: Observed = field(default_factory=Observed)
    rounds: dict[str, list[str]] = field(default_factory=dict)

    def take(self, line: TextLine) -> None:
        """Add the observation of a line."""
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

    def _check(self, line: TextLine, name: str) -> None:
        """Refuse a point without three dimensions as an origin."""
        record = self.points.records.get(name)
        if record is not None and not all(record.used):
            raise line.error(f"point {name} is not three-dimensional", "give it code 0 to 3")

    def _left_out(self, line: TextLine, *names: str) -> bool:
        """True, with a warning, if a line refers to a point that is left out."""
        for name in names:
            other = self.points.left_out.get(name)
            if other is not None:
                self.problems.warnings.append(
                    f"{line.source} is not used: {other.source} leaves point {name} out."
                )
                return True
        return False

    def _sight(self, line: TextLine, signed: int) -> None:
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
        self, line: TextLine, code: int, value: float, own: float, relative: float
    ) -> None:
        """Refuse values and sigmas that cannot be right."""
        if abs(own) < SMALLEST_SIGMA:
            raise line.error(f"sigma is {own:g}", "give a standard deviation above zero")
        if relative < 0 and code != 9:
            raise line.error(f"relative sigma is {relative:g}", "give zero or more")
        if code in (1, 2, 3) and value < 0 and own > 0:
            raise line.error(f"distance is {value:g} m")
        if code in (5, 6, 7, 8) and abs(value * self.unit) > 2 * pi:
            raise line.error(f"angle {value:g} is more than a full circle")

    def _circle(self, code: int, start: str, line: TextLine) -> str:
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
