"""The files that Comp3D's observation lines name: subframes, baselines, axes, equalities."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from tribrach.errors import InputError
from tribrach.io.survey.comp3d_points import SMALLEST_SIGMA
from tribrach.io.survey.comp3d_records import (
    AxisRecord,
    CircleRecord,
    EqualRecord,
    FrameEntry,
    FrameRecord,
    PairRecord,
)
from tribrach.io.survey.comp3d_text import Line, Problems, read_lines

__all__ = ["read_axis", "read_equal", "read_frame"]

_Item = TypeVar("_Item")

_OFF = "its sigma is negative in the file"
#: where sx, sy, sz and sigma_rel stand among so many numbers of a Cartesian entry, -1 for nowhere
_CARTESIAN = {1: (0, 0, 0, -1), 2: (0, 0, 0, 1), 3: (0, 1, 2, -1), 4: (0, 1, 2, 3), 5: (0, 1, 2, 3)}


def read_frame(line: Line, code: int, unit: float, problems: Problems) -> FrameRecord:
    """A subframe (11, 12) or baselines (19) with their file.

    Raises
    ------
    InputError : a malformed line, or no usable one.
    """
    origin = _name(line)
    path, shown = line.subfile(2)
    extra = line.numbers(3, f"the subframe at {origin}")
    factor = extra[0] if code == 19 and extra else 1.0
    parse: dict[int, Callable[[Line], FrameEntry]] = {
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


def read_axis(line: Line, problems: Problems) -> AxisRecord:
    """A rotation axis (18) with its file.

    Raises
    ------
    InputError : a malformed line, or a point that is used twice.
    """
    origin = _name(line)
    path, shown = line.subfile(2)
    circles: list[CircleRecord] = []
    feet: list[tuple[str, Line]] = []
    for item in _items(path, shown, line, problems, _axis_item):
        if isinstance(item, CircleRecord):
            circles.append(item)
        else:
            feet.append(item)
    seen: dict[str, Line] = {origin: line}
    for circle in circles:
        if circle.point in seen:
            raise circle.line.error(
                f"point {circle.point} is used twice on one axis "
                f"(first at {seen[circle.point].source})"
            )
        seen[circle.point] = circle.line
    return AxisRecord(origin, tuple(circles), tuple(feet), line)


def read_equal(line: Line, code: int, problems: Problems) -> EqualRecord:
    """An equality of height differences (21) or distances (22) with its file.

    Raises
    ------
    InputError : a malformed line, or no usable one.
    """
    path, shown = line.subfile(1)
    pairs = _items(path, shown, line, problems, _pair)
    what = "height difference" if code == 21 else "distance"
    return EqualRecord(code, f"common {what} {shown} ({line.source})", tuple(pairs), line)


def _name(line: Line) -> str:
    if len(line.fields) < 2 or line.fields[1].startswith("@"):
        raise line.error("the point of the station is missing")
    return line.fields[1]


def _items(
    path: Path, shown: str, parent: Line, problems: Problems, parse: Callable[[Line], _Item]
) -> list[_Item]:
    """What the lines of a named file say."""
    if not path.is_file():
        raise parent.error(f"there is no file {shown}")
    out = []
    for line in read_lines(path, shown, problems):
        try:
            out.append(parse(line))
        except InputError as error:
            problems.refuse(error)
    if not out:
        raise parent.error(f"{shown} has no observations")
    return out


def _numbers(line: Line, first: int, counts: tuple[int, ...], form: str) -> list[float]:
    """The numbers of a line, if their count is allowed."""
    values = line.numbers(first, f"the line of {line.fields[0]}")
    if len(values) not in counts:
        raise line.error(f"{len(values)} numbers after {line.fields[first - 1]}", f"give {form}")
    return values


def _entry(
    line: Line, values: list[float], own: list[float], by_distance: list[float], height: float
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


def _cartesian(line: Line) -> FrameEntry:
    """``target x y z`` with one to four sigmas and a target height."""
    form = "x y z, then sigma, sigma sigma_rel, or sx sy sz [sigma_rel [ht]]"
    values = _numbers(line, 1, (4, 5, 6, 7, 8), form)
    sigmas = values[3:]
    x, y, z, relative = _CARTESIAN[len(sigmas)]
    by_distance = sigmas[relative] if relative >= 0 else 0.0
    height = sigmas[4] if len(sigmas) == 5 else 0.0
    return _entry(line, values, [sigmas[x], sigmas[y], sigmas[z]], [by_distance] * 3, height)


def _polar(line: Line, unit: float) -> FrameEntry:
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


def _baseline(line: Line, factor: float) -> FrameEntry:
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


def _axis_item(line: Line) -> CircleRecord | tuple[str, Line]:
    """``target position point sigma_radius sigma_perpendicular``, or ``L point``."""
    if line.fields[0] == "L" and len(line.fields) == 2:
        return line.fields[1], line
    if len(line.fields) < 3:
        raise line.error("target, position and point are missing")
    radius, plane = _numbers(line, 3, (2,), "sigma_radius sigma_perpendicular")
    if min(abs(radius), abs(plane)) < SMALLEST_SIGMA:
        raise line.error("sigma is zero", "give a standard deviation above zero")
    return CircleRecord(line.fields[0], line.fields[2], radius, plane, line)


def _pair(line: Line) -> PairRecord:
    """``point1 point2 sigma``."""
    if len(line.fields) < 2:
        raise line.error("the pair of points is missing")
    (sigma,) = _numbers(line, 2, (1,), "sigma")
    if abs(sigma) < SMALLEST_SIGMA:
        raise line.error(f"sigma is {sigma:g}", "give a standard deviation above zero")
    if line.fields[0] == line.fields[1]:
        raise line.error(f"point {line.fields[0]} is paired with itself")
    return PairRecord(line.fields[0], line.fields[1], sigma, line)
