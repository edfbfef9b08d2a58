"""Our own CSV files of observations and coordinates, as a survey.

What a file holds follows from its columns: sights (``from,to`` with any of direction, zenith,
slope or horizontal distance, angle, azimuth, height difference), vectors (``from,to`` with
``de_m,dn_m,du_m``), scanner targets (``station,target,x_m,y_m,z_m``), scanner polar observations
(``station,target,range_m,horizontal_deg,zenith_deg``), inclinations (``station`` with
``tilt_x_arcsec,tilt_y_arcsec``) and coordinates (``point,e_m,n_m,u_m``). Standard deviations stand
in ``sigma_`` columns or come from the instrument.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.survey.csv_header import Table, read_table
from tribrach.network.observations.angle import Angles
from tribrach.network.observations.azimuth import Azimuths
from tribrach.network.observations.base import Observations, Use
from tribrach.network.observations.coordinates import Coordinates
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.gnss_baseline import GnssBaselines
from tribrach.network.observations.gnss_position import GnssPositions
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.horizontal_distance import HorizontalDistances
from tribrach.network.observations.inclination import Inclinations
from tribrach.network.observations.polar import ScannerPolar
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.target_centre import TargetCentres
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey

__all__ = ["Sigmas", "read", "read_coordinates"]

Array = NDArray[np.float64]

#: kinds measured along a sight: column, class, sigma column
SIGHTS: tuple[tuple[str, type[Observations], str], ...] = (
    ("direction", Directions, "sigma_direction"),
    ("zenith", ZenithAngles, "sigma_zenith"),
    ("slope_distance", SlopeDistances, "sigma_slope_distance"),
    ("horizontal_distance", HorizontalDistances, "sigma_horizontal_distance"),
    ("angle", Angles, "sigma_angle"),
    ("azimuth", Azimuths, "sigma_azimuth"),
)
USES = {"": Use.ACTIVE, "on": Use.ACTIVE, "check": Use.CHECK, "off": Use.OFF}


@dataclass(frozen=True)
class Sigmas:
    """Standard deviations where a file gives none: metres, radians, and m/m for ``scale``.

    ``levelling`` is per square root of a kilometre. None asks for a sigma column.
    """

    direction: float | None = None
    zenith: float | None = None
    distance: float | None = None
    scale: float = 0.0
    levelling: float | None = None
    centring: float = 0.0
    height: float = 0.0
    target: float | None = None
    tilt: float | None = None
    refraction: float = 0.0


def read(path: Path, sigmas: Sigmas | None = None) -> Survey:
    """Observations of a CSV file.

    Raises
    ------
    InputError : the file and line of what is missing or wrong.
    """
    table = read_table(Path(path))
    reader = _Reader(table, sigmas or Sigmas())
    if table.has("station", "target", "range"):
        reader.polar()
    elif table.has("station", "target", "x", "y", "z"):
        reader.targets()
    elif table.has("station", "tilt_x", "tilt_y"):
        reader.inclinations()
    elif table.has("from", "to", "de", "dn", "du"):
        reader.vectors()
    elif table.has("point", "e", "n", "u", "sigma_e"):
        reader.positions()
    elif table.has("from", "to"):
        reader.sights()
    else:
        raise InputError(
            "the columns are those of no kind of observation",
            file=path,
            line=1,
            cure="name from and to, station and target, or point with e, n, u and their sigmas",
        )
    return reader.survey


class _Reader:
    def __init__(self, table: Table, sigmas: Sigmas) -> None:
        self.table = table
        self.sigmas = sigmas
        self.survey = Survey()
        self.sources = [table.source(k) for k in range(len(table))]
        words = table.words.get("use", [""] * len(table))
        for k, word in enumerate(words):
            if word.lower() not in USES:
                raise table.error(k, f"use is {word!r}", "write on, check or off")
        self.use = np.array([USES[w.lower()] for w in words], dtype=np.int8)
        default = ["switched off in the file" if u == Use.OFF else "" for u in self.use]
        given = table.words.get("reason", [""] * len(table))
        self.reason = np.array([a or b for a, b in zip(given, default, strict=True)], dtype=object)

    def names(self, column: str, rows: NDArray[np.int64]) -> list[str]:
        """A column of names; an empty cell is an error."""
        cells = self.table.words[column]
        for k in rows:
            if not cells[k]:
                raise self.table.error(int(k), f"{column} is empty", "give a name")
        return [cells[k] for k in rows]

    def add(self, kind: type[Observations], rows: NDArray[np.int64], **columns: Any) -> None:
        """Add rows of the file; complaints gain the file's name."""
        groups = self.table.words.get("group", [""] * len(self.table))
        for group in dict.fromkeys(groups[k] for k in rows):
            mine = np.array([groups[k] == group for k in rows])
            chosen = {n: _take(c, mine, len(rows)) for n, c in columns.items()}
            try:
                self.survey.add(
                    kind,
                    source=[self.sources[k] for k in rows[mine]],
                    use=self.use[rows[mine]],
                    reason=self.reason[rows[mine]],
                    group=group,
                    **chosen,
                )
            except InputError as error:
                raise _with_path(error, self.table.path) from error

    def sigma(
        self, column: str, rows: NDArray[np.int64], default: Callable[[], Array | None]
    ) -> Array:
        """Sigmas of rows: the column where filled, the instrument's otherwise."""
        given = self.table.numbers.get(column, np.full(len(self.table), np.nan))[rows]
        if np.isnan(given).any():
            fallback = default()
            if fallback is None:
                first = int(rows[np.flatnonzero(np.isnan(given))[0]])
                raise self.table.error(
                    first, f"there is no {column}", "add the column or name an instrument"
                )
            given = np.where(np.isnan(given), fallback, given)
        bad = np.flatnonzero(~(given > 0))
        if len(bad):
            raise self.table.error(
                int(rows[bad[0]]),
                f"{column} is {given[bad[0]]:g}",
                "give a standard deviation above zero",
            )
        return given

    def sights(self) -> None:
        """All values along the lines of sight of the file."""
        table, numbers = self.table, self.table.numbers
        found = False
        for quantity, kind, column in SIGHTS:
            if quantity in numbers:
                rows = np.flatnonzero(~np.isnan(numbers[quantity]))
                found = found or len(rows) > 0
                self._sight(kind, quantity, column, rows)
        if "height_difference" in numbers:
            rows = np.flatnonzero(~np.isnan(numbers["height_difference"]))
            found = found or len(rows) > 0
            self._levelling(rows)
        if not found:
            raise InputError("the file has no measured values", file=table.path)

    def _sight(
        self, kind: type[Observations], quantity: str, column: str, rows: NDArray[np.int64]
    ) -> None:
        numbers = self.table.numbers
        values = numbers[quantity][rows]
        start, end = self.names("from", rows), self.names("to", rows)
        columns: dict[str, Any] = {"start": start, "end": end}
        for height in ("height_instrument", "height_target"):
            if height in numbers:
                columns[height] = np.nan_to_num(numbers[height][rows])
        if kind is Directions:
            sets = self.table.words.get("set", [""] * len(self.table))
            columns["orientation"] = [
                f"orientation {a}" + (f" set {sets[k]}" if sets[k] else "")
                for a, k in zip(start, rows, strict=True)
            ]
        if kind is Angles:
            if "backsight" not in self.table.words:
                raise InputError("angles need a column backsight", file=self.table.path, line=1)
            columns["foresight"] = end
            columns["end"] = self.names("backsight", rows)
        if kind is ZenithAngles:
            columns["refraction"] = self.sigmas.refraction
        if "distance" in quantity:
            bad = np.flatnonzero(values <= 0)
            if len(bad):
                raise self.table.error(int(rows[bad[0]]), f"{quantity} is not above zero")
        sigma = self.sigma(column, rows, lambda: self._default(kind, values, rows))
        self.add(kind, rows, values=values, sigma=sigma, **columns)

    def _default(
        self, kind: type[Observations], values: Array, rows: NDArray[np.int64]
    ) -> Array | None:
        """The instrument's sigma with centring and height errors at the sight's length."""
        s = self.sigmas
        if kind in (SlopeDistances, HorizontalDistances):
            if s.distance is None:
                return None
            return np.hypot(s.distance + s.scale * values, s.centring)
        base = s.zenith if kind is ZenithAngles else s.direction
        if base is None:
            return None
        across = s.height if kind is ZenithAngles else s.centring
        lengths = self._lengths(rows)
        factor = np.sqrt(2) if kind is Angles else 1.0
        return np.hypot(factor * base, np.where(np.isnan(lengths), 0.0, across / lengths))

    def _lengths(self, rows: NDArray[np.int64]) -> Array:
        """Measured lengths of sights (n,), NaN where none stands in the row."""
        out = np.full(len(rows), np.nan)
        for name in ("slope_distance", "horizontal_distance"):
            if name in self.table.numbers:
                out = np.where(np.isnan(out), self.table.numbers[name][rows], out)
        return out

    def _levelling(self, rows: NDArray[np.int64]) -> None:
        numbers = self.table.numbers
        length = numbers.get("length", np.full(len(self.table), np.nan))[rows]

        def default() -> Array | None:
            if self.sigmas.levelling is None or np.isnan(length).any():
                return None
            return self.sigmas.levelling * np.sqrt(length / 1000)

        self.add(
            HeightDifferences,
            rows,
            values=numbers["height_difference"][rows],
            sigma=self.sigma("sigma_height_difference", rows, default),
            start=self.names("from", rows),
            end=self.names("to", rows),
        )

    def _all(self) -> NDArray[np.int64]:
        return np.arange(len(self.table))

    def vectors(self) -> None:
        """GNSS baselines in the work frame."""
        rows = self._all()
        values = self._triple(("de", "dn", "du"))
        ends = {"start": self.names("from", rows), "end": self.names("to", rows)}
        self.add(
            GnssBaselines,
            rows,
            values=values,
            **ends,
            covariance=self._covariance("de", "dn", "du"),
        )

    def positions(self) -> None:
        """GNSS positions in the work frame."""
        rows = self._all()
        height = self.table.numbers.get("antenna_height", np.zeros(len(rows)))
        self.add(
            GnssPositions,
            rows,
            values=self._triple(("e", "n", "u")),
            covariance=self._covariance("e", "n", "u"),
            position=self.names("point", rows),
            antenna_height=np.nan_to_num(height),
        )

    def targets(self) -> None:
        """Target centres in scanner frames."""
        rows = self._all()
        values = self._triple(("x", "y", "z"))
        stations = self.names("station", rows)
        self._stations(stations, rows)
        if self.table.has("sigma_range", "sigma_across"):
            along, across = (self.table.numbers[n] for n in ("sigma_range", "sigma_across"))
            beam = values / np.linalg.norm(values, axis=1, keepdims=True)
            outer = beam[:, :, None] * beam[:, None, :]
            covariance = (along**2)[:, None, None] * outer
            covariance = covariance + (across**2)[:, None, None] * (np.eye(3) - outer)
        else:
            covariance = self._covariance("x", "y", "z")
        target = self.names("target", rows)
        columns = {"station": stations, "target": target}
        self.add(TargetCentres, rows, values=values, covariance=covariance, **columns)

    def polar(self) -> None:
        """Scanner polar observations."""
        rows = self._all()
        values = self._triple(("range", "horizontal", "zenith"))
        stations = self.names("station", rows)
        self._stations(stations, rows)
        sigma = np.stack(
            [
                self.sigma("sigma_range", rows, lambda: _full(self.sigmas.distance, len(rows))),
                self.sigma(
                    "sigma_horizontal", rows, lambda: _full(self.sigmas.direction, len(rows))
                ),
                self.sigma("sigma_zenith", rows, lambda: _full(self.sigmas.zenith, len(rows))),
            ],
            axis=1,
        )
        face = self.table.numbers.get("face", np.ones(len(rows)))
        target = self.names("target", rows)
        columns = {"station": stations, "target": target, "face": face}
        self.add(ScannerPolar, rows, values=values, sigma=sigma, **columns)

    def inclinations(self) -> None:
        """Compensator or inclinometer readings of scanner stations."""
        rows = self._all()
        stations = self.names("station", rows)
        self._stations(stations, rows)
        values = np.stack([self.table.numbers[n] for n in ("tilt_x", "tilt_y")], axis=1)
        sigma = self.sigma("sigma_tilt", rows, lambda: _full(self.sigmas.tilt, len(rows)))
        self.add(Inclinations, rows, values=values, sigma=sigma[:, None], station=stations)

    def _stations(self, names: list[str], rows: NDArray[np.int64]) -> None:
        for name, row in zip(names, rows, strict=True):
            if name not in self.survey.stations:
                self.survey.station(name, source=self.sources[row])

    def _triple(self, names: tuple[str, str, str]) -> Array:
        values = np.stack([self.table.numbers[n] for n in names], axis=1)
        bad = np.flatnonzero(np.isnan(values).any(axis=1))
        if len(bad):
            raise self.table.error(int(bad[0]), f"one of {', '.join(names)} is empty")
        return values

    def _covariance(self, *names: str) -> Array:
        """Covariances (n, 3, 3) from six columns, three sigmas, or the default target sigma."""
        numbers, rows = self.table.numbers, self._all()
        if self.table.has("cxx", "cxy", "cxz", "cyy", "cyz", "czz"):
            c = {n: numbers[n] for n in ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")}
            flat = [c[n] for n in ("cxx", "cxy", "cxz", "cxy", "cyy", "cyz", "cxz", "cyz", "czz")]
            return np.stack(flat, axis=1).reshape(-1, 3, 3)
        default = _full(self.sigmas.target, len(rows))
        sigma = [self.sigma(f"sigma_{n}", rows, lambda: default) for n in names]
        return np.stack(sigma, axis=1)[:, :, None] ** 2 * np.eye(3)


def read_coordinates(path: Path, role: str) -> Survey:
    """Points of a CSV file with ``point,e_m,n_m,u_m``; heights or plan may be empty.

    role : ``control`` (weighted by its sigmas, fixed where there are none), ``fixed``,
        ``approximate`` or ``check``; a column ``role`` overrides it.

    Raises
    ------
    InputError : missing columns, a point given twice, a sigma that is not above zero.
    """
    table = read_table(Path(path))
    names = {"e": "e", "n": "n", "u": "u" if "u" in table.numbers else "height"}
    if not table.has("point", "e", "n"):
        raise InputError(
            "coordinates need the columns point, e and n", file=path, line=1,
            cure="name them point,e_m,n_m,u_m",
        )  # fmt: skip
    survey = Survey()
    empty = np.full(len(table), np.nan)
    xyz = np.stack([table.numbers.get(names[a], empty) for a in "enu"], axis=1)
    sigma = np.stack([table.numbers.get(f"sigma_{names[a]}", empty) for a in "enu"], axis=1)
    roles = table.words.get("role", [role] * len(table))
    for k, name in enumerate(table.words["point"]):
        mine = roles[k] or role
        if mine not in ("control", "fixed", "approximate", "check"):
            raise table.error(k, f"role is {mine!r}", "use control, fixed, approximate or check")
        if not name:
            raise table.error(k, "point is empty", "give a name")
        if (sigma[k] <= 0).any():
            raise table.error(k, f"a sigma of point {name} is not above zero")
        weighted = mine == "control" and np.isfinite(sigma[k]).all()
        held = np.isfinite(xyz[k]) & (mine in ("control", "fixed")) & (not weighted)
        try:
            survey.point(
                name,
                xyz[k],
                free=~held,
                role={"approximate": "free", "fixed": "control"}.get(mine, mine),
                covariance=np.diag(sigma[k] ** 2) if weighted else None,
                source=table.source(k),
            )
            if mine == "check":
                _held_out(survey, name, xyz[k], sigma[k], table.source(k))
        except InputError as error:
            raise _with_path(error, table.path) from error
    return survey


def _held_out(survey: Survey, name: str, xyz: Array, sigma: Array, source: str) -> None:
    """Coordinates that are compared and not used; without a sigma they count as 0.1 mm."""
    if np.isfinite(xyz).all():
        survey.add(
            Coordinates,
            values=[xyz],
            sigma=[np.where(np.isfinite(sigma), sigma, 1e-4)],
            position=[name],
            source=[source],
            use=[int(Use.CHECK)],
            group="check points",
        )


def _with_path(error: InputError, path: Path) -> InputError:
    """The error with the path as given instead of the file's name."""
    record = error.record or ""
    name, _, line = record.rpartition(":")
    if name == path.name and line.isdigit():
        return InputError(error.what, file=path, line=int(line), cure=error.cure)
    return InputError(error.what, file=path, record=error.record, cure=error.cure)


def _take(column: Any, mine: NDArray[np.bool_], n: int) -> Any:
    """Part of a column; single values stay as they are."""
    if isinstance(column, str) or np.ndim(column) == 0 or len(column) != n:
        return column
    if isinstance(column, list):
        return [c for c, keep in zip(column, mine, strict=True) if keep]
    return column[mine]


def _full(value: float | None, n: int) -> Array | None:
    return None if value is None else np.full(n, value)
