"""The content of Comp3D's observation files, line by line, in metres and radians.

Plain observations are :class:`SightRecord`; observations that share unknowns come from files of
their own: subframes and baselines (:class:`FrameRecord`), rotation axes (:class:`AxisRecord`) and
equal distances or height differences (:class:`EqualRecord`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from tribrach.io.survey.comp3d.text import TextLine

__all__ = [
    "AxisRecord",
    "CircleRecord",
    "EqualRecord",
    "FrameEntry",
    "FrameRecord",
    "Observed",
    "PairRecord",
    "SightRecord",
]


@dataclass(frozen=True)
class SightRecord:
    """One plain observation.

    Attributes
    ----------
    code
        1 and 3 slope distance, 2 distance at the ellipsoid, 4 height difference, 5 and 7 direction,
        6 zenith angle, 8 azimuth, 14 and 15 offset in east and north.
    start, end
        Names of the points.
    value
        In metres or radians.
    own
        Part of the sigma that does not depend on the distance [m, rad].
    by_distance
        Part that does: times the distance [m] for lengths, divided by it for angles.
    height_instrument, height_target
        In metres.
    circle
        Name of the orientation unknown.
    off
        Why it is switched off, "" if it is not.
    line
        Of the file.
    """

    code: int
    start: str
    end: str
    value: float
    own: float
    by_distance: float
    height_instrument: float
    height_target: float
    circle: str
    off: str
    line: TextLine

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
    """One target of a subframe or baseline file.

    Attributes
    ----------
    target
        Its name.
    values
        x y z [m]; or horizontal angle, elevation [rad] and distance [m]; or ECEF components [m].
    own, by_distance
        Sigmas as for :class:`SightRecord`, one for each value.
    height
        Of the target [m].
    off
        A reason for each value, "" if it is not switched off.
    covariance
        Upper half xx xy xz yy yz zz [m^2] of a baseline.
    line
        Of the file.
    """

    target: str
    values: tuple[float, float, float]
    own: tuple[float, float, float]
    by_distance: tuple[float, float, float]
    height: float
    off: tuple[str, str, str]
    covariance: tuple[float, ...]
    line: TextLine


@dataclass(frozen=True)
class FrameRecord:
    """A subframe or a set of baselines.

    Attributes
    ----------
    code
        11 Cartesian and 12 polar subframe, 19 baselines.
    origin
        Name of the point.
    levelled
        Its axis is vertical.
    height
        Of the antenna at the origin [m], baselines only.
    entries
        Its targets.
    line
        Of the file.
    """

    code: int
    origin: str
    levelled: bool
    height: float
    entries: tuple[FrameEntry, ...]
    line: TextLine


@dataclass(frozen=True)
class CircleRecord:
    """A target in one position of the turning body.

    Attributes
    ----------
    target
        Its name.
    point
        Name of the target in this position.
    sigma_radius, sigma_plane
        In metres, negative if switched off.
    line
        Of the file.
    """

    target: str
    point: str
    sigma_radius: float
    sigma_plane: float
    line: TextLine


@dataclass(frozen=True)
class AxisRecord:
    """A rotation axis.

    Attributes
    ----------
    origin
        Name of a point on it.
    circles
        Its targets.
    feet
        Points whose foot on the axis is the origin, with their lines.
    line
        Of the file.
    """

    origin: str
    circles: tuple[CircleRecord, ...]
    feet: tuple[tuple[str, TextLine], ...]
    line: TextLine


@dataclass(frozen=True)
class PairRecord:
    """A pair of points of an equality.

    Attributes
    ----------
    start, end
        Names of the points.
    sigma
        In metres, negative if switched off.
    line
        Of the file.
    """

    start: str
    end: str
    sigma: float
    line: TextLine


@dataclass(frozen=True)
class EqualRecord:
    """Pairs with one common height difference or distance.

    Attributes
    ----------
    code
        21 height difference, 22 distance.
    name
        Of the common value.
    pairs
        The pairs.
    line
        Of the file.
    """

    code: int
    name: str
    pairs: tuple[PairRecord, ...]
    line: TextLine


@dataclass
class Observed:
    """All observations of a project.

    Attributes
    ----------
    sights, frames, axes, equals
        The records.
    """

    sights: list[SightRecord] = field(default_factory=list)
    frames: list[FrameRecord] = field(default_factory=list)
    axes: list[AxisRecord] = field(default_factory=list)
    equals: list[EqualRecord] = field(default_factory=list)

    def without(self, names: set[str]) -> dict[str, list[str]]:
        """Drop what names some points.

        Parameters
        ----------
        names
            Of the points.

        Returns
        -------
        dict
            ``file:line`` of what was dropped, by point.
        """
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
