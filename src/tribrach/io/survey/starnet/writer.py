"""Writes networks of flat sites as data files of STAR*NET, for a local job.

Lengths are metres, angles degrees, minutes and seconds, coordinates north before east; every line
has its standard error. A job in space has curvature and refraction: the coefficient of each zenith
angle is written such that both together bend the sight as they do in the network, so that a network
without curvature has 0.5. Heights of rods in levelling, antennas over marks, known convergences and
scales are reduced. STAR*NET has no inner constraints and no correlations but those of vectors;
what has is named. Format: STAR*NET reference manual.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.site import FlatSite
from tribrach.io.survey.exported import Exported, Sieve, ValueCovariances, packed_seconds
from tribrach.io.survey.starnet.settings import REFRACTION_PER_UNIT, StarnetSettings
from tribrach.network.network import Network, axes_in_use
from tribrach.observations.base import Observations
from tribrach.observations.control import Coordinate, Coordinates, Heights
from tribrach.observations.gnss import GnssPositions
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
from tribrach.units import SEC

__all__ = ["write"]

_HEIGHTS = ("height_instrument", "height_target")
#: codes of sights with two or three stations, and the fields that are written or reduced
_CODES: dict[type[Observations], tuple[str, tuple[str, ...]]] = {
    Angles: ("A", _HEIGHTS),
    Azimuths: ("B", (*_HEIGHTS, "convergence")),
    SlopeDistances: ("D", _HEIGHTS),
    Distances: ("D", _HEIGHTS),
    HorizontalDistances: ("D", (*_HEIGHTS, "reduction")),
    ZenithAngles: ("V", (*_HEIGHTS, "refraction")),
}
#: kinds that are written behind the coordinates of their points
_GIVEN = (Coordinates, GnssPositions, Coordinate, Heights)
#: characters that may stand between the names of a line, the first that no name has is taken
_SEPARATORS = "-:;|~=,"
#: a name as one word of a line
_NAME = re.compile(r"[^\s#'‘’`.][^\s#]*$")
_CORRELATED = "correlated, which STAR*NET knows of vectors only"


def write(network: Network) -> Exported:
    """The network as the text of a data file.

    Parameters
    ----------
    network
        On a flat site.

    Returns
    -------
    Exported
        Text, and what STAR*NET cannot hold.

    Raises
    ------
    InputError
        The site is not flat, a name is no word, or nothing of the network can be written.
    """
    return _Writer(network).exported()


class _Writer:
    """A network on its way into a data file."""

    def __init__(self, network: Network) -> None:
        if not isinstance(network.site, FlatSite):
            raise InputError(
                "a job of STAR*NET on the ellipsoid is computed in a grid of its own, which is not "
                "written",
                cure="export it to dynaml",
            )
        self.network, self.sieve = network, Sieve(network)
        self.correlations = ValueCovariances(network)
        self.names = network.start.layout.names["point"]
        self.separator = _separator(self.names)
        axes = (o.observed_axes(vars(o)) for o in network.observations)
        used = axes_in_use(axes, network.site)
        self.plane, self.levels = not used[2], not used[0]
        self.written = 0
        count = len(self.names)
        self.free = network.free[: 3 * count].reshape(-1, 3)
        self.x = network.start.points.copy()
        #: what stands behind each coordinate E, N, U
        self.marks = [["*" if free else "!" for free in row] for row in self.free]

    def exported(self) -> Exported:
        """The whole file."""
        lines = list(self._observations())
        if not self.written:
            raise InputError(
                "STAR*NET can hold none of the observations of this network",
                cure="; ".join(self.sieve.sentences()) or "give a network with observations",
            )
        if self.network.datum.kind == "free":
            self.sieve.lost["datum", "inner constraints, which STAR*NET has not"] += 1
        head = [f"# {line}" for line in self.network.title.splitlines()]
        head += [f".{'2D' if self.plane else '3D'}", ".UNITS Meters DMS", ".ORDER NE AtFromTo"]
        if self.separator != "-":
            head.append(f".SEPARATOR {self.separator}")
        text = "\n".join([*head, "", *self._points(), "", *lines, ""])
        return Exported(text, self.written, self.sieve.sentences(), self.sieve.notes())

    def _points(self) -> Iterator[str]:
        """Coordinates with what is known of them: held, a standard error, or free."""
        for name, xyz, marks in zip(self.names, self.x, self.marks, strict=True):
            plan, height = np.isfinite(xyz[:2]).all(), np.isfinite(xyz[2])
            if self.levels or (height and not plan):
                if height:
                    yield f"E {name} {float(xyz[2])!r} {marks[2]}"
            elif plan:
                axes = (1, 0) if self.plane or not height else (1, 0, 2)
                words = [repr(float(xyz[axis])) for axis in axes] + [marks[axis] for axis in axes]
                yield " ".join(["C", name, *words])

    def _observations(self) -> Iterator[str]:
        """Lines of all observations; conditions are fixed observations."""
        for table, o in enumerate(self.network.observations):
            yield from self._of_kind(o, table)
        for constraint in self.network.constraints:
            yield from self._of_kind(constraint.observations, None)

    def _of_kind(self, o: Observations, table: int | None) -> Iterator[str]:
        """Lines of one table; ``table`` is None for conditions."""
        if isinstance(o, Directions):
            yield from self._directions(o, table)
        elif type(o) in _CODES:
            yield from self._sights(o, table)
        elif type(o) is HeightDifferences:
            held = ("height_start", "height_end", "geoid_start", "geoid_end")
            marks = o.values[:, 0] - o.height_end + o.height_start + o.geoid_end - o.geoid_start
            for i, sigma in self._rows(o, table, held):
                # the length weighs nothing where a standard error stands
                yield f"L {self._line(o.start[i], o.end[i])} {float(marks[i])!r} 1 {sigma}"
        elif table is not None and isinstance(o, _GIVEN):
            self._weigh(o, table)
        else:
            self.sieve.refuse_all(o, "STAR*NET has no such observations")

    def _rows(
        self, o: Observations, table: int | None, held: Sequence[str]
    ) -> Iterator[tuple[int, str]]:
        """Observations that are written, with their standard errors as words."""
        rows = self.sieve.rows(o, held)
        if table is not None:
            rows = self._alone(o, table, rows)
        unit = SEC if o.units[0] == "rad" else 1.0
        self.written += len(rows)
        for i in rows.tolist():
            if table is None:
                yield i, "!"
            else:
                variance = float(self.correlations.matrix([(table, i, 0)])[0, 0])
                yield i, repr(float(np.sqrt(variance)) / unit)

    def _alone(self, o: Observations, table: int, rows: Index) -> Index:
        """Of observations (k,) those that no covariance ties to others."""
        group = self.correlations.group
        tied = np.array([group((table, int(i), 0)) is not None for i in rows], dtype=bool)
        self.sieve.refuse(o, int(tied.sum()), _CORRELATED)
        alone: Index = rows[~tied]
        return alone

    def _directions(self, o: Directions, table: int | None) -> Iterator[str]:
        """Sets of directions."""
        sets: dict[tuple[int, int], list[str]] = {}
        for i, sigma in self._rows(o, table, ("orientation", *_HEIGHTS)):
            line = f"DN {self.names[o.end[i]]} {_angle(o.values[i, 0])} {sigma}"
            sets.setdefault((int(o.orientation[i]), int(o.start[i])), []).append(line)
        for (_, start), lines in sets.items():
            yield from (f"DB {self.names[start]}", *lines, "DE")

    def _sights(self, o: Observations, table: int | None) -> Iterator[str]:
        """Angles, bearings, distances and zenith angles."""
        code, held = _CODES[type(o)]
        values, bends = o.values[:, 0].copy(), np.zeros(len(o))
        factor = np.ones(len(o))
        level = isinstance(o, HorizontalDistances)
        if isinstance(o, ZenithAngles):
            bends = self._bends(o)
        elif isinstance(o, Azimuths):
            values += o.convergence
        elif isinstance(o, HorizontalDistances):
            values, factor = values / o.reduction, 1 / o.reduction
        if level and not self.plane:
            yield ".DELTA ON"
        bend: float | None = None
        for i, sigma in self._rows(o, table, held):
            if isinstance(o, ZenithAngles) and bends[i] != bend:
                bend = float(bends[i])
                yield f".REFRACTION {bend!r}"
            if factor[i] != 1.0 and sigma != "!":
                sigma = repr(float(sigma) * float(factor[i]))
            ends = [o.start[i], o.end[i]]  # type: ignore[attr-defined]
            if isinstance(o, Angles):
                ends.append(o.foresight[i])
            value = repr(float(values[i])) if o.units[0] == "m" else _angle(values[i])
            words = [code, self._line(*ends), value, sigma]
            if isinstance(o, ZenithAngles | SlopeDistances):
                heights = [float(getattr(o, name)[i]) for name in _HEIGHTS]
                words += ["/".join(map(repr, heights))] if any(heights) else []
            yield " ".join(words)
        if level and not self.plane:
            yield ".DELTA OFF"

    def _bends(self, o: ZenithAngles) -> Array:
        """Coefficients (n,) that bend sights over STAR*NET's Earth as the network does."""
        radius = self.network.site.curvature_radius
        straight = np.zeros(len(o)) if radius is None else (1 - o.refraction) / radius
        out: Array = (1 - straight * StarnetSettings().radius) / REFRACTION_PER_UNIT
        return out

    def _weigh(self, o: Observations, table: int) -> None:
        """Given coordinates become standard errors behind the coordinates of their points."""
        held = ("antenna_height",) if isinstance(o, GnssPositions) else ()
        for i in self._alone(o, table, self.sieve.rows(o, held)).tolist():
            point = int(o.position[i])  # type: ignore[attr-defined]
            axes = (0, 1, 2)
            if isinstance(o, Coordinate):
                axes = (int(o.axis[i]),)  # type: ignore[assignment]
            elif isinstance(o, Heights):
                axes = (2,)  # type: ignore[assignment]
            values = o.values[i].copy()
            covariance = self.correlations.matrix([(table, i, row) for row in range(len(values))])
            if isinstance(o, GnssPositions):
                values[2] -= o.antenna_height[i]
            if np.any(covariance - np.diag(np.diag(covariance))):
                self.sieve.refuse(o, 1, "with correlated coordinates")
            elif any(self.marks[point][axis] != "*" for axis in axes):
                self.sieve.refuse(o, 1, "of a coordinate that is given already")
            else:
                self.written += 1
                for k, axis in enumerate(axes):
                    self.x[point, axis] = values[k]
                    self.marks[point][axis] = repr(float(np.sqrt(covariance[k, k])))

    def _line(self, *ends: int) -> str:
        """Names of a line with the separator between them."""
        return self.separator.join(self.names[end] for end in ends)


def _separator(names: Sequence[str]) -> str:
    """A character that no name has; names are words.

    Raises
    ------
    InputError
        A name has blanks or begins a comment, or all characters are taken.
    """
    for name in names:
        if not _NAME.match(name):
            raise InputError(
                f"{name!r} is no name for STAR*NET", cure="give names without blanks, # and quotes"
            )
    whole = "".join(names)
    free = [character for character in _SEPARATORS if character not in whole]
    if not free:
        raise InputError(
            f"names have all of the characters {_SEPARATORS}, and one must stand between names",
            cure="rename points",
        )
    return free[0]


def _angle(value: float) -> str:
    """An angle [rad] in degrees, minutes and seconds."""
    degrees, minutes, seconds = packed_seconds(float(value % (2 * np.pi)), 10)
    return f"{degrees}-{minutes:02d}-{seconds[:2]}.{seconds[2:]}"
