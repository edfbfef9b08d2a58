"""What is delivered of a result, whatever the format: positions with covariance, sights, moves.

It is made of the JSON of a result, so that a file that is exported later holds the figures of the
run. Coordinates are easting, northing and height of the site's grid where it has one, otherwise
those of the work frame. Metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from pyproj import CRS, Transformer

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses
from tribrach.network.facts import HEIGHTS

PositionRole = Literal["control", "check", "free", "station", "moved", "stable", "undecided"]
#: roles by the verdict of a comparison
_ROLES: dict[str, PositionRole] = {"moved": "moved", "not moved": "stable"}
#: half a step [m] over which the axes of a grid are found
_STEP = 5.0
#: probability of ellipses
CONFIDENCE = 0.95


def ellipse_of(covariance: Array, dof: float = math.inf) -> tuple[float, float, float]:
    """Semi-axes [m] and azimuth [rad] of the ellipse in plan of a covariance (3, 3)."""
    plan = plan_ellipses(covariance[None], confidence_factor(2, CONFIDENCE, dof))
    return float(plan.major[0]), float(plan.minor[0]), float(plan.azimuth[0])


@dataclass(frozen=True)
class DeliveredPosition:
    """A point or station with what is known of it."""

    name: str
    role: PositionRole
    code: str  #: code or description, "" without
    xyz: Array  #: (3,), easting, northing, height [m], NaN where there is none
    covariance: Array  #: (3, 3), along the same axes [m^2]; zero where held
    #: degrees of freedom of its variances in plan, infinite where sigmas are given
    dof: float = math.inf
    #: longitude and latitude [degrees] and ellipsoidal height [m], of the site's datum
    geodetic: tuple[float, float, float] | None = None

    @property
    def ellipse(self) -> tuple[float, float, float]:
        """Semi-axes [m] of the ellipse that holds with 95 %, azimuth of the major one [rad]."""
        return ellipse_of(self.covariance, self.dof)

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) [m]."""
        sigmas = np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))
        return np.where(np.isnan(self.xyz), np.nan, sigmas)


@dataclass(frozen=True)
class DeliveredMove:
    """Displacement of a point between two epochs."""

    name: str
    #: (3,), at the first epoch, and the displacement [m]
    xyz: Array
    vector: Array
    covariance: Array
    verdict: str  #: as the comparison has it
    epochs: tuple[str, str]  #: from one epoch to the other


@dataclass(frozen=True)
class Delivery:
    """A result on its way into other formats."""

    title: str
    positions: tuple[DeliveredPosition, ...]
    #: pairs of positions that an observation joins
    sights: tuple[tuple[str, str], ...] = ()
    moves: tuple[DeliveredMove, ...] = ()
    crs: str = ""  #: reference system of the coordinates, "" for a local frame
    epoch: float | None = None  #: decimal year of a dynamic frame
    heights: str = ""  #: what heights are, such as ``normal height``, "" if nothing says it
    scale: str = "prior"  #: whether sigmas are scaled a priori or a posteriori
    datum: str = ""  #: what fixes the frame
    program: str = field(default="tribrach", compare=False)  #: the program and its version

    @cached_property
    def by_name(self) -> Mapping[str, DeliveredPosition]:
        """Positions by name."""
        return {position.name: position for position in self.positions}

    @cached_property
    def plan(self) -> tuple[DeliveredPosition, ...]:
        """Positions that have a place in plan; refused if there is none."""
        found = tuple(p for p in self.positions if np.isfinite(p.xyz[:2]).all())
        if not found:
            raise InputError(
                "the result has no point with a place in plan",
                cure="export it as a list or a sheet (csv, xlsx)",
            )
        return found

    @cached_property
    def lines(self) -> tuple[tuple[DeliveredPosition, DeliveredPosition], ...]:
        """Sights whose ends both have a place in plan."""
        placed = {p.name: p for p in self.positions if np.isfinite(p.xyz[:2]).all()}
        return tuple((placed[a], placed[b]) for a, b in self.sights if {a, b} <= placed.keys())

    def wgs84(self) -> Array:
        """Longitude and latitude [degrees] and height [m] (n, 3) of ``plan`` in WGS 84."""
        if all(p.geodetic for p in self.plan):
            places = np.array([p.geodetic for p in self.plan], dtype=float)
            if self.crs:
                own = CRS.from_user_input(self.crs).to_2d().geodetic_crs
                there = Transformer.from_crs(own, "EPSG:4326", always_xy=True)
                places[:, :2] = np.stack(there.transform(places[:, 0], places[:, 1]), axis=1)
            return places
        if not self.crs:
            raise InputError(
                "the result has no place on the Earth",
                cure='give the project a site with a crs, such as crs = "EPSG:25832", or export '
                "it as dxf, landxml, gpkg, csv or xlsx",
            )
        xyz = np.array([p.xyz for p in self.plan])
        there = Transformer.from_crs(_plan_crs(self.crs), "EPSG:4326", always_xy=True)
        plan = xyz[:, :2] / self.unit
        return np.column_stack([*there.transform(plan[:, 0], plan[:, 1]), xyz[:, 2]])

    @cached_property
    def unit(self) -> float:
        """Metres in the unit of the reference system."""
        if not self.crs:
            return 1.0
        return float(_plan_crs(self.crs).axis_info[0].unit_conversion_factor)


def _plan_crs(crs: str) -> CRS:
    """The horizontal part of a reference system."""
    whole = CRS.from_user_input(crs)
    return whole.sub_crs_list[0] if whole.is_compound else whole.to_2d()


def delivered_network(result: Mapping[str, Any]) -> Delivery:
    """Content of a delivery from the JSON of an adjusted network."""
    reference = result.get("reference") or {}
    crs = reference.get("crs") or ""
    known = {**result["points"], **result["stations"]}
    projected = any(p.get("projected") for p in known.values())
    placed = any(p.get("geodetic") for p in known.values())
    if crs and not _projected(crs):
        crs = ""
    if placed and not projected:
        crs = ""  # E, N, U around a place are those of no grid
    turn = _Turn(crs) if projected else None
    positions = [
        _position(name, point["role"], point.get("code", ""), point["xyz"], point, turn)
        for name, point in result["points"].items()
    ]
    for name, station in result["stations"].items():
        if (pose := station.get("world_from_scanner")) is not None:
            xyz = [row[3] for row in pose[:3]]
            block = [row[:3] for row in station["covariance"][:3]]
            of_place = {**station, "covariance": block}
            positions.append(_position(name, "station", "", xyz, of_place, turn))
    return Delivery(
        result.get("title") or "Adjusted network",
        tuple(positions),
        tuple(_sights(result["observations"], {p.name for p in positions})),
        crs=crs,
        epoch=reference.get("epoch"),
        heights=HEIGHTS[kind] if (kind := reference.get("heights")) in HEIGHTS else "",
        scale=result["sigma0"]["covariances"],
        datum=result["datum"]["statement"],
        program=f"tribrach {result['tribrach']}",
    )


def _projected(crs: str) -> bool:
    """True for a reference system with easting and northing."""
    whole = CRS.from_user_input(crs)
    return bool((whole.sub_crs_list[0] if whole.is_compound else whole).is_projected)


def _position(
    name: str,
    role: PositionRole,
    code: str,
    xyz: Sequence[float | None],
    data: Mapping[str, Any],
    turn: _Turn | None,
) -> DeliveredPosition:
    """A position of the result in the frame of the delivery."""
    place = np.array([math.nan if v is None else v for v in xyz], dtype=float)
    covariance = np.array(
        [[0.0 if v is None else v for v in row] for row in data["covariance"]], dtype=float
    )
    geodetic = data.get("geodetic")
    if geodetic is not None:
        latitude, longitude, height = geodetic
        geodetic = (math.degrees(longitude), math.degrees(latitude), height)
        if turn is not None and data.get("projected"):
            place = np.array(data["projected"], dtype=float)
            axes = turn.at(latitude, longitude) @ _local_axes(latitude, longitude)
            covariance = axes @ np.array(data["ecef_covariance"], dtype=float) @ axes.T
    dof = (data.get("dof") or [None])[0]
    return DeliveredPosition(
        name, role, code, place, covariance, math.inf if dof is None else dof, geodetic
    )


def _local_axes(latitude: float, longitude: float) -> Array:
    """East, north and up (3, 3) at a place, in rows along the geocentric axes."""
    sp, cp, sl, cl = (f(a) for a in (latitude, longitude) for f in (math.sin, math.cos))
    return np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])


class _Turn:
    """Turns east, north, up at a place into the axes of a grid; its scale is left out."""

    def __init__(self, crs: str) -> None:
        grid = _plan_crs(crs)
        self._to_grid = Transformer.from_crs(grid.geodetic_crs, grid, always_xy=True)

    def at(self, latitude: float, longitude: float) -> Array:
        """The rotation (3, 3) at a place [rad]."""
        step = _STEP / 6.4e6
        turns = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]) * step
        longitudes = longitude + turns[:, 0] / math.cos(latitude)
        there = np.stack(
            self._to_grid.transform(
                np.degrees(longitudes), np.degrees(latitude + turns[:, 1]), errcheck=True
            ),
            axis=1,
        )
        plan = np.stack([there[0] - there[1], there[2] - there[3]], axis=1)
        u, _, vt = np.linalg.svd(plan)
        out = np.eye(3)
        out[:2, :2] = u @ vt
        return out


def _sights(rows: Sequence[Mapping[str, Any]], names: set[str]) -> Iterator[tuple[str, str]]:
    """Pairs of positions that an observation joins which takes part, each pair once."""
    seen: set[frozenset[str]] = set()
    for row in rows:
        a, b = row["from"], row["to"]
        pair = frozenset((a, b))
        if row["state"] == "active" and a != b and a in names and b in names and pair not in seen:
            seen.add(pair)
            yield a, b


def delivered_epochs(result: Mapping[str, Any]) -> Delivery:
    """Content of a delivery from the JSON of compared epochs."""
    moves: list[DeliveredMove] = []
    points: dict[str, DeliveredPosition] = {}
    comparisons = result["comparisons"]
    for compared in comparisons:
        axes = ["ENU".index(axis) for axis in compared["axes"]]
        for name, point in compared["points"].items():
            vector, covariance = np.zeros(3), np.zeros((3, 3))
            vector[axes] = [v or 0.0 for v in point["displacement"]]
            covariance[np.ix_(axes, axes)] = np.array(point["covariance"], dtype=float)
            xyz = np.array([math.nan if v is None else v for v in point["xyz"]], dtype=float)
            moves.append(
                DeliveredMove(
                    name, xyz, vector, covariance, point["verdict"],
                    (compared["first"], compared["second"]),
                )
            )  # fmt: skip
            role = _ROLES.get(point["verdict"], "undecided")
            points[name] = DeliveredPosition(name, role, "", xyz, covariance)
    ends = f"{comparisons[0]['first']} to {comparisons[-1]['second']}" if comparisons else ""
    return Delivery(
        f"Displacements, {ends}",
        tuple(points.values()),
        moves=tuple(moves),
        scale=comparisons[0]["covariances"] if comparisons else "prior",
        program=f"tribrach {result['tribrach']}",
    )
