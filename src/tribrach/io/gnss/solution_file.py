"""Files that RTKLIB writes: solutions (``.pos``), epoch by epoch, and the status beside them.

**Solutions** hold positions or baselines. The three columns after the standard deviations are
*signed roots* of covariances: ``sdne = -0.002`` says that the covariance is ``-(0.002)^2``. Their
order is xy, yz, zx for geocentric coordinates, ne, eu, un for latitude, longitude and height, en,
nu, ue for baselines (RTKLIB 2.4.3 manual, appendix B.1).

**Status files** have a line for each satellite, frequency and epoch: ``$SAT,week,
seconds,satellite,frequency,azimuth,elevation,code residual,phase residual,valid,...`` (appendix
B.2). They tell which satellites were used: the engine leaves some out that the files hold, for
their health or a bad accuracy index.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import ecef_from_geodetic, enu_rotation
from tribrach.io.opened_files import contents, lines_of
from tribrach.units import LARGEST, too_large

Kind = Literal["ecef", "geodetic", "baseline"]

#: quality of an epoch: ambiguities are integers, or real numbers
FIXED, FLOAT = 1, 2
#: files above this are refused
MAX_BYTES = 500_000_000
#: half of the last decimal of the standard deviations [m]
ROUNDING = 5e-5
_WGS84 = (6378137.0, 1 / 298.257223563)
_STAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d*)?")
_GPS_START = np.datetime64("1980-01-06T00:00:00", "us")
#: a line of the status file with valid phases: week, seconds, satellite, frequency, azimuth,
#: elevation and residual
_LINE = re.compile(
    rb"^\$SAT,(\d+),([\d.]+),([A-Z]\d\d),(\d),([-\d.]+),([-\d.]+),[-\d.]+,([-\d.]+),1,", re.M
)
_WEEK = 604_800.0


@dataclass(frozen=True, eq=False)
class PhaseResiduals:
    """n phases that the engine used, one for each satellite, frequency and epoch."""

    times: Array  #: (n,), seconds since 1980-01-06
    satellites: NDArray[np.str_]  #: (n,), names
    frequencies: NDArray[np.int64]  #: (n,), numbers from 1 on
    #: (n,), of the satellites [rad], to 0.1 degrees
    azimuth: Array
    elevation: Array
    #: (n,), of the double differences, reference satellite minus this one [m]; 0 for the reference
    residuals: Array


@dataclass(frozen=True)
class SatelliteUse:
    """The satellites that a run of the engine used."""

    satellites: tuple[str, ...]  #: their names
    residual: float | None  #: root mean square of their phase residuals [m], None if there are none
    phases: PhaseResiduals | None = None  #: all residuals, None if there are none

    @property
    def systems(self) -> str:
        """Letters of the systems."""
        return "".join(dict.fromkeys(name[0] for name in self.satellites))


def read_status(path: Path) -> SatelliteUse | None:
    """What a status file says; None where the engine wrote none."""
    if not path.is_file():
        return None
    lines = _LINE.findall(path.read_bytes())
    if not lines:
        return None
    week, seconds, names, frequency, azimuth, elevation, words = zip(*lines, strict=True)
    residuals = np.array(words, dtype=float)
    # the reference satellite of the double differences has none
    others = residuals[residuals != 0]
    rms = float(np.sqrt((others**2).mean())) if len(others) else None
    phases = PhaseResiduals(
        np.array(week, dtype=float) * _WEEK + np.array(seconds, dtype=float),
        np.array(names).astype(str),
        np.array(frequency).astype(np.int64),
        np.radians(np.array(azimuth, dtype=float)),
        np.radians(np.array(elevation, dtype=float)),
        residuals,
    )
    return SatelliteUse(tuple(np.unique(phases.satellites).tolist()), rms, phases)


@dataclass(frozen=True)
class Solution:
    """n epochs of a solution."""

    #: what ``values`` are: ``baseline``, or a position, which is ECEF whatever the file has
    kind: Kind
    values: Array  #: (n, 3), ECEF positions [m], or E, N, U of the baseline [m]
    covariance: Array  #: (n, 3, 3), along the same axes [m^2]
    times: Array  #: (n,), seconds since 1980-01-06
    quality: NDArray[np.int64]  #: (n,), 1 fixed, 2 float, 4 code differences, 5 single
    satellites: NDArray[np.int64]  #: (n,), how many
    ratio: Array  #: (n,), of the ambiguity test
    #: (3,), ECEF coordinates of the base [m], NaN if the header does not give them
    reference: Array
    lines: NDArray[np.int64]  #: (n,), of the file
    static: bool = False  #: the header says that the receiver did not move

    def __len__(self) -> int:
        return len(self.values)


def read_solution(path: Path) -> Solution:
    """All epochs of a ``.pos`` file; geodetic positions are converted to ECEF."""
    text = _text(path)
    kind = _kind(path, text)
    rows, lines = [], []
    for number, line in enumerate(lines_of(text), start=1):
        if line.strip() and not line.startswith(("%", "+")):
            rows.append(line)
            lines.append(number)
    if not rows:
        nothing = np.zeros((0, 3))
        count = np.zeros(0, dtype=np.int64)
        return Solution(
            kind, nothing, np.zeros((0, 3, 3)), np.zeros(0), count, count, np.zeros(0),
            _reference(text), count, _is_static(text),
        )  # fmt: skip
    where = np.array(lines)
    times, table = _table(path, rows, where)
    values, covariance = _covariances(kind, table)
    spectrum, vectors = np.linalg.eigh(covariance)
    rounding = ROUNDING**2 + 4 * ROUNDING * np.sqrt(np.maximum(spectrum.sum(axis=1), 0))
    bad = np.flatnonzero(~(spectrum[:, 0] > -rounding))
    if len(bad):
        raise InputError(
            "the standard deviations and covariances are no covariance matrix",
            file=path,
            line=int(where[bad[0]]),
            cure="the last three are signed roots: keep them as RTKLIB wrote them",
        )
    # four decimals of the roots let small eigenvalues fall below zero
    whole = np.maximum(spectrum, ROUNDING**2)
    covariance = np.einsum("nij,nj,nkj->nik", vectors, whole, vectors)
    quality, satellites = (table[:, k].astype(np.int64) for k in (3, 4))
    return Solution(
        kind, values, covariance, times, quality, satellites, table[:, 12], _reference(text), where,
        _is_static(text),
    )  # fmt: skip


def _text(path: Path) -> str:
    """Text of the file."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"the file has more than {MAX_BYTES / 1e6:.0f} MB", file=path)
        return contents(path).decode("latin-1")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error


def _kind(path: Path, text: str) -> Kind:
    """The kind of solution that the header announces."""
    head = "\n".join(line for line in lines_of(text[:20000]) if line.startswith("%")).lower()
    for sign, kind in (("x-ecef", "ecef"), ("e-baseline", "baseline"), ("latitude", "geodetic")):
        if sign in head:
            if kind == "geodetic" and "latitude(d'" in head:
                raise InputError(
                    "latitudes in degrees, minutes and seconds are not read",
                    file=path,
                    cure="let RTKLIB write decimal degrees or x/y/z",
                )
            return kind  # type: ignore[return-value]
    raise InputError(
        "this is no solution file of RTKLIB with its header",
        file=path,
        cure="let RTKLIB write the header with the column names",
    )


def _table(path: Path, rows: list[str], lines: NDArray[np.int64]) -> tuple[Array, Array]:
    """Times (n,) and the thirteen numbers after them (n, 13)."""
    joined = "\n".join(rows).replace(",", " ")
    clock = re.match(r"\s*\d{4}/\d\d/\d\d\s", joined) is not None
    try:
        if clock:
            words = [row.split(None, 2) for row in lines_of(joined)]
            stamps = [f"{day.replace('/', '-')}T{hour}" for day, hour, _ in words]
            odd = next((k for k, stamp in enumerate(stamps) if not _STAMP.fullmatch(stamp)), None)
            if odd is not None:
                raise ValueError(f"no time in row {odd + 1}")
            since = np.array(stamps, dtype="datetime64[us]") - _GPS_START
            times = since.astype(np.int64) / 1e6
            body = "\n".join(rest for _, _, rest in words)
            table = _numbers(body, 13)
        else:
            whole = _numbers(joined, 15)
            times, table = whole[:, 0] * 604800 + whole[:, 1], whole[:, 2:]
    except (ValueError, IndexError) as error:
        place = re.search(r"row (\d+)", str(error))
        row = int(place.group(1)) if place else 0
        raise InputError(
            "the line has no time and thirteen numbers",
            file=path,
            line=int(lines[min(max(row - 1, 0), len(lines) - 1)]),
            cure="keep the file as RTKLIB wrote it",
        ) from error
    if not np.isfinite(table).all():
        row = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
        raise InputError("a value is not a number", file=path, line=int(lines[row]))
    if too_large(table):
        row = int(np.argmax((np.abs(table) >= LARGEST).any(axis=1)))
        raise InputError("a value is beyond any measurement", file=path, line=int(lines[row]))
    return times, table


def _numbers(text: str, columns: int) -> Array:
    """The first columns of lines of numbers (n, columns)."""
    if not text.strip():
        raise ValueError("row 1: nothing")
    table: Array = np.loadtxt(io.StringIO(text), ndmin=2, usecols=range(columns), comments=None)
    return table


def _covariances(kind: Kind, table: Array) -> tuple[Array, Array]:
    """Values (n, 3) and covariances (n, 3, 3): ECEF, or E, N, U of baselines."""
    signed = table[:, 8:11]
    off = np.sign(signed) * signed**2
    sigma = table[:, 5:8]
    covariance = np.zeros((len(table), 3, 3))
    covariance[:, range(3), range(3)] = sigma**2
    for (i, j), column in zip(((0, 1), (1, 2), (2, 0)), off.T, strict=True):
        covariance[:, i, j] = covariance[:, j, i] = column
    if kind != "geodetic":
        return table[:, :3], covariance
    # sigmas in the order north, east, up; covariances ne, eu, un
    order = [1, 0, 2]
    covariance = covariance[:, order][:, :, order]
    latitude, longitude = np.radians(table[:, :2]).T
    axes = enu_rotation(latitude, longitude)
    ecef = ecef_from_geodetic(latitude, longitude, table[:, 2], _WGS84)
    return ecef, axes.transpose(0, 2, 1) @ covariance @ axes


def _is_static(text: str) -> bool:
    """True if the header says that the receiver did not move."""
    head = text[:20000].lower()
    mode = [line.partition(":")[2] for line in lines_of(head) if line.startswith("% pos mode")]
    return bool(mode) and "static" in mode[0]


def _reference(text: str) -> Array:
    """ECEF (3,) [m] of the base from the header, NaN if it is not there."""
    line = re.search(r"^%\s*ref pos\s*:\s*(\S+)\s+(\S+)\s+(\S+)", text[:20000], re.M)
    if line is None:
        return np.full(3, np.nan)
    try:
        numbers = np.array([float(word) for word in line.groups()])
    except ValueError:
        return np.full(3, np.nan)
    if not np.isfinite(numbers).all() or too_large(numbers):
        return np.full(3, np.nan)
    if np.abs(numbers[:2]).max() <= 360:  # latitude, longitude, height
        latitude, longitude = np.radians(numbers[:2])
        return ecef_from_geodetic(latitude, longitude, numbers[2], _WGS84)
    return numbers
