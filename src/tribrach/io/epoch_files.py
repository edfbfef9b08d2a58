"""Adjusted coordinates of one epoch with their joint covariance, from files of several kinds.

An epoch file of this program, a result of GNU Gama (free networks too), a SINEX solution, or a
table of coordinates, with the covariance matrix of all of them in a second file. What has no joint
covariance is told so, or refused where it had one and did not write it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form, Matrix, Number, Result
from tribrach.epochs.differences import MOTIONS, Epoch
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.io import xml_file
from tribrach.io.gnss.sinex import read_sinex
from tribrach.io.json_file import read_json
from tribrach.io.opened_files import contents
from tribrach.io.point_list import PointList, read_point_list
from tribrach.io.survey.csv.matrix import CoordinateCovariance, read_matrix
from tribrach.io.survey.gama.adjusted import adjusted_coordinates
from tribrach.io.survey.gama.element import Element
from tribrach.io.survey.gama.reader import ADJUSTED
from tribrach.units import too_large

#: coordinates of an epoch; their covariance has 200 MB
_MOST = 5000
#: heads of tables of coordinates
_COORDINATES = {"e_m", "x_m", "u_m", "height_m", "easting_m", "ecef_x_m"}


@dataclass(frozen=True, eq=False)
class StoredEpoch:
    """An epoch from files."""

    epoch: Epoch  #: its coordinates in a local frame, E, N, U
    site: EllipsoidSite | FlatSite  #: where that frame lies; a flat one where that is not known
    sentences: tuple[str, ...] = ()  #: what is to be known of it


@dataclass(frozen=True)
class EpochSite(Result):
    """Where the frame of an epoch lies [rad, m]."""

    latitude: float
    longitude: float
    ellipsoidal_height: float
    ellipsoid: tuple[float, float]  #: semi-major axis and flattening


@dataclass(frozen=True, eq=False)
class EpochDocument(Result):
    """What ``tribrach adjust --epoch`` writes, for ``tribrach epochs``."""

    kind: Literal["epoch"]
    label: str
    datum: str
    site: EpochSite | None
    names: tuple[str, ...]
    xyz: Matrix  #: E, N, U [m]; null where the network has no such coordinate
    covariance: list[list[float]]  #: of all coordinates, a priori: rows of the lower triangle [m^2]
    #: motions of the whole that the observations leave open
    motions: tuple[str, ...]
    dof: int
    variance_factor: Number

    @classmethod
    def of(cls, epoch: Epoch, site: object, datum: str) -> EpochDocument:
        """An epoch as it is written."""
        place = None
        if isinstance(site, EllipsoidSite):
            origin = site.latitude, site.longitude, site.ellipsoidal_height
            place = EpochSite(*origin, site.ellipsoid)
        lower = [row[: k + 1].tolist() for k, row in enumerate(epoch.covariance)]
        return cls(
            "epoch", epoch.label, datum, place, epoch.names, epoch.xyz, lower, epoch.motions,
            epoch.dof, epoch.factor,
        )  # fmt: skip

    @property
    def epoch(self) -> Epoch:
        """The epoch again; a ValueError if this is none."""
        n = len(self.names)
        if 3 * n > _MOST or len(set(self.names)) != n or not n:
            raise ValueError("names")
        rows = self.covariance
        if len(rows) != 3 * n or any(len(row) != k + 1 for k, row in enumerate(rows)):
            raise ValueError("covariance")
        matrix = np.zeros((3 * n, 3 * n))
        for k, row in enumerate(rows):
            matrix[k, : k + 1] = matrix[: k + 1, k] = row
        if self.xyz.shape != (n, 3) or too_large(matrix) or too_large(np.nan_to_num(self.xyz)):
            raise ValueError("numbers")
        if any(m not in MOTIONS for m in self.motions):
            raise ValueError("motions")
        factor = self.variance_factor
        return Epoch(
            self.label, self.names, self.xyz, matrix, self.motions, max(self.dof, 0), factor
        )


FORM = Form("epoch", EpochDocument, 1, quick=True)


def read_epoch(files: Sequence[Path]) -> StoredEpoch | None:
    """Coordinates of an epoch with their covariance; None for files that are a network."""
    for path in files:
        if not path.is_file():
            raise InputError("there is no such file", file=path, cure="check the path")
    first, *others = files
    suffix = first.suffix.lower()
    if suffix == ".json":
        _alone(first, others)
        return _of_json(first)
    if suffix == ".snx":
        _alone(first, others)
        return _of_sinex(first)
    if suffix == ".xml" and b"gama-local-adjustment" in contents(first, 4000):
        _alone(first, others)
        return _of_gama(first)
    if suffix == ".csv":
        return _of_tables(files)
    return None


def _alone(path: Path, others: Sequence[Path]) -> None:
    if others:
        raise InputError(
            f"{path.name} is an epoch by itself", file=others[0], cure="leave this file out"
        )


def _of_json(path: Path) -> StoredEpoch:
    cure = "give the file that tribrach adjust --epoch wrote"
    try:
        data = read_json(path)
        if "sigma0" in data and "points" in data:
            raise InputError(
                "a result has the covariance of each point, and none between them, without which "
                "epochs cannot be compared",
                file=path,
                cure="give the project or the survey files themselves, or the epoch file that "
                "tribrach adjust --epoch writes, or a run with output.epoch = true",
            )
        if data["kind"] != "epoch" or data["schema"] != FORM.schema:
            raise InputError("this is no epoch of this version", file=path, cure=cure)
        document = FORM.read(data)
        epoch, place = document.epoch, document.site
    except (ValueError, TypeError, KeyError) as error:
        raise InputError("this is no epoch", file=path, cure=cure) from error
    _proper(epoch.covariance, path)
    return StoredEpoch(epoch, FlatSite() if place is None else EllipsoidSite(**vars(place)))


def _of_sinex(path: Path) -> StoredEpoch:
    records = read_sinex(path)
    names, ecef = tuple(records.positions), np.asarray(records.xyz)
    if 3 * len(names) > _MOST:
        raise InputError(f"{len(names)} stations are too many", file=path, cure="extract some")
    if len(set(names)) != len(names):
        raise InputError("a station is there twice", file=path, cure="keep one solution of each")
    site = EllipsoidSite.centred(ecef)
    turn = np.kron(np.eye(len(names)), site.w_from_ecef)
    covariance = turn @ np.asarray(records.covariance) @ turn.T
    epoch = Epoch(path.stem, names, site.from_ecef(ecef), covariance)
    return StoredEpoch(epoch, site, tuple(records.warnings))


def _of_gama(path: Path) -> StoredEpoch:
    with RefusalCollector() as refused:
        root = Element(xml_file.load(path, *ADJUSTED), path, path.name, refused)
        found = adjusted_coordinates(root)
        refused.settle()
    names = tuple(dict.fromkeys([*found.fixed, *found.names]))
    if 3 * len(names) > _MOST:
        raise InputError(f"{len(names)} points are too many", file=path, cure="leave some out")
    place = {name: k for k, name in enumerate(names)}
    xyz = np.full((len(names), 3), np.nan)
    for name, held in found.fixed.items():
        xyz[place[name]] = held
    rows = np.array([place[n] for n in found.names], dtype=np.int64)
    xyz[rows, found.axis] = found.values
    covariance = np.zeros((3 * len(names), 3 * len(names)))
    columns = 3 * rows + found.axis
    covariance[np.ix_(columns, columns)] = found.covariance
    if found.used.startswith("apost") and found.factor > 0:
        covariance /= found.factor
    _proper(covariance, path)
    epoch = Epoch(
        path.stem,
        names,
        xyz,
        covariance,
        _open_motions(xyz, covariance, path),
        found.dof,
        found.factor,
    )
    return StoredEpoch(epoch, FlatSite())


def _open_motions(xyz: Array, covariance: Array, path: Path) -> tuple[str, ...]:
    """Motions that a singular covariance leaves without variance: those of a free network.

    Inner constraints over all points leave ``Q G = 0``; over some of them which ones is not
    known, and such a matrix is refused where no motion explains its defect.
    """
    from tribrach.epochs.differences import motion_columns

    axes = [k for k in range(3) if np.isfinite(xyz[:, k]).any()]
    known = np.flatnonzero(np.isfinite(xyz[:, axes]).all(axis=1))
    rows = (known[:, None] * 3 + np.array(axes)).ravel()
    matrix = covariance[np.ix_(rows, rows)]
    alive = np.diag(matrix) > 0
    if not alive.any():
        return ()
    sigma = np.sqrt(np.where(alive, np.diag(matrix), 1.0))
    value = np.linalg.eigvalsh((matrix / np.outer(sigma, sigma))[np.ix_(alive, alive)])
    defect = int((value < 1e-7).sum())
    if not defect or not alive.all():
        return ()
    found = []
    for motion in MOTIONS:
        column = motion_columns(xyz[known], axes, [motion])
        if column.shape[1]:
            variance = float(column[:, 0] @ matrix @ column[:, 0])
            if variance < 1e-6 * float(column[:, 0] ** 2 @ np.diag(matrix)):
                found.append(motion)
    if len(found) < defect:
        raise InputError(
            f"the covariance matrix is singular in {defect} directions, of which motions of all "
            f"points explain {len(found)}",
            file=path,
            cure="let all points carry the inner constraints, or give the network itself",
        )
    return tuple(found)


def _of_tables(files: Sequence[Path]) -> StoredEpoch | None:
    """A table of coordinates, with its matrix if there is a second file."""
    matrices = [path for path in files if contents(path, 64).lower().startswith(b"covariance_m")]
    tables = [path for path in files if path not in matrices]
    if len(tables) != 1 or len(matrices) > 1:
        return None
    head = contents(tables[0], 4000).decode("utf-8", "replace").splitlines()[:1]
    columns = {cell.strip().lower() for cell in (head[0] if head else "").split(",")}
    if not columns & _COORDINATES or "from" in columns:
        return None  # a table of observations
    points = read_point_list(tables[0], heights=True)
    n = len(points.names)
    if 3 * n > _MOST:
        raise InputError(f"{n} points are too many", file=tables[0], cure="leave some out")
    xyz = np.full((n, 3), np.nan)
    xyz[:, points.axes] = points.xyz
    ecef = points.titles[0].startswith("ecef")
    sentences: tuple[str, ...] = ()
    if matrices:
        covariance = _of_matrix(points, read_matrix(matrices[0]))
    elif points.covariance is None:
        raise InputError(
            "the coordinates have no covariance, without which nothing can be tested",
            file=tables[0],
            cure="give sigmas in columns, or the covariance matrix as a second file: "
            f"{tables[0].name}+matrix.csv",
        )
    else:
        covariance = np.zeros((3 * n, 3 * n))
        place = 3 * np.arange(n)[:, None] + np.array(points.axes)
        covariance[place[:, :, None], place[:, None, :]] = points.covariance
        sentences = (
            f"{tables[0].name} has no covariances between points: they are taken as uncorrelated, "
            "which those of a network are not",
        )
    site: EllipsoidSite | FlatSite = FlatSite()
    if ecef:
        site = EllipsoidSite.centred(xyz)
        turn = np.kron(np.eye(n), site.w_from_ecef)
        xyz, covariance = site.from_ecef(xyz), turn @ covariance @ turn.T
    _proper(covariance, tables[0])
    return StoredEpoch(Epoch(tables[0].stem, points.names, xyz, covariance), site, sentences)


def _of_matrix(points: PointList, given: CoordinateCovariance) -> Array:
    """The matrix in the order of the points."""
    place = {name: k for k, name in enumerate(points.names)}
    known = [
        (i, 3 * place[name] + axis) for i, (name, axis) in enumerate(given.keys) if name in place
    ]
    n = len(points.names)
    covered = {column for _, column in known}
    missing = [
        name
        for name, k in place.items()
        if any(3 * k + axis not in covered for axis in points.axes)
    ]
    if missing:
        raise InputError(
            f"the matrix has no rows for all coordinates of {missing[0]}",
            file=given.path,
            cure="give a row and a column for every coordinate",
        )
    out = np.zeros((3 * n, 3 * n))
    i, columns = (np.array(part, dtype=np.int64) for part in zip(*known, strict=True))
    out[np.ix_(columns, columns)] = given.matrix[np.ix_(i, i)]
    return out


def _proper(covariance: Array, path: Path) -> None:
    """Refuse a matrix that is not a covariance."""
    variance = np.diag(covariance)
    good = np.isfinite(covariance).all() and bool((variance >= 0).all())
    if good and variance.any():
        sigma = np.sqrt(np.where(variance > 0, variance, 1.0))
        good = bool(np.linalg.eigvalsh(covariance / np.outer(sigma, sigma))[0] > -1e-6)
    if not good:
        raise InputError(
            "the covariance matrix has a negative variance", file=path, cure="check its rows"
        )
