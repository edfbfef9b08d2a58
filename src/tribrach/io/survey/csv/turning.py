"""Targets on bodies that turn: on a telescope with two axes, or on circles about one axis.

A row says that a ``point`` of the network is a ``target`` of the body in one position of it. What
is measured to the points stands in other files.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.io.survey.csv.reader import Reader, located
from tribrach.observations.instrument_frames import AxisFeet, AxisPlanes, AxisRadii
from tribrach.observations.telescopes import CircleReadings, TelescopeTargets

#: angles of one position of a dish agree this well [rad]
_SAME = 1e-9
#: axes of the work frame by the word in the column ``along``
_MAIN = {"": 2, "up": 2, "east": 0, "north": 1}


def telescope_unknowns(name: str) -> dict[str, str]:
    """Names of the scalars of a telescope by the fields of its observations."""
    return {
        "tilt_east": f"tilt to the east of the azimuth axis of {name}",
        "tilt_north": f"tilt to the north of the azimuth axis of {name}",
        "axis_offset": f"axis offset of {name}",
        "axis_skew": f"non-orthogonality of the axes of {name}",
    }


class _Turning(Reader):
    """Readers of targets on bodies that turn."""

    def points(self) -> list[str]:
        """Points of the rows, each in one row only: the body has moved in between."""
        names = self.table.names("point", self.all)
        seen: dict[str, int] = {}
        for row, name in enumerate(names):
            if name in seen:
                raise self.table.error(
                    row,
                    f"point {name} stands in line {self.table.lines[seen[name]]} already",
                    "a target has a point of its own in each position of the body",
                )
            seen[name] = row
        return names


class TelescopeReader(_Turning):
    """Targets on a telescope: ``telescope, target, point`` with the angles of both axes.

    Rows of one position of the dish have one ``set``, or the same angles. Angles with a sigma are
    readings of the circles; without one they are near enough to start from.
    """

    def read(self) -> None:
        """All targets, and the readings of the circles once for each position of the dish."""
        telescopes = self.table.names("telescope", self.all)
        targets = self.table.names("target", self.all)
        angles = self.table.columns("azimuth", "elevation")
        places = self._places(telescopes, angles)
        sigma = self.sigma(("sigma",), self.all, lambda: None)
        columns = [telescope_unknowns(name) for name in telescopes]
        shared: dict[str, Any] = {
            key: [one[key] for one in columns] for key in telescope_unknowns("")
        }
        self.add(
            TelescopeTargets,
            self.all,
            values=np.zeros((len(self.all), 3)),
            sigma=np.repeat(sigma[:, None], 3, axis=1),
            reference=telescopes,
            point=self.points(),
            body=[f"{t} on {name}" for t, name in zip(targets, telescopes, strict=True)],
            azimuth=[f"azimuth of {place}" for place in places],
            elevation=[f"elevation of {place}" for place in places],
            **shared,
        )
        self._readings(telescopes, places, angles)

    def _places(self, telescopes: list[str], angles: Array) -> list[str]:
        """Position of the dish in words, of each row."""
        sets = self.table.words.get("set", [""] * len(self.all))
        degrees = np.degrees(angles)
        out = []
        first: dict[str, int] = {}
        for row, name in enumerate(telescopes):
            where = f"{degrees[row, 0]:.5f} {degrees[row, 1]:.5f} deg"
            place = f"{name}, {sets[row] or where} ({self.table.name})"
            begin = first.setdefault(place, row)
            if np.abs(angles[row] - angles[begin]).max() > _SAME:
                raise self.table.error(
                    row,
                    f"set {sets[row]} of {name} has other angles in line {self.table.lines[begin]}",
                    "give each position of the dish a set of its own",
                )
            out.append(place)
        return out

    def _readings(self, telescopes: list[str], places: list[str], angles: Array) -> None:
        """Angles of each position of the dish, observed where they have a sigma."""
        unique, first, number = np.unique(
            np.array(places, dtype=str), return_index=True, return_inverse=True
        )
        for axis, circle in enumerate(("azimuth", "elevation")):
            sigma = self.table.number(f"sigma_{circle}")
            differs = np.flatnonzero(~_same(sigma, sigma[first][number]))
            if len(differs):
                raise self.table.error(
                    int(differs[0]),
                    f"the rows of one position of the dish have several sigmas of the {circle}",
                    "give them one, or none",
                )
            read = np.isfinite(sigma[first])
            rows = first[read]
            # nothing but readings says where an elevation of zero is
            settled = {telescopes[row] for row in rows} if axis else set(telescopes)
            for place, row in zip(unique[~read], first[~read].tolist(), strict=True):
                free = telescopes[row] in settled
                settled.add(telescopes[row])
                self.survey.scalars[f"{circle} of {place}"] = (float(angles[row, axis]), free)
            if not len(rows):
                continue
            zeros = [f"zero of the azimuth circle of {telescopes[row]}" for row in rows]
            self.survey.add(
                CircleReadings,
                values=angles[rows, axis],
                sigma=sigma[rows],
                angle=[f"{circle} of {place}" for place in unique[read]],
                zero=[""] * len(rows) if axis else zeros,
                source=[str(self.sources[row]) for row in rows],
                group=f"{circle} circle",
            )


def _same(a: Array, b: Array) -> Mask:
    """Are the numbers the same, or both none?"""
    same: Mask = (a == b) | (np.isnan(a) & np.isnan(b))
    return same


class CircleReader(_Turning):
    """Targets that turn about one axis: ``axis, target, point``.

    The axis is named after a point of it, its origin: the foot of the point in the column ``foot``,
    or else the centre of its first target's circle.
    """

    def read(self) -> None:
        """All circles."""
        axes = self.table.names("axis", self.all)
        targets = self.table.names("target", self.all)
        main = self._main(axes)
        circles = [f"{t} about {axis}" for t, axis in zip(targets, axes, strict=True)]
        common: dict[str, Any] = {
            "origin": axes,
            "point": self.points(),
            "slope_1": [f"slope 1 of {axis}" for axis in axes],
            "slope_2": [f"slope 2 of {axis}" for axis in axes],
            "main": main,
            "along": [f"place of {circle}" for circle in circles],
        }
        zero = np.zeros(len(self.all))
        radius = [f"radius of {circle}" for circle in circles]
        sigma = self.sigma(("sigma_radius",), self.all, lambda: None)
        self.add(AxisRadii, self.all, values=zero, sigma=sigma, radius=radius, **common)
        sigma = self.sigma(("sigma_plane",), self.all, lambda: None)
        self.add(AxisPlanes, self.all, values=zero, sigma=sigma, **common)
        self._feet(axes, main, common["along"])

    def _main(self, axes: list[str]) -> Index:
        """Axis of W closest to each row's axis."""
        words = self.table.words.get("along", [""] * len(self.all))
        of: dict[str, str] = {}
        for row, (axis, word) in enumerate(zip(axes, words, strict=True)):
            if word.lower() not in _MAIN:
                raise self.table.error(row, f"along is {word!r}", "write up, east or north")
            if word:
                of[axis] = word.lower()
        return np.array([_MAIN[of.get(axis, "")] for axis in axes], dtype=np.int64)

    def _feet(self, axes: list[str], main: Index, along: list[str]) -> None:
        """Where the origin of each axis is on it."""
        words = self.table.words.get("foot", [""] * len(self.all))
        for axis in dict.fromkeys(axes):
            rows = [row for row, name in enumerate(axes) if name == axis]
            feet = dict.fromkeys(words[row] for row in rows if words[row])
            if len(feet) > 1:
                raise self.table.error(
                    rows[0], f"axis {axis} has the feet {', '.join(feet)}", "keep one of them"
                )
            if not feet:
                self.survey.scalars[along[rows[0]]] = (0.0, False)
                continue
            with located(self.table.path):
                self.survey.add(
                    AxisFeet,
                    values=[0.0],
                    hard=True,
                    origin=[axis],
                    point=list(feet),
                    slope_1=[f"slope 1 of {axis}"],
                    slope_2=[f"slope 2 of {axis}"],
                    main=main[rows[:1]],
                    source=[str(self.sources[rows[0]])],
                )
