"""Station coordinates of a SINEX file, with the covariance of all of them.

Blocks ``SOLUTION/ESTIMATE`` (STAX, STAY, STAZ, and VELX to VELZ if there are any) and
``SOLUTION/MATRIX_ESTIMATE`` (covariance, correlation or its inverse, either triangle). Format: IERS
SINEX 2.02. Sizes are bounded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.opened_files import contents, lines_of
from tribrach.units import too_large

#: files above this are refused
MAX_BYTES = 300_000_000
#: weights of coordinates [1/m^2] are below, and so is everything else in a matrix
_LARGEST_ELEMENT = 1e30
#: parameters of a solution; their matrix has 200 MB
MOST_PARAMETERS = 5000
#: parameters that are read
_KINDS = ("STAX", "STAY", "STAZ", "VELX", "VELY", "VELZ")


@dataclass(frozen=True)
class _Parameter:
    """One line of the estimate."""

    index: int
    kind: str
    station: str
    epoch: float
    value: float
    sigma: float
    line: int


def read_sinex(
    path: Path, *, chosen: Collection[str] = (), factor: float | None = None
) -> GnssRecords:
    """Positions with their joint covariance, and velocities if the file has them."""
    lines = _lines(path)
    parameters = [_parameter(path, n, line) for n, line in _block(path, lines, "SOLUTION/ESTIMATE")]
    if len(parameters) > MOST_PARAMETERS:
        raise InputError(
            f"the solution has {len(parameters)} parameters, more than {MOST_PARAMETERS}",
            file=path,
            cure="extract the stations that are needed",
        )
    by_name = {(p.station, p.kind): k for k, p in enumerate(parameters)}
    stations = list(dict.fromkeys(p.station for p in parameters if p.kind == "STAX"))
    if not stations:
        raise InputError("the file has no station coordinates", file=path)
    for name in chosen:
        if name not in stations:
            raise InputError(
                f"the file has no coordinates of station {name}",
                file=path,
                cure=f"choose among {', '.join(stations[:12])}" + ("…" if stations[12:] else ""),
            )
    stations = [name for name in stations if not chosen or name in chosen]
    places = _columns(path, by_name, stations, "STA", parameters)
    covariance = _covariance(path, lines, parameters) * (factor or 1.0) ** 2
    finite = np.isfinite(covariance).all() and all(np.isfinite(p.value) for p in parameters)
    if not finite:
        raise InputError("a value of the estimate or the matrix is not a number", file=path)
    wanted = [(p.station, p.kind) in by_name and p.kind in _KINDS for p in parameters]
    epochs = {parameters[k].epoch for k in places.ravel()}
    if max(epochs) - min(epochs) > 0.01:
        raise InputError(
            f"the coordinates are of several epochs ({min(epochs):.2f} to {max(epochs):.2f})",
            file=path,
            cure="give a solution of one reference epoch",
        )
    values = np.array([p.value for p in parameters])
    records = GnssRecords(
        positions=stations,
        xyz=values[places],
        covariance=covariance[np.ix_(places.ravel(), places.ravel())],
        epoch=epochs.pop(),
        position_sources=[f"{path.name}:{parameters[row[0]].line}" for row in places],
    )
    if _matrix_head(lines) is None:
        records.warnings.append(
            f"{path.name} has no covariance matrix: its coordinates are taken as uncorrelated, "
            "each with its own sigma; what they share (the frame, the reference station) then "
            "averages out in the result, which it does not in truth"
        )
    if any(p.kind == "VELX" for p, use in zip(parameters, wanted, strict=True) if use):
        speeds = _columns(path, by_name, stations, "VEL", parameters)
        both = np.concatenate([places.ravel(), speeds.ravel()])
        records.velocity = values[speeds]
        records.velocity_covariance = covariance[np.ix_(both, both)]
    if not (np.linalg.eigvalsh(records.covariance) > 0).all():
        raise InputError(
            "the covariance matrix of the coordinates is not positive definite",
            file=path,
            cure="give a solution with its constraints, not a free one",
        )
    return records


def _lines(path: Path) -> list[str]:
    """Lines of the file."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"the file has more than {MAX_BYTES / 1e6:.0f} MB", file=path)
        text = contents(path).decode("latin-1")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error
    if not text.startswith("%=SNX"):
        raise InputError("this is no SINEX file: it does not start with %=SNX", file=path)
    return lines_of(text)


def _block(path: Path, lines: list[str], name: str) -> Iterator[tuple[int, str]]:
    """Numbered lines of a block, without comments."""
    inside = False
    for number, line in enumerate(lines, start=1):
        if line.startswith("+") and line[1:].split()[:1] == [name]:
            inside = True
        elif line.startswith("-") and line[1:].split()[:1] == [name]:
            return
        elif inside and line.startswith(("+", "%")):
            raise InputError(f"the block {name} has no end", file=path, line=number)
        elif inside and line.strip() and not line.startswith("*"):
            yield number, line
    if inside:
        raise InputError(
            f"the block {name} has no end", file=path, cure="download or transfer it again"
        )


def _parameter(path: Path, number: int, line: str) -> _Parameter:
    """The parameter of one line of the estimate."""
    words = line.split()
    try:
        index, kind, station, _, _, epoch, _, _, *figures = words[:10]
        value, sigma = (float(word) for word in figures)
        if not np.isfinite([value, sigma]).all() or too_large([value, sigma]):
            raise ValueError("beyond any measurement")
        return _Parameter(int(index), kind, station, _year(epoch), value, sigma, number)
    except ValueError as error:
        raise InputError(
            "the line of the estimate is malformed",
            file=path,
            line=number,
            cure="it has index, type, code, point, solution, epoch, unit, constraint, value, sigma",
        ) from error


def _year(text: str) -> float:
    """Decimal year of ``yy:ddd:sssss``."""
    year, day, second = (int(word) for word in text.split(":"))
    if not (0 <= year <= 9999 and 0 <= day <= 366 and 0 <= second <= 86400):
        raise ValueError(f"{text} is no date")
    if year < 100:
        year += 1900 if year > 50 else 2000
    days = 366 if year % 4 == 0 and (year % 100 != 0 or year % 400 == 0) else 365
    return year + (max(day, 1) - 1 + second / 86400) / days


def _columns(
    path: Path,
    by_name: dict[tuple[str, str], int],
    stations: list[str],
    kind: str,
    parameters: list[_Parameter],
) -> NDArray[np.int64]:
    """Numbers (n, 3) of three parameters of each station; each must be there once."""
    counts = Counter((p.station, p.kind) for p in parameters)
    for station in stations:
        for axis in "XYZ":
            if (count := counts[station, kind + axis]) != 1:
                raise InputError(
                    f"station {station} has {count} parameters {kind}{axis} and needs one",
                    file=path,
                    cure="give a file with one solution for each station",
                )
    return np.array([[by_name[s, kind + axis] for axis in "XYZ"] for s in stations])


def _matrix_head(lines: list[str]) -> list[str] | None:
    """Words of the line that opens the matrix; None without a matrix."""
    name = "+SOLUTION/MATRIX_ESTIMATE"
    return next((line.split() for line in lines if line.startswith(name)), None)


def _covariance(path: Path, lines: list[str], parameters: list[_Parameter]) -> Array:
    """Covariance of all parameters in the order of the estimate; their sigmas if there is none."""
    sigma: Array = np.array([p.sigma for p in parameters])
    head = _matrix_head(lines)
    if head is None:
        return np.diag(sigma**2)
    kind = head[2].upper() if len(head) > 2 else "COVA"
    if kind not in ("COVA", "CORR", "INFO"):
        raise InputError(f"the matrix is of type {kind!r}, not COVA, CORR or INFO", file=path)
    place = {p.index: k for k, p in enumerate(parameters)}
    matrix = np.zeros((len(parameters), len(parameters)))
    for number, line in _block(path, lines, "SOLUTION/MATRIX_ESTIMATE"):
        words = line.split()
        try:
            row, column = place[int(words[0])], int(words[1])
            for k, word in enumerate(words[2:5]):
                other = place[column + k]
                matrix[row, other] = matrix[other, row] = value = float(word)
                if not abs(value) < _LARGEST_ELEMENT:
                    raise ValueError("beyond any matrix")
        except (KeyError, ValueError, IndexError) as error:
            raise InputError(
                "the line of the matrix is malformed",
                file=path,
                line=number,
                cure="it has row, column and one to three values",
            ) from error
    if kind == "CORR":
        roots: Array = matrix.diagonal().copy()
        np.fill_diagonal(matrix, 1.0)
        scaled: Array = roots[:, None] * matrix * roots
        return scaled
    if kind == "INFO":
        try:
            return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
        except np.linalg.LinAlgError as error:
            raise InputError("the information matrix is singular", file=path) from error
    return matrix
