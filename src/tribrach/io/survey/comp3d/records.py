"""The content of Comp3D's observation files, line by line, in metres and radians.

Plain observations are :class:`SightRecord`; observations that share unknowns come from files of
their own: subframes and baselines (:class:`FrameRecord`), rotation axes (:class:`AxisRecord`) and
equal distances or height differences (:class:`EqualRecord`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from tribrach.io.survey.comp3d.text import TextLine


@dataclass(frozen=True)
class SightRecord:
    """One plain observation."""

    #: 1 and 3 slope distance, 2 distance at the ellipsoid, 4 height difference, 5 and 7 direction,
    #: 6 zenith angle, 8 azimuth, 14 and 15 offset in east and north
    code: int
    #: names of the points
    start: str
    end: str
    value: float  #: in metres or radians
    own: float  #: part of the sigma that does not depend on the distance [m, rad]
    #: part that does: times the distance [m] for lengths, divided by it for angles
    by_distance: float
    #: in metres
    height_instrument: float
    height_target: float
    circle: str  #: name of the orientation unknown
    off: str  #: why it is switched off, "" if it is not
    line: TextLine  #: of the file

    @property
    def angular(self) -> bool:
        """True for angles."""
        return self.code in (5, 6, 7, 8)

    @property
    def names(self) -> tuple[str, str]:
        """Both ends."""
        return self.start, self.end

    def sigma(self, distance: float) -> float:
        """Standard deviation [m, rad] at a distance [m]."""
        if self.by_distance == 0:
            return self.own
        by_distance = self.by_distance
        return self.own + (by_distance / distance if self.angular else by_distance * distance)


@dataclass(frozen=True)
class FrameEntry:
    """One target of a subframe or baseline file."""

    target: str  #: its name
    #: x y z [m]; or horizontal angle, elevation [rad] and distance [m]; or ECEF components [m]
    values: tuple[float, float, float]
    #: sigmas as for :class:`SightRecord`, one for each value
    own: tuple[float, float, float]
    by_distance: tuple[float, float, float]
    height: float  #: of the target [m]
    off: tuple[str, str, str]  #: A reason for each value, "" if it is not switched off
    covariance: tuple[float, ...]  #: upper half xx xy xz yy yz zz [m^2] of a baseline
    line: TextLine  #: of the file


@dataclass(frozen=True)
class FrameRecord:
    """A subframe or a set of baselines."""

    code: int  #: 11 Cartesian and 12 polar subframe, 19 baselines
    origin: str  #: name of the point
    levelled: bool  #: its axis is vertical
    height: float  #: of the antenna at the origin [m], baselines only
    entries: tuple[FrameEntry, ...]  #: its targets
    line: TextLine  #: of the file


@dataclass(frozen=True)
class CircleRecord:
    """A target in one position of the turning body."""

    target: str  #: its name
    point: str  #: name of the target in this position
    #: in metres, negative if switched off
    sigma_radius: float
    sigma_plane: float
    line: TextLine  #: of the file


@dataclass(frozen=True)
class AxisRecord:
    """A rotation axis."""

    origin: str  #: name of a point on it
    circles: tuple[CircleRecord, ...]  #: its targets
    #: points whose foot on the axis is the origin, with their lines
    feet: tuple[tuple[str, TextLine], ...]
    line: TextLine  #: of the file


@dataclass(frozen=True)
class PairRecord:
    """A pair of points of an equality."""

    #: names of the points
    start: str
    end: str
    sigma: float  #: in metres, negative if switched off
    line: TextLine  #: of the file


@dataclass(frozen=True)
class EqualRecord:
    """Pairs with one common height difference or distance."""

    code: int  #: 21 height difference, 22 distance
    name: str  #: of the common value
    pairs: tuple[PairRecord, ...]  #: the pairs
    line: TextLine  #: of the file


@dataclass
class Observed:
    """All observations of a project."""

    #: the records
    sights: list[SightRecord] = field(default_factory=list)
    frames: list[FrameRecord] = field(default_factory=list)
    axes: list[AxisRecord] = field(default_factory=list)
    equals: list[EqualRecord] = field(default_factory=list)

    def without(self, names: set[str]) -> dict[str, list[str]]:
        """Drop what names some points."""
        lines: dict[str, list[str]] = {name: [] for name in names}

        def free(line: TextLine, *ends: str) -> bool:
            for name in names & set(ends):
                lines[name].append(line.source)
            return not names & set(ends)

        self.sights = [s for s in self.sights if free(s.line, *s.names)]
        frames = [
            replace(f, entries=tuple(e for e in f.entries if free(e.line, e.target)))
            for f in self.frames
            if free(f.line, f.origin)
        ]
        self.frames = [frame for frame in frames if frame.entries]
        axes = [
            replace(
                axis,
                circles=tuple(c for c in axis.circles if free(c.line, c.point)),
                feet=tuple(foot for foot in axis.feet if free(foot[1], foot[0])),
            )
            for axis in self.axes
            if free(axis.line, axis.origin)
        ]
        self.axes = [axis for axis in axes if axis.circles]
        equals = [
            replace(e, pairs=tuple(p for p in e.pairs if free(p.line, p.start, p.end)))
            for e in self.equals
        ]
        self.equals = [equal for equal in equals if equal.pairs]
        return lines

    def names(self, *, active: bool) -> set[str]:
        """Names of points in active observations, or in those that are switched off."""
        out: set[str] = set()
        for sight in self.sights:
            if (not sight.off) == active:
                out |= set(sight.names)
        for frame in self.frames:
            for entry in frame.entries:
                if all(entry.off) != active:
                    out |= {frame.origin, entry.target}
        for axis in self.axes:
            for circle in axis.circles:
                if (max(circle.sigma_radius, circle.sigma_plane) > 0) == active:
                    out |= {axis.origin, circle.point}
            if active:
                out |= {name for name, _ in axis.feet}
        for equal in self.equals:
            for pair in equal.pairs:
                if (pair.sigma > 0) == active:
                    out |= {pair.start, pair.end}
        return out
