"""Coordinates and GNSS from a CSV file: control, check and approximate points, positions, vectors.

Coordinates stand in the site's own system (``e, n, u``, also written ``x, y, z`` or ``easting,
northing, height``), as ``latitude, longitude, height`` or as ``ecef_x, ecef_y, ecef_z``; vectors
along the axes of the work frame (``de, dn, du``) or geocentric (``dx, dy, dz``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.io.survey.csv.columns import COVARIANCE, LOCAL
from tribrach.io.survey.csv.headings import letters
from tribrach.io.survey.csv.matrix import CoordinateCovariance
from tribrach.io.survey.csv.reader import Reader, located
from tribrach.network.facts import AssumedSigmas, FrameChange, OverGeoid, PointCodes, StartOnly
from tribrach.observations.control import (
    CHECK_SIGMA,
    Coordinate,
    Coordinates,
    Offsets,
    VectorPriors,
)
from tribrach.observations.gnss import Antennas, GnssBaselines, GnssPositions

#: words of other languages and programs for the role ``fixed``
_HELD = {
    letters(word) for word in ("fix", "held", "known", "fest", "fixe", "fijo", "fisso", "vast")
}


def rod_covariance(rod: Array, sigma: Array, bubble: Array, eccentricity: Array) -> Array:
    """Covariances of targets on rods over marks (method section 2.6).

    A bubble of some sensitivity moves the target by ``rod * bubble`` sideways, an eccentricity of
    the target on its rod adds to that.

    ``rod``, ``sigma`` (n,): length of the rod along the plumb line, and its sigma [m]; ``bubble``
    (n,): sigma of the plumb line in each of two directions [rad]; ``eccentricity`` (n,): sigma of
    the target on its rod in each of two directions [m]. Returns (n, 3, 3): along E, N, U [m^2].
    """
    plan = (rod * bubble) ** 2 + eccentricity**2
    covariance: Array = np.stack([plan, plan, sigma**2], axis=1)[:, :, None] * np.eye(3)
    return covariance


class RodReader(Reader):
    """Spheres, prisms or checkerboards on rods over marks: ``mark, target, rod_m``.

    What the file does not say of rods and bubbles comes from the instrument.
    """

    def read(self) -> None:
        """All rods, as offsets from mark to target."""
        rod = self.table.columns("rod")[:, 0]
        self.table.refuse(
            np.flatnonzero(~(rod > 0)),
            lambda row: f"the rod is {rod[row]:g} m long",
            "give a length above zero",
        )
        marks = self.table.names("mark", self.all)
        targets = self.table.names("target", self.all)
        same = [mark == target for mark, target in zip(marks, targets, strict=True)]
        self.table.refuse(
            np.flatnonzero(same),
            lambda row: f"mark and target are both {marks[row]}",
            "give each a name of its own",
        )
        own = self.precision
        covariance = rod_covariance(
            rod,
            self.sigma(("sigma_rod",), self.all, lambda: self._all(own.rod)),
            self.sigma(("bubble",), self.all, lambda: self._all(own.bubble)),
            self.sigma(("eccentricity",), self.all, lambda: self._all(own.eccentricity)),
        )
        if not (np.einsum("nii->ni", covariance) > 0).all():
            raise self.table.error(
                0, "neither bubble nor eccentricity move the target", "give one of both above zero"
            )
        zero = np.zeros(len(rod))
        self.add(
            Offsets,
            self.all,
            values=np.stack([zero, zero, rod], axis=1),
            covariance=covariance,
            start=marks,
            end=targets,
        )

    def _all(self, value: float | None) -> Array | None:
        """One value for all rows."""
        return None if value is None else np.full(len(self.all), value)


ROLES = ("control", "fixed", "approximate", "check")


_AXES = ("e", "n", "u")


class _Placed(Reader):
    """Readers of tables with coordinates."""

    def given(self) -> Array:
        """Coordinates (n, 3) of the file in their own system, NaN where empty."""
        table = self.table
        if table.has("latitude", "longitude"):
            return np.stack([table.number(n) for n in ("latitude", "longitude", "u")], axis=1)
        if table.has("ecef_x", "ecef_y", "ecef_z"):
            return np.stack([table.number(f"ecef_{a}") for a in "xyz"], axis=1)
        if not any(table.has(axis) for axis in _AXES):
            raise table.error(None, "there are no coordinates", "add e_m, n_m, u_m")
        return np.stack([table.number(axis) for axis in _AXES], axis=1)

    def to_work(self, given: Array, covariance: Array | None = None) -> tuple[Array, Array | None]:
        """W coordinates and covariances of complete coordinates, at the epoch of the job."""
        if self.table.has("latitude", "longitude"):
            positions, turned = self.frame.from_geodetic(given, covariance)
        elif self.table.has("ecef_x"):
            positions, turned = self.frame.from_ecef(given, covariance)
            if covariance is not None and not self._geocentric_sigmas():
                axes = self.frame.site.axes(positions)
                turned = axes.transpose(0, 2, 1) @ covariance @ axes
        else:
            positions, turned = self.frame.from_own(given, covariance)
        own = not (self.table.has("latitude", "longitude") or self.table.has("ecef_x"))
        way = self.carry or (None if own else self.geocentric)
        if way is not None and isinstance(self.frame.site, EllipsoidSite):
            site = self.frame.site
            before = site.to_ecef(positions)
            after, accuracy = way.positions(before)
            self.changed(
                FrameChange.of_positions(self.table.path.name, way, before, after, accuracy)
            )
            positions = site.from_ecef(after)
        return positions, turned

    def _geocentric_sigmas(self) -> bool:
        """True if sigmas stand along X, Y, Z, by their titles; an instrument's are E, N, U."""
        titles = [self.table.titles.get(name, "") for name in ("sigma_e", "cee")]
        return any(title.startswith(("sigma_x", "cxx")) for title in titles)

    def complete(self, given: Array) -> Array:
        """The same coordinates, none of them empty."""
        empty = np.flatnonzero(np.isnan(given).any(axis=1))
        self.table.refuse(empty, "a coordinate is empty", "give all three")
        return given


class PositionReader(_Placed):
    """Positions measured by GNSS: over marks, or of the antenna on a scanner with a lever arm.

    Positions of one ``set`` (a session, one reference) have a share of their variance in common,
    half of it unless the instrument says otherwise.
    """

    def read(self) -> None:
        """All positions."""
        plan, up = self.precision.gnss_plan, self.precision.gnss_up
        default = None
        if plan is not None and up is not None:
            default = np.tile(np.diag([plan**2, plan**2, up**2]), (len(self.all), 1, 1))
        covariance = self.covariance(_AXES, LOCAL, default)
        values, turned = self.to_work(self.complete(self.given()), covariance)
        own, common = self._common(covariance if turned is None else turned)
        names = np.array(self.table.names("gnss", self.all), dtype=object)
        on_scanner = np.array([bool(self.lever_arms.get(name)) for name in names], dtype=bool)
        marks, scanners = np.flatnonzero(~on_scanner), np.flatnonzero(on_scanner)
        height = np.nan_to_num(self.table.number("antenna_height"))
        if len(marks):
            self.add(
                GnssPositions,
                marks,
                values=values[marks],
                covariance=own[marks],
                common=common[marks],
                position=names[marks],
                antenna_height=height[marks],
            )
        if len(scanners):
            self.add(
                Antennas,
                scanners,
                values=values[scanners],
                covariance=own[scanners],
                common=common[scanners],
                station=names[scanners],
                lever_arm=self._arms(names, scanners),
            )

    def _arms(self, names: NDArray[Any], rows: Index) -> NDArray[Any]:
        """Lever arm of each of the rows: what the column says, or the only one of the station."""
        words = self.table.words.get("lever_arm", [""] * len(names))
        given = [self.lever_arms[names[k]] for k in rows]
        arms = [words[k] or one[0] for k, one in zip(rows, given, strict=True)]
        open_ = [not words[k] and len(one) > 1 for k, one in zip(rows, given, strict=True)]
        self.table.refuse(
            rows[np.array(open_, dtype=bool)],
            "the station carries several antennas and the row does not say which",
            "give the column lever_arm",
        )
        wrong = [arm not in one for arm, one in zip(arms, given, strict=True)]
        self.table.refuse(
            rows[np.array(wrong, dtype=bool)],
            "the station carries no such lever arm",
            "name one of lever_arm in [stations.NAME]",
        )
        return np.array(arms, dtype=object)

    def _common(self, covariance: Array) -> tuple[Array, NDArray[Any]]:
        """Own covariances (n, 3, 3), and the name of each row's common shift, "" for none."""
        sets = np.array(self.table.words.get("set", [""] * len(self.all)), dtype=object)
        names = np.array([f"common shift of {name}" if name else "" for name in sets], dtype=object)
        own, share = covariance.copy(), self.precision.gnss_common
        if share == 0:
            names = np.full(len(names), "", dtype=object)
        for name in dict.fromkeys(names[names != ""]):
            members = names == name
            own[members] *= 1 - share
            self.survey.vectors[name] = (np.zeros(3), True)
            self.survey.add(
                VectorPriors,
                values=np.zeros((1, 3)),
                covariance=share * covariance[members].mean(axis=0)[None],
                vector=[name],
                source=[str(self.sources[np.flatnonzero(members)[0]])],
            )
        return own, names


class VectorReader(Reader):
    """GNSS baselines from and to marks."""

    def read(self) -> None:
        """All vectors, geocentric ones turned into the work frame."""
        if self.table.has("dx"):
            vectors = self._in_frame(self.table.columns("dx", "dy", "dz"))
            values = self.frame.vectors(vectors)
            covariance = self.frame.turned(self.covariance(("dx", "dy", "dz"), COVARIANCE))
        else:
            values = self.table.columns("de", "dn", "du")
            covariance = self.covariance(("de", "dn", "du"), LOCAL)
        ends = {name: self.table.names(name, self.all) for name in ("from", "to")}
        self.add(
            GnssBaselines,
            self.all,
            values=values,
            covariance=covariance,
            start=ends["from"],
            end=ends["to"],
        )

    def _in_frame(self, vectors: Array) -> Array:
        """Geocentric vectors (n, 3) [m] in the frame of the job."""
        way, site = self.carry or self.geocentric, self.frame.site
        if way is None or not isinstance(site, EllipsoidSite):
            return vectors
        turn, accuracy = way.turn(site.origin)
        after = vectors @ turn.T
        self.changed(FrameChange.of_vectors(self.table.path.name, way, vectors, after, accuracy))
        return after


class CoordinateReader(_Placed):
    """Points with given coordinates and what they are for.

    control is weighted by its sigmas, fixed holds, approximate only starts the iteration, check is
    compared and not used. Without a role, points with sigmas are control, the others approximate.
    """

    def read(self) -> None:
        """All points; on a flat site a point may lack coordinates."""
        names = self.table.names("point", self.all)
        given, (sigma, covariance) = self.given(), self._precision(names)
        roles = self._roles(np.asarray(np.isfinite(sigma).any(axis=1)))
        known = ~np.isnan(given)
        partial = isinstance(self.frame.site, FlatSite) and self.frame.grid is None
        xyz = given if partial else self.to_work(self.complete(given))[0]
        self._check(names, roles, known, sigma)
        stated = np.asarray((np.isfinite(sigma) | ~known).all(axis=1))
        for row in self.all:
            with located(self.table.path):
                self.survey.point(
                    names[row],
                    xyz[row],
                    free=~(known[row] & (roles[row] == "fixed")),
                    role=roles[row] if roles[row] != "approximate" else "free",
                    source=self.sources[row],
                    stated=roles[row] != "check" or bool(stated[row]),
                )
        said = np.array(self.table.words.get("role", [""] * len(self.all))) != ""
        loose = (roles == "approximate") & known.any(axis=1) & ~said & (self.role is None)
        if loose.any():
            listed = tuple(name for name, one in zip(names, loose, strict=True) if one)
            self.survey.facts += (StartOnly(self.table.path.name, listed),)
        for role in ("control", "check"):
            members = roles == role
            whole = np.flatnonzero(members & known.all(axis=1))
            if len(whole):
                _, turned = self.to_work(given[whole], covariance[whole])
                self._whole(role, whole, xyz, turned, names)
            rest = np.flatnonzero(members & ~known.all(axis=1))
            if len(rest):
                self._single(role, rest, given, sigma, names)
        if self.matrix is not None:
            self._correlate(self.matrix, names, given)
        if not self.table.has("ecef_x"):
            self.survey.facts += (OverGeoid(tuple(names)),)
        comments = self.table.words.get("comment", [])
        if coded := tuple((n, c) for n, c in zip(names, comments, strict=False) if c):
            self.survey.facts += (PointCodes(coded),)

    def _check_matrix(self, matrix: CoordinateCovariance, names: list[str]) -> None:
        """Refuse covariances of points and axes that the file does not have."""
        missing = [name for name, _ in matrix.keys if name not in names]
        if missing or not self.table.has("e"):
            what = f"{missing[0]}, which is no point" if missing else "east, north, up, and not"
            raise InputError(
                f"the covariances are of {what} of {self.table.name}",
                file=matrix.path,
                line=matrix.line,
                cure="give covariances of the coordinates of this file, in their own axes",
            )

    def _correlate(self, matrix: CoordinateCovariance, names: list[str], given: Array) -> None:
        """Give the control coordinates that a matrix names their covariances."""
        place: dict[tuple[str, int], tuple[int, int, int]] = {}
        for number, table in enumerate(self.survey.tables()):
            axes = np.broadcast_to(table.columns.get("axis", -1), table.n).astype(int)
            for item, name in enumerate(table.columns["position"]):
                rows = range(3) if axes[item] < 0 else [int(axes[item])]
                place |= {(str(name), axis): (number, item, axis % len(rows)) for axis in rows}
        chosen = [k for k, key in enumerate(matrix.keys) if key in place]
        keys = [matrix.keys[k] for k in chosen]
        turn = self._own_axes(keys, names, given)
        block = turn @ matrix.matrix[np.ix_(chosen, chosen)] @ turn.T
        where = np.array([place[key] for key in keys]).reshape(-1, 3)
        source = f"{matrix.path.name}:{matrix.line}"
        self.survey.correlate(where[:, 0], where[:, 1], where[:, 2], block, source)

    def _own_axes(self, keys: list[tuple[str, int]], names: list[str], given: Array) -> Array:
        """Derivative (k, k) of coordinates in W by those of the file, each of them by its key."""
        if self.frame.grid is None:
            return np.eye(len(keys))
        out = np.zeros((len(keys), len(keys)))
        number = {key: k for k, key in enumerate(keys)}
        for name in dict.fromkeys(name for name, _ in keys):
            rows = [number.get((name, axis), -1) for axis in range(3)]
            if -1 in rows:
                raise self.table.error(
                    names.index(name),
                    f"the covariances leave a coordinate of {name} out",
                    "give them for east, north and height: conversion from the grid needs all",
                )
            there = given[names.index(name)]
            ahead, behind = (self.to_work(there + sign * np.eye(3))[0] for sign in (1, -1))
            out[np.ix_(rows, rows)] = (ahead - behind).T / 2
        return out

    def _precision(self, names: list[str]) -> tuple[Array, Array]:
        """Sigmas (n, 3), NaN where not given, and covariances (n, 3, 3)."""
        if any(self.table.has(name) for name in (*LOCAL, *COVARIANCE)):
            covariance = self.covariance(_AXES, LOCAL)
            diagonal = np.einsum("nii->ni", covariance)
            bad = np.flatnonzero(~(diagonal > 0).all(axis=1))
            self.table.refuse(bad, "a variance is not above zero", "give variances above zero")
            return np.sqrt(diagonal), covariance
        sigma = np.stack([self.table.number(f"sigma_{a}") for a in _AXES], axis=1)
        if self.matrix is not None:
            self._check_matrix(self.matrix, names)
            known = self.matrix.sigmas()
            own = [[known.get((name, axis), np.nan) for axis in range(3)] for name in names]
            sigma = np.where(np.isnan(own), sigma, own)
        stated = np.array([np.nan if one is None else one for one in self.sigmas])
        empty = np.isnan(sigma) & np.isfinite(stated)
        if empty.any():
            sigma = np.where(empty, stated, sigma)
            who = tuple(name for name, lacks in zip(names, empty.any(axis=1), strict=True) if lacks)
            fact = AssumedSigmas(self.table.path.name, *self.sigmas[1:], who, self.sigma_source)
            self.survey.facts += (fact,)
        filled = np.where(np.isnan(sigma), CHECK_SIGMA, sigma)
        return sigma, filled[:, :, None] ** 2 * np.eye(3)

    def _roles(self, weighted: NDArray[np.bool_]) -> NDArray[Any]:
        """Role of each row (n,)."""
        default = np.where(weighted, "control", "approximate")
        default = default if self.role is None else np.full(len(self.all), self.role)
        typed = self.table.words.get("role", [""] * len(self.all))
        typed = ["fixed" if letters(word) in _HELD else word for word in typed]
        bad = np.flatnonzero([word not in ("", *ROLES) for word in typed])
        self.table.refuse(bad, lambda row: f"role is {typed[row]!r}", f"use {', '.join(ROLES)}")
        return np.where(np.array(typed) == "", default, typed)

    def _check(
        self, names: list[str], roles: NDArray[Any], known: NDArray[np.bool_], sigma: Array
    ) -> None:
        """Every point has a coordinate, and control a sigma for each of its coordinates."""
        empty = np.flatnonzero(~known.any(axis=1))
        self.table.refuse(
            empty, lambda row: f"point {names[row]} has no coordinates", "give one or more"
        )
        bare = np.flatnonzero((roles == "control") & (known & np.isnan(sigma)).any(axis=1))
        self.table.refuse(
            bare,
            lambda row: f"control point {names[row]} has a coordinate without sigma",
            "add sigma_e_mm, sigma_n_mm and sigma_u_mm, state sigma_plan_mm and sigma_up_mm in the "
            "project, or give it the role fixed",
        )

    def _whole(
        self, role: str, rows: Index, xyz: Array, covariance: Array | None, names: list[str]
    ) -> None:
        """Points with all three coordinates."""
        self._observe(role, Coordinates, rows, names, values=xyz[rows], covariance=covariance)

    def _single(self, role: str, rows: Index, given: Array, sigma: Array, names: list[str]) -> None:
        """Coordinates of points that lack others."""
        for axis in range(3):
            chosen = rows[~np.isnan(given[rows, axis])]
            values, own = given[chosen, axis], sigma[chosen, axis]
            own = np.where(np.isnan(own), CHECK_SIGMA, own)
            self._observe(role, Coordinate, chosen, names, values=values, sigma=own, axis=axis)

    def _observe(
        self,
        role: str,
        kind: type[Coordinates] | type[Coordinate],
        rows: Index,
        names: list[str],
        **columns: Any,
    ) -> None:
        """Given coordinates as observations of the group control."""
        names = [names[row] for row in rows]
        held_out = role == "check"
        self.add(kind, rows, held_out=held_out, group="control", position=names, **columns)
