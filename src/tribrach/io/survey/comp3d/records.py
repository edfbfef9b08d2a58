"""What Comp3D's observation files say, line by line, in metres and radians.

Plain observations are :class:`SightRecord`; observations that share unknowns come from files of
their own: subframes and baselines (:class:`FrameRecord`), rotation axes (:class:`AxisRecord`) and
equal distances or height differences (:class:`EqualRecord`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

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
    """One plain observation from ``start`` to ``end``.

    code 1 and 3 slope distance, 2 distance at the ellipsoid, 4 height difference, 5 and 7
    direction, 6 zenith angle, 8 azimuth, 14 and 15 offset in east and north. value [m, rad]; sigma
    = own [m, rad] and by_distance: times the distance [m] for lengths, over it for angles.

    Attributes
    ----------
    circle
        Name of the orientation unknown.
    off
        Why it is switched off, "" if it is not.
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
        """Standard deviation at a distance [m]."""
        if self.by_distance == 0:
            return self.own
        by_distance = self.by_distance
        return self.own + (by_distance / distance if self.angular else by_distance * distance)


@dataclass(frozen=True)
class FrameEntry:
    """One target of a subframe or baseline file.

    Attributes
    ----------
    values
        x y z [m]; or horizontal angle, elevation [rad] and distance [m]; or ECEF components [m].
    own, by_distance
        Sigmas as for :class:`SightRecord`, one for each value.
    covariance
        Upper half xx xy xz yy yz zz [m^2] of a baseline.
    off
        One reason for each value.
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
    """A subframe (code 11 Cartesian, 12 polar) or a set of baselines (19) at ``origin``.

    Attributes
    ----------
    height
        Of the antenna at the origin [m], baselines only.
    """

    code: int
    origin: str
    levelled: bool
    height: float
    entries: tuple[FrameEntry, ...]
    line: TextLine


@dataclass(frozen=True)
class CircleRecord:
    """``point`` is ``target`` in one position of the turning body; sigmas [m], negative is off."""

    target: str
    point: str
    sigma_radius: float
    sigma_plane: float
    line: TextLine


@dataclass(frozen=True)
class AxisRecord:
    """A rotation axis through ``origin``; feet: points whose foot on the axis is the origin."""

    origin: str
    circles: tuple[CircleRecord, ...]
    feet: tuple[tuple[str, TextLine], ...]
    line: TextLine


@dataclass(frozen=True)
class PairRecord:
    """A pair of points of an equality; sigma [m], negative is off."""

    start: str
    end: str
    sigma: float
    line: TextLine


@dataclass(frozen=True)
class EqualRecord:
    """Pairs with one common height difference (code 21) or distance (22)."""

    code: int
    name: str
    pairs: tuple[PairRecord, ...]
    line: TextLine


@dataclass
class Observed:
    """All observations of a project."""

    sights: list[SightRecord] = field(default_factory=list)
    frames: list[FrameRecord] = field(default_factory=list)
    axes: list[AxisRecord] = field(default_factory=list)
    equals: list[EqualRecord] = field(default_factory=list)

    def names(self, *, active: bool) -> set[str]:
        """Points of all active, or of all switched-off, observations."""
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
