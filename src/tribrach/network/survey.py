"""What was measured, by name: the common ground of all readers.

A reader fills a :class:`Survey`; several surveys merge; :meth:`Survey.network` turns names into
indices and gives the :class:`~tribrach.network.network.Network`. Points that are observed but
not given coordinates become free points whose start values are found from the observations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach.errors import InputError
from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.network import Constraint, Datum, JointCovariance, Network
from tribrach.network.observations.base import Array, Observations, covariance_from_sigma
from tribrach.network.survey_given import GivenPoint, GivenStation, control_observations
from tribrach.network.survey_indices import concatenate, layout_of
from tribrach.network.survey_table import (
    LARGEST,
    Table,
    as_column,
    check_covariance,
    check_heights,
    check_sigmas,
    check_values,
)
from tribrach.network.unknowns import FAMILIES, Layout, State

__all__ = ["Survey"]

#: kinds that refer to a scanner station and place it in the frame
_PLACING = ("antenna", "mounted_point")


@dataclass
class Survey:
    """Points, stations and observations by name."""

    site: Site = field(default_factory=FlatSite)
    points: dict[str, GivenPoint] = field(default_factory=dict)
    stations: dict[str, GivenStation] = field(default_factory=dict)
    planes: dict[str, tuple[Array, float]] = field(default_factory=dict)
    vectors: dict[str, tuple[Array, bool | NDArray[np.bool_]]] = field(default_factory=dict)
    scalars: dict[str, tuple[float, bool]] = field(default_factory=dict)
    datum: Datum = field(default_factory=Datum)
    sigma0: float = 1.0
    warnings: list[str] = field(default_factory=list)
    info: dict[str, Any] = field(default_factory=dict)
    _tables: list[Table] = field(default_factory=list)
    _joint: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Array]] = field(
        default_factory=list
    )

    def point(
        self,
        name: str,
        xyz: ArrayLike = (np.nan, np.nan, np.nan),
        *,
        free: ArrayLike = (True, True, True),
        role: str = "free",
        covariance: ArrayLike | None = None,
        datum: ArrayLike | None = None,
        source: str = "",
    ) -> None:
        """Add a point; a second definition of the same name is an error.

        Raises
        ------
        InputError : duplicate name, impossible coordinates, covariance not positive definite.
        """
        if name in self.points or name in self.stations:
            other = (self.points.get(name) or self.stations[name]).source
            raise InputError(
                f"point {name} is defined twice" + (f" (first at {other})" if other else ""),
                record=source or None,
                cure="keep one definition",
            )
        coordinates = np.asarray(xyz, dtype=float)
        if (np.abs(coordinates) >= LARGEST).any():
            raise InputError(
                f"point {name} has a coordinate of {np.nanmax(np.abs(coordinates)):.3g} m",
                record=source or None,
                cure="give coordinates in metres",
            )
        matrix = None if covariance is None else np.asarray(covariance, dtype=float)
        if matrix is not None:
            check_covariance(matrix[None], [source], f"point {name}")
        mask = None if datum is None else np.asarray(datum, dtype=bool)
        self.points[name] = GivenPoint(
            coordinates, np.asarray(free, dtype=bool), role, matrix, mask, source
        )

    def station(
        self,
        name: str,
        *,
        translation: ArrayLike = (np.nan, np.nan, np.nan),
        rotation: ArrayLike | None = None,
        free: ArrayLike = (True, True, True, True, True, True),
        source: str = "",
    ) -> None:
        """Add a scanner station; translation [m], rotation (3, 3) world from scanner.

        Raises
        ------
        InputError : a second definition of the same name.
        """
        if name in self.points or name in self.stations:
            raise InputError(
                f"station {name} is defined twice",
                record=source or None,
                cure="keep one definition",
            )
        matrix = np.full((3, 3), np.nan) if rotation is None else np.asarray(rotation, dtype=float)
        self.stations[name] = GivenStation(
            np.asarray(translation, dtype=float), matrix, np.asarray(free, dtype=bool), source
        )

    def add(
        self,
        kind: type[Observations],
        *,
        values: ArrayLike,
        sigma: ArrayLike | None = None,
        covariance: ArrayLike | None = None,
        source: Sequence[str] | None = None,
        group: str = "",
        hard: bool = False,
        **columns: Any,
    ) -> int:
        """Add n observations of a kind; returns the table's number for :meth:`correlate`.

        Parameters
        ----------
        kind : the observation class; its index fields are given as names here.
        values : (n,) or (n, rows) in metres and radians.
        sigma : (n,) or (n, rows); or covariance (n, rows, rows). Not needed with ``hard``.
        source : ``file:line`` of each, (n,).
        hard : the values must hold exactly (a constraint).
        columns : the kind's own fields, names for those that refer to unknowns.

        Raises
        ------
        InputError : not a number, sigma not positive, covariance not positive definite.
        """
        rows = len(kind.units)
        measured = np.asarray(values, dtype=float).reshape(-1, rows)
        n = len(measured)
        origin = list(source) if source is not None else [""] * n
        check_values(measured, origin, kind.kind)
        if covariance is None:
            sigmas = (
                np.ones((n, rows)) if sigma is None and hard else np.asarray(sigma, dtype=float)
            )
            sigmas = np.broadcast_to(sigmas.reshape(-1, rows) if sigmas.ndim else sigmas, (n, rows))
            check_sigmas(sigmas, origin, kind.kind)
            matrices = covariance_from_sigma(sigmas)
        else:
            matrices = np.array(covariance, dtype=float).reshape(-1, rows, rows)
            check_covariance(matrices, origin, kind.kind)
        whole = {item.name for item in fields(kind) if "shared" in item.metadata}
        table = {
            name: column if name in whole else as_column(column, n)
            for name, column in columns.items()
        }
        check_heights(table, origin, kind.kind)
        table |= {"values": measured, "covariance": matrices, "source": origin}
        self._tables.append(Table(kind, group or kind.kind, table, n, hard))
        return len(self._tables) - 1

    def correlate(
        self,
        table: ArrayLike,
        item: ArrayLike,
        row: ArrayLike,
        covariance: ArrayLike,
        source: str = "",
    ) -> None:
        """Give values of several observations one covariance matrix (k, k).

        table, item, row (k,): the number that :meth:`add` returned, the observation within that
        call, its row.

        Raises
        ------
        InputError : the matrix is not symmetric positive definite.
        """
        matrix = np.asarray(covariance, dtype=float)
        check_covariance(matrix[None], [source], "covariance matrix")
        index = [np.asarray(a, dtype=np.int64).ravel() for a in (table, item, row)]
        self._joint.append((index[0], index[1], index[2], matrix))
        same = (index[0][:, None] == index[0]) & (index[1][:, None] == index[1])
        for a, b in np.argwhere(same):  # each observation's own block, for the reports
            columns = self._tables[index[0][a]].columns
            columns["covariance"][index[1][a], index[2][a], index[2][b]] = matrix[a, b]

    def merge(self, other: Survey) -> None:
        """Add everything of another survey.

        A point defined in both keeps the definition that has more to say: coordinates over none.

        Raises
        ------
        InputError : the same point defined with different coordinates in both.
        """
        for name, given in other.points.items():
            mine = self.points.get(name)
            if mine is not None and not np.isnan(mine.xyz).all() and not np.isnan(given.xyz).all():
                raise InputError(
                    f"point {name} is defined in both {mine.source or 'one survey'} and "
                    f"{given.source or 'the other'}",
                    cure="keep one definition",
                )
            if mine is None or np.isnan(mine.xyz).all():
                self.points[name] = given
        self.stations |= other.stations
        self.planes |= other.planes
        self.vectors |= other.vectors
        self.scalars |= other.scalars
        first = len(self._tables)
        self._tables += other._tables
        self._joint += [(t + first, i, r, c) for t, i, r, c in other._joint]
        self.warnings += other.warnings
        self.info = other.info | self.info
        if other.datum.kind != "control":
            self.datum = other.datum

    def tables(self) -> tuple[Table, ...]:
        """What was added, call by call."""
        return tuple(self._tables)

    def joint_tables(self) -> set[int]:
        """Numbers of the tables that share a covariance with others."""
        return {int(t) for tables, *_ in self._joint for t in tables}

    def replace_tables(self, parts: Sequence[Sequence[Table]]) -> None:
        """Put others in the place of each table; those that share a covariance stay single."""
        first = np.cumsum([0, *(len(part) for part in parts)])
        self._tables = [table for part in parts for table in part]
        self._joint = [(first[t], i, r, c) for t, i, r, c in self._joint]

    def of_marks(self) -> Survey:
        """What was measured of marks alone: without scanner stations and without check values.

        Points that nothing else observes are left out, so that the rest can be adjusted by itself.
        """
        tables = [
            table.active()
            for table in self._tables
            if not table.names("pose") and not (table.names("position") & self.stations.keys())
        ]
        return self._of(tables, {})

    def of_stations(self) -> Survey:
        """What ties scanner stations to each other alone: targets, planes, poses, plumb lines.

        Points have no given coordinates here, and nothing places the stations in the frame:
        adjusted as a free network they are a model of the site.
        """
        tables = [
            table.active()
            for table in self._tables
            if table.names("pose") and table.kind.kind not in _PLACING
        ]
        inner = self._of(tables, self.stations)
        points = {
            name: GivenPoint(np.full(3, np.nan), np.ones(3, dtype=bool), source=given.source)
            for name, given in inner.points.items()
        }
        return replace(inner, points=points, datum=Datum("free", tuple(inner.stations)))

    def _of(self, tables: list[Table], stations: dict[str, GivenStation]) -> Survey:
        """Some of the tables with the unknowns that they refer to."""
        tables = [table for table in tables if table.n]
        used = {f: set().union(*(t.names(f) for t in tables)) for f in (*FAMILIES, "position")}
        return replace(
            self,
            points={n: p for n, p in self.points.items() if n in used["point"] | used["position"]},
            stations={n: s for n, s in stations.items() if n in used["pose"] | used["position"]},
            planes={n: p for n, p in self.planes.items() if n in used["plane"]} if stations else {},
            vectors={n: v for n, v in self.vectors.items() if n in used["vector"]},
            scalars={n: v for n, v in self.scalars.items() if n in used["scalar"]},
            warnings=[],
            _tables=tables,
            _joint=[],
        )

    def named(self, kind: type[Observations], field_name: str) -> set[str]:
        """Names that the observations of a kind have in one of its fields."""
        found: set[str] = set()
        for table in self._tables:
            if table.kind is kind and field_name in table.columns:
                found |= {str(name) for name in np.ravel(table.columns[field_name]) if name}
        return found

    def network(self) -> Network:
        """Resolve all names and give the network.

        Raises
        ------
        InputError : nothing observed, or a name refers to an unknown of another family.
        """
        if not self._tables:
            raise InputError("there are no observations", cure="give a file with observations")
        layout = layout_of(self._given(), self._tables)
        kinds, place = concatenate(layout, [t for t in self._tables if not t.hard], self.site)
        hard, _ = concatenate(layout, [t for t in self._tables if t.hard], self.site)
        free, datum_mask = self._masks(layout)
        datum = self.datum
        if datum.kind == "free" and datum.components is None and datum_mask is not None:
            datum = Datum("free", datum.names, datum_mask)
        return Network(
            start=self._start(layout),
            free=free,
            observations=tuple(kinds + control_observations(self.points, layout)),
            joint=self._joint_covariances(place),
            constraints=tuple(Constraint(o) for o in hard),
            datum=datum,
            site=self.site,
            sigma0=self.sigma0,
            warnings=tuple(self.warnings),
            info=dict(self.info),
        )

    def _given(self) -> dict[str, Iterable[str]]:
        """Names that are given, by family."""
        return {
            "point": self.points,
            "pose": self.stations,
            "plane": self.planes,
            "vector": self.vectors,
            "scalar": self.scalars,
        }

    def _joint_covariances(
        self, place: Mapping[int, tuple[int, int]]
    ) -> tuple[JointCovariance, ...]:
        """Joint covariances of the network, from where each table went in it."""
        return tuple(
            JointCovariance(
                np.array([place[id(self._tables[t])][0] for t in tables]),
                np.array(
                    [place[id(self._tables[t])][1] + i for t, i in zip(tables, items, strict=True)]
                ),
                rows,
                matrix,
            )
            for tables, items, rows, matrix in self._joint
        )

    def _start(self, layout: Layout) -> State:
        start = State.blank(layout)
        for name, given in self.points.items():
            start.points[layout.index("point", name)] = given.xyz
        for name, station in self.stations.items():
            start.pose_t[layout.index("pose", name)] = station.translation
            start.pose_r[layout.index("pose", name)] = station.rotation
        for name, (normal, offset) in self.planes.items():
            start.plane_n[layout.index("plane", name)] = normal
            start.plane_d[layout.index("plane", name)] = offset
        for name, (vector, _) in self.vectors.items():
            start.vectors[layout.index("vector", name)] = vector
        start.scalars[:] = np.nan
        for name, (value, _) in self.scalars.items():
            start.scalars[layout.index("scalar", name)] = value
        return start

    def _masks(self, layout: Layout) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
        """Free columns, and columns that carry the datum if the survey marks any."""
        free = np.ones(layout.size, dtype=bool)
        datum = np.zeros(layout.size, dtype=bool)
        for name, given in self.points.items():
            columns = layout.columns("point", layout.index("point", name))
            free[columns] = given.free
            if given.datum is not None:
                datum[columns] = given.datum
        for name, station in self.stations.items():
            free[layout.columns("pose", layout.index("pose", name))] = station.free
        for name, (_, is_free) in self.vectors.items():
            free[layout.columns("vector", layout.index("vector", name))] = is_free
        for name, (_, is_free) in self.scalars.items():
            free[layout.columns("scalar", layout.index("scalar", name))] = is_free
        return free, datum if datum.any() else None
