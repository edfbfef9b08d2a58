"""Collects what a reader finds, record by record, and turns it into columns."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.io.totalstation.records import Problem, RawFile, RawSights, Setups, StoredPoints
from tribrach.sentences import Sentence
from tribrach.units import GON, check_circle, circle_passed, too_large

NAN = math.nan
#: heights of the instrument that differ by less belong to one set-up [m]
SAME_HEIGHT = 5e-5
#: no instrument measures farther [m], or in air as hot or as cold as this [C]
FARTHEST, HOTTEST = 1e6, 150.0


@dataclass
class _Setup:
    """A set-up while the file is read."""

    station: str
    height: float
    backsight: str
    azimuth: float
    circle: float
    line: int

    def like(self, other: _Setup) -> bool:
        """True if another set-up is the same as far as the file says."""
        own = (self.height, self.azimuth, self.circle)
        others = (other.height, other.azimuth, other.circle)
        same = all(
            (math.isnan(a) and math.isnan(b)) or abs(a - b) < SAME_HEIGHT
            for a, b in zip(own, others, strict=True)
        )
        return same and (self.station, self.backsight) == (other.station, other.backsight)


class Recorder:
    """Collects one file's set-ups, sights, points; target height, prism, air hold until changed."""

    def __init__(self, path: Path, format: str) -> None:
        self.path, self.format = path, format
        self.instrument = ""
        self.target_height = NAN
        self.prism, self.ppm = NAN, NAN
        self.temperature_c, self.pressure_hpa, self.humidity_percent = NAN, NAN, NAN
        self.understood: Counter[str] = Counter()
        self.unknown: Counter[str] = Counter()
        self._setups: list[_Setup] = []
        self._used: list[bool] = []
        self._shots: list[tuple[Any, ...]] = []
        self._points: list[tuple[str, tuple[float, float, float], bool, str, int]] = []
        self._problems: list[Problem] = []
        self._notes: dict[str, None] = {}

    def setup(
        self,
        line: int,
        station: str,
        *,
        height: float = NAN,
        backsight: str = "",
        azimuth: float = NAN,
        circle: float = NAN,
        merge: bool = False,
    ) -> int:
        """Begin a set-up.

        ``height``: of the instrument [m]; ``azimuth``, ``circle``: of the backsight, as set and as
        read [rad]; ``merge``: go on with the current set-up if nothing differs.
        """
        new = _Setup(station, height, backsight, azimuth, circle, line)
        if not merge or not self._setups or not new.like(self._setups[-1]):
            self._setups.append(new)
            self._used.append(False)
        return len(self._setups) - 1

    def height_instrument(self, line: int, height: float) -> None:
        """Set the height of the set-up [m]; a new one begins if it has sights with another."""
        if not self._setups:
            self.setup(line, "", height=height)
            return
        current = self._setups[-1]
        if not math.isnan(current.height) and abs(current.height - height) < SAME_HEIGHT:
            return
        if self._used[-1] and not math.isnan(current.height):
            self.setup(line, current.station, height=height, backsight=current.backsight)
            return
        current.height = height

    def backsight(
        self, line: int, station: str, target: str, azimuth: float, circle: float
    ) -> None:
        """Set the backsight as set and as read [rad]; a set-up that has sights ends."""
        self.at_station(line, station)
        current = self._setups[-1]
        if self._used[-1]:
            self.setup(line, current.station, height=current.height)
            current = self._setups[-1]
        current.backsight, current.azimuth, current.circle = target, azimuth, circle

    def at_station(self, line: int, station: str) -> None:
        """Begin a set-up unless the current one is at this station."""
        if not self._setups or (station and self._setups[-1].station not in ("", station)):
            self.setup(line, station)
        elif station and not self._setups[-1].station:
            self._setups[-1].station = station

    def shot(
        self,
        line: int,
        target: str,
        *,
        direction: float = NAN,
        zenith: float = NAN,
        distance: float = NAN,
        face: int = 0,
        height: float = NAN,
        code: str = "",
        applied: bool = True,
        series: int = 0,
        off: str = "",
    ) -> None:
        """Add a sight of the current set-up.

        ``direction``, ``zenith``: as read [rad]; ``distance``: along the slope [m]; ``face``: 1 or
        2; 0 derives it from the zenith angle; ``height``: of the target [m]; NaN takes the current
        one; ``applied``: the distance contains the corrections for prism and air; ``series``:
        number of the set, 0 if not known; ``off``: why the sight is not used.
        """
        if not target:
            raise ValueError("the sight has no target")
        distance = NAN if distance == 0 else distance
        if all(math.isnan(x) for x in (direction, zenith, distance)):
            raise ValueError("the sight has no reading")
        if distance < 0 or distance > FARTHEST:
            raise ValueError(f"the distance is {distance:g} m")
        if not math.isnan(zenith) and not 0 <= zenith <= 2 * math.pi:
            raise ValueError(f"the zenith angle is {math.degrees(zenith):g} deg")
        if not abs(self.temperature_c) < HOTTEST and not math.isnan(self.temperature_c):
            raise ValueError(f"the temperature is {self.temperature_c:g} C")
        if any(map(too_large, (self.prism, self.ppm, self.temperature_c, self.pressure_hpa))):
            raise ValueError("prism constant, correction or air is beyond any measurement")
        check_circle(direction, turns=2)
        if circle_passed(direction):
            gon = direction / GON
            self.note(
                Sentence(
                    "line {line}: the direction of {gon:gong6} is more than a circle and counts as "
                    "{counts:gong6}: check that no digit is wrong",
                    line=line,
                    gon=gon * GON,
                    counts=(gon - math.copysign(400, gon)) * GON,
                )
            )
        if not self._setups:
            self.setup(line, "")
        self._used[-1] = True
        side = 2 if zenith > math.pi else 1
        target_height = self.target_height if math.isnan(height) else height
        air = (self.temperature_c, self.pressure_hpa, self.humidity_percent)
        self._shots.append(
            (len(self._setups) - 1, target, code, direction, zenith, distance, face or side,
             target_height, self.prism, self.ppm, applied, *air, series, off, line)
        )  # fmt: skip

    def point(
        self,
        line: int,
        name: str,
        e: float,
        n: float,
        u: float,
        *,
        given: bool = True,
        code: str = "",
    ) -> None:
        """Add coordinates of a point [m], ``given`` or computed by the instrument."""
        if not name:
            raise ValueError("the point has no name")
        self._points.append((name, (e, n, u), given, code, line))

    def problem(self, line: int, what: str) -> None:
        """Note a record of a known kind that cannot be used."""
        self._problems.append(Problem(line, what))

    def note(self, sentence: str) -> None:
        """Note an assumption, once."""
        self._notes[sentence] = None

    @property
    def current(self) -> int:
        """Index of the current set-up, -1 if there is none."""
        return len(self._setups) - 1

    @property
    def current_used(self) -> bool:
        """True if the current set-up has sights."""
        return bool(self._used) and self._used[-1]

    def finish(self) -> RawFile:
        """The file in columns."""
        self._add_backsights()
        if not self._shots and not self._points:
            first = f"; {self._problems[0].what}" if self._problems else ""
            raise InputError(
                f"no sight and no coordinates can be read from this {self.format} file{first}",
                file=self.path,
                line=self._problems[0].line if self._problems else None,
                cure="check that the file is complete",
            )
        unnamed = {int(s[0]) for s in self._shots if not self._setups[s[0]].station}
        if len(unnamed) == 1:
            self.note("One set-up has no station in the file and is named after it.")
        elif unnamed:
            self.note(f"{len(unnamed)} set-ups have no station in the file and are named after it.")
        return RawFile(
            self.path,
            self.format,
            self.instrument,
            self._setup_columns(),
            self._shot_columns(),
            self._point_columns(),
            dict(self.understood),
            dict(self.unknown),
            tuple(self._problems),
            tuple(self._notes),
        )

    def _add_backsights(self) -> None:
        """Add the pointings that set a circle, where no other sight goes to the backsight."""
        shown = {(s[0], s[1]) for s in self._shots if not s[15]}
        for j, setup in enumerate(self._setups):
            known = setup.backsight and not math.isnan(setup.circle)
            if self._used[j] and known and (j, setup.backsight) not in shown:
                self._shots.append(
                    (j, setup.backsight, "", setup.circle, NAN, NAN, 1, NAN, NAN, NAN, True, NAN,
                     NAN, NAN, 0, "", setup.line)
                )  # fmt: skip
                self.understood["backsight set without a sight"] += 1
        self._shots.sort(key=lambda s: (s[0], s[16]))

    def _setup_columns(self) -> Setups:
        rows = [
            (s.station, s.height, s.backsight, s.azimuth, s.circle, s.line) for s in self._setups
        ]
        station, height, backsight, azimuth, circle, line = _columns(rows, 6)
        return Setups(
            _words(station), _floats(height), _words(backsight), _floats(azimuth),
            _floats(circle), np.array(line, dtype=np.int64),
        )  # fmt: skip

    def _shot_columns(self) -> RawSights:
        c = _columns(self._shots, 17)
        return RawSights(
            np.array(c[0], dtype=np.int64), _words(c[1]), _words(c[2]), _floats(c[3]),
            _floats(c[4]), _floats(c[5]), np.array(c[6], dtype=np.int8), _floats(c[7]),
            _floats(c[8]), _floats(c[9]), np.array(c[10], dtype=bool), _floats(c[11]),
            _floats(c[12]), _floats(c[13]), np.array(c[14], dtype=np.int64), _words(c[15]),
            np.array(c[16], dtype=np.int64),
        )  # fmt: skip

    def _point_columns(self) -> StoredPoints:
        name, xyz, given, code, line = _columns(self._points, 5)
        return StoredPoints(
            _words(name),
            np.array(xyz, dtype=float).reshape(-1, 3),
            np.array(given, dtype=bool),
            _words(code),
            np.array(line, dtype=np.int64),
        )


def _columns(rows: list[Any], width: int) -> list[tuple[Any, ...]]:
    return list(zip(*rows, strict=True)) if rows else [()] * width


def _words(column: tuple[Any, ...]) -> Any:
    out = np.empty(len(column), dtype=object)
    out[:] = column
    return out


def _floats(column: tuple[Any, ...]) -> Any:
    return np.array(column, dtype=float)
