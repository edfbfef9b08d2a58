"""Comp3D's coordinate files (``.cor``): points and their constraints.

``code name E N h [sigma_E sigma_N sigma_h [eta xi]]``, or without sigmas but with the deflection of
the vertical (arc seconds). The code gives dimension and constraints; a sigma of zero holds a
constrained coordinate, a negative one switches its constraint off. Code -1 leaves a point out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.survey.comp3d.text import Problems, TextLine, read_lines

#: sigmas closer to zero than this are a mistake [m or file unit]
SMALLEST_SIGMA = 1e-8
#: axes (of E, N, h) that exist and that are constrained, by point code
_CODES: dict[int, tuple[str, str]] = {
    0: ("ENh", ""),
    1: ("ENh", "ENh"),
    2: ("ENh", "EN"),
    3: ("ENh", "h"),
    4: ("h", ""),
    5: ("h", "h"),
    6: ("EN", ""),
    7: ("EN", "EN"),
    8: ("EN", ""),
    9: ("EN", "EN"),
}


@dataclass(frozen=True)
class Comp3dPoint:
    """A point of a coordinate file."""

    name: str  #: of the point
    enh: tuple[float, float, float]  #: grid coordinates and height [m]
    sigmas: tuple[float, float, float]  #: as written, NaN if not given
    #: which of E, N, h exist and which are constrained
    used: tuple[bool, bool, bool]
    constrained: tuple[bool, bool, bool]
    deflection: tuple[float, float] | None  #: eta, xi [arc seconds] or None
    far: bool  #: carries no inner constraints
    line: TextLine  #: of the file

    @property
    def held(self) -> tuple[bool, ...]:
        """Which of E, N, h are fixed."""
        return tuple(c and s == 0 for c, s in zip(self.constrained, self.sigmas, strict=True))

    def same(self, other: Comp3dPoint) -> bool:
        """True if another record has the same content."""
        own = (self.enh, self.sigmas, self.used, self.constrained, self.deflection)
        return repr(own) == repr(
            (other.enh, other.sigmas, other.used, other.constrained, other.deflection)
        )


@dataclass(frozen=True)
class Comp3dPoints:
    """All points of a project."""

    records: dict[str, Comp3dPoint]  #: by name
    left_out: dict[str, TextLine]  #: lines that leave points out, by name


def read_points(path: Path, shown: str, problems: Problems) -> Comp3dPoints:
    """Points of a coordinate file and the files it includes."""
    points = Comp3dPoints({}, {})
    coded = path.suffix.lower() != ".new"
    for line in read_lines(path, shown, problems):
        try:
            _add(points, line if coded else _with_code(line), problems)
        except InputError as error:
            problems.refuse(error)
    return points


def _with_code(line: TextLine) -> TextLine:
    """A line of a result file, which has no codes, as a free point."""
    return TextLine(line.file, line.number, ("0", *line.fields), line.folder, line.root)


def _add(points: Comp3dPoints, line: TextLine, problems: Problems) -> None:
    """Add the point of a line."""
    code = line.integer(0, "the point code")
    if len(line.fields) < 2:
        raise line.error("the point has no name")
    name = line.fields[1]
    if code < 0:
        if name in points.records:
            raise line.error(f"point {name} is both given and left out")
        points.left_out.setdefault(name, line)
        return
    record = _record(line, code, name, problems)
    if name in points.left_out:
        raise line.error(f"point {name} was left out at {points.left_out[name].source}")
    first = points.records.get(name)
    if first is None:
        points.records[name] = record
    elif first.same(record):
        problems.warnings.append(f"{line.source}: point {name} repeats {first.line.source}.")
    else:
        raise line.error(
            f"point {name} is defined twice (first at {first.line.source})",
            "keep one definition",
        )


def _record(line: TextLine, code: int, name: str, problems: Problems) -> Comp3dPoint:
    """The point of a line with coordinates."""
    if code not in _CODES:
        raise line.error(f"unknown point code {code}", "use 0 to 9, or -1 to leave a point out")
    values = line.numbers(2, f"point {name}")
    if len(values) not in (3, 5, 6, 8):
        raise line.error(
            f"point {name} has {len(values)} numbers after its name",
            "give E N h, then no or three sigmas, then no or two deflections",
        )
    used, constrained = _CODES[code]
    sigmas = values[3:6] if len(values) in (6, 8) else [nan] * 3
    if constrained and len(values) in (3, 5):
        raise line.error(f"constrained point {name} has no sigmas", "give sigma_E sigma_N sigma_h")
    wanted = [axis in constrained for axis in "ENh"]
    for axis, sigma in enumerate(sigmas):
        if wanted[axis] and 0 < abs(sigma) < SMALLEST_SIGMA:
            problems.refuse(
                line.error(f"sigma {sigma:g} m of point {name} is too small", "use 0 to hold it")
            )
            wanted[axis] = False
    return Comp3dPoint(
        name=name,
        enh=(values[0], values[1], values[2]),
        sigmas=(sigmas[0], sigmas[1], sigmas[2]),
        used=("E" in used, "N" in used, "h" in used),
        constrained=(wanted[0], wanted[1], wanted[2]),
        deflection=(values[-2], values[-1]) if len(values) in (5, 8) else None,
        far=code in (8, 9),
        line=line,
    )
