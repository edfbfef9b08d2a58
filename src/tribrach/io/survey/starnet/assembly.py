"""A survey from the records of a STAR*NET job.

Zenith angles carry refraction; grid bearings the convergence and the correction from arc to chord
that the coordinates tell; vectors are turned into the work frame, their standard errors stretched
in plan and height. Observations that are fixed become conditions, free ones check values. In a grid
plumb lines lean by the one deflection of the project; bearings and height differences feel nothing
of it, as they refer to the grid and to heights over a geoid of one height.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.plumb import PlumbField
from tribrach.geodesy.site import EllipsoidSite
from tribrach.instruments import centring
from tribrach.io.survey.starnet.places import Places
from tribrach.io.survey.starnet.records import (
    Level,
    Quantity,
    Sight,
    SigmaMark,
    StarnetRecords,
    Vector,
)
from tribrach.io.survey.starnet.settings import StarnetSettings
from tribrach.network.facts import PointCodes, Reference
from tribrach.network.side_shots import SideShots
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations, Use
from tribrach.observations.gnss import GnssBaselines
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
    face_two_words,
)

# What the instrument says is combined in squares with the errors of centring of both ends (method
# section 2.3). A standard error that is given with an observation is taken as it is, unless the
# file says otherwise.

#: finds horizontal length and height difference (n, 2) of lines by the names of their ends
Lines = Callable[[Sequence[tuple[str, str]]], Array]


def sigmas_of(sights: Sequence[Sight], lines: Lines) -> tuple[Array, Array]:
    """Standard errors of sights of one quantity.

    ``lines``: gives horizontal length and height difference (n, 2) [m] of lines, NaN where not
    known. Returns ``sigmas`` (n,): [m or rad]; NaN where the observation is fixed; ``lacking``
    (n,): centring is left out because the length of the sight is not known.
    """
    quantity = sights[0].quantity
    given = np.array([s.sigma if isinstance(s.sigma, float) else np.nan for s in sights])
    default = np.array([s.sigma in (SigmaMark.DEFAULT, SigmaMark.FREE) for s in sights])
    fixed = np.array([s.sigma is SigmaMark.FIXED for s in sights])
    length = np.array([np.nan if s.length is None else s.length for s in sights])
    rise = np.array([s.rise for s in sights])
    unknown = np.isnan(length)
    if unknown.any():
        pairs = [(s.at, s.to) for s, u in zip(sights, unknown, strict=True) if u]
        length[unknown], rise[unknown] = lines(pairs).T
    own = _instrument(quantity, sights, np.hypot(np.nan_to_num(length), np.nan_to_num(rise)))
    sigma = np.where(default, own, given)
    grows = default | np.array([s.centring for s in sights])
    errors = _end_errors(sights)
    if quantity is Quantity.ANGLE:
        backs = lines([(s.at, s.back) for s in sights])[:, 0]
        across = lines([(s.back, s.to) for s in sights])[:, 0]
        variance = _of_angle(errors, length, backs, across, np.array([s.value for s in sights]))
    else:
        variance = _of_sight(quantity, errors, length, rise)
    lacking = grows & np.isnan(variance) & (errors > 0).any(axis=1) & ~fixed
    variance = np.where(grows & ~np.isnan(variance), variance, 0.0)
    return np.where(fixed, np.nan, np.sqrt(sigma**2 + variance)), lacking


def _end_errors(sights: Sequence[Sight]) -> Array:
    """Errors (n, 3) of centring: instrument, target, height [m]."""
    return np.array([(s.errors.instrument, s.errors.target, s.errors.vertical) for s in sights])


def _instrument(quantity: Quantity, sights: Sequence[Sight], slope: Array) -> Array:
    """Standard errors (n,) of the instruments, without centring."""

    def column(name: str) -> Array:
        return np.array([getattr(s.errors, name) for s in sights], dtype=float)

    if quantity in (Quantity.SLOPE, Quantity.LEVEL_DISTANCE, Quantity.RISE):
        rise = quantity is Quantity.RISE
        value = np.array([np.nan if s.value is None else s.value for s in sights])
        # the ppm are of the distance itself
        length = slope if rise else np.where(np.isnan(value), slope, value)
        constant = column("rise" if rise else "distance")
        part = column("rise_ppm" if rise else "distance_ppm") * length
        propagated = np.array([s.propagated for s in sights])
        return np.where(propagated, np.hypot(constant, part), constant + part)
    name = {
        Quantity.DIRECTION: "direction",
        Quantity.ANGLE: "angle",
        Quantity.BEARING: "azimuth",
        Quantity.ZENITH: "zenith",
    }[quantity]
    return column(name)


def _of_sight(quantity: Quantity, errors: Array, length: Array, rise: Array) -> Array:
    """Variances (n,) of centring; NaN where they need a length that is not known."""
    instrument, target, height = errors.T
    if quantity is Quantity.LEVEL_DISTANCE:
        variance: Array = instrument**2 + target**2
    elif quantity is Quantity.RISE:
        variance = 2 * height**2
    elif quantity is Quantity.SLOPE:
        variance = centring.of_slope_distances(length, rise, instrument, target, height)
    elif quantity is Quantity.ZENITH:
        variance = centring.of_zeniths(length, rise, instrument, target, height)
    else:
        variance = centring.of_directions(length, instrument, target)
    return np.where(np.isfinite(variance), variance, np.nan)


def _of_angle(errors: Array, ahead: Array, back: Array, across: Array, angle: Array) -> Array:
    """Variances (n,) of centring of angles; NaN where a length is not known."""
    # the third side of the triangle where its length is not known by itself
    known2 = ahead**2 + back**2 - 2 * ahead * back * np.cos(angle.astype(float))
    third = np.where(np.isnan(across), np.sqrt(np.maximum(known2, 0.0)), across)
    variance = centring.of_angles(ahead, back, third, errors[:, 0], errors[:, 1])
    return np.where(np.isfinite(variance), variance, np.nan)


#: what is wanted of a job: everything, its points alone, or its observations as planned ones
Part = Literal["all", "points", "planned"]

_KINDS: dict[Quantity, type[Observations]] = {
    Quantity.DIRECTION: Directions,
    Quantity.ANGLE: Angles,
    Quantity.BEARING: Azimuths,
    Quantity.SLOPE: SlopeDistances,
    Quantity.LEVEL_DISTANCE: HorizontalDistances,
    Quantity.ZENITH: ZenithAngles,
    Quantity.RISE: HeightDifferences,
}
#: sights that say something in a job of this kind
_USED = {
    "2D": {Quantity.DIRECTION, Quantity.ANGLE, Quantity.BEARING, Quantity.LEVEL_DISTANCE},
    "3D": set(Quantity),
    "LEV": {Quantity.RISE},
}
#: rise over length from which on slope distances tell heights
_STEEP = 0.1
#: why a free observation is not used
_FREE = "free in the file"


def assemble(
    records: StarnetRecords,
    settings: StarnetSettings,
    refused: RefusalCollector,
    part: Part = "all",
) -> Survey:
    """The survey of a job."""
    places = Places(records, settings, refused)
    refused.settle()
    builder = _Builder(records, settings, places, refused, part)
    survey = builder.survey
    survey.warnings += [*places.warnings, *records.warnings]
    if records.codes:
        survey.facts += (PointCodes(tuple(records.codes)),)
    if records.face_two:
        survey.warnings.append(face_two_words(records.face_two))
    if part != "planned":
        places.hold_heights(builder.without_heights(), survey.warnings)
        # targets of side shots alone are computed, whatever is given of them
        seen = builder.observed()
        places.add_to(survey, seen | {*places.given}, {s.name for s in records.shots} - seen)
    if part != "points":
        builder.observations()
    if part == "all" and records.shots:
        survey.facts += (_side_shots(records, settings, places, refused),)
    if places.output is not None:
        survey.reference = Reference(crs=settings.crs, grid=places.output)
    return survey


def _side_shots(
    records: StarnetRecords, settings: StarnetSettings, places: Places, refused: RefusalCollector
) -> SideShots:
    """Observations of side shots, each to a point of its own."""
    names: dict[str, str] = {}
    sources: dict[str, str] = {}
    left_out: dict[str, str] = {}
    sights: list[Sight] = []
    for shot in records.shots:
        quantities = {sight.quantity for sight in shot.sights}
        if not quantities & {Quantity.ANGLE, Quantity.BEARING}:
            left_out[shot.source] = "it has neither an angle nor a bearing"
        elif records.kind == "3D" and not quantities & {Quantity.ZENITH, Quantity.RISE}:
            left_out[shot.source] = "it has neither a zenith angle nor a height difference"
        else:
            key = f"{shot.name} ({shot.source})"
            names[key], sources[key] = shot.name, shot.source
            sights += [sight._replace(to=key) for sight in shot.sights]
    own = StarnetRecords(records.kind, sights=sights)
    builder = _Builder(own, settings, places, refused, "all")
    builder.observations()
    return SideShots(builder.survey, names, sources, left_out)


class _Builder:
    """Adds the observations of a job to its survey."""

    def __init__(
        self,
        records: StarnetRecords,
        settings: StarnetSettings,
        places: Places,
        refused: RefusalCollector,
        part: Part,
    ) -> None:
        self.records, self.settings, self.places = records, settings, places
        self.refused, self.planned = refused, part == "planned"
        # a deflection is an option of grid jobs in space
        space = records.kind == "3D" and settings.grid is not None
        self.leans = space and part != "points" and any(settings.deflection)
        plumb = PlumbField(*settings.deflection) if self.leans else PlumbField()
        self.survey = Survey(site=places.frame.site, plumb=plumb)
        self.sights = self._used(records.sights)
        self.lacking: list[str] = []

    def observed(self) -> set[str]:
        """Names of all points that are observed."""
        out: set[str] = set()
        for sight in self.sights:
            out |= {sight.at, sight.to} | ({sight.back} if sight.back else set())
        for level in self.records.levels:
            out |= {level.at, level.to}
        for vector in self.records.vectors:
            out |= {vector.at, vector.to}
        return out

    def without_heights(self) -> list[str]:
        """Points of a job in space whose height no observation tells, though some tell the rest.

        Directions tell no height, and slope distances tell it where they are steep alone.
        """
        if self.records.kind != "3D":
            return []
        told: set[str] = set()
        for level in self.records.levels:
            told |= {level.at, level.to}
        for vector in self.records.vectors:
            told |= {vector.at, vector.to}
        slopes = [s for s in self.sights if s.quantity is Quantity.SLOPE]
        lengths = self.places.line([(s.at, s.to) for s in slopes])
        # where a coordinate is missing nothing is assumed
        steep = ~(np.abs(lengths[:, 1]) < _STEEP * lengths[:, 0])
        for sight, enough in zip(slopes, steep, strict=True):
            told |= {sight.at, sight.to} if enough else set()
        for sight in self.sights:
            if sight.quantity in (Quantity.ZENITH, Quantity.RISE):
                told |= {sight.at, sight.to}
        untold = {name for s in self.sights for name in (s.at, s.to, s.back)} - told
        return [name for name in self.places.given if name in untold]

    def observations(self) -> None:
        """All observations."""
        for quantity in Quantity:
            sights = [s for s in self.sights if s.quantity is quantity]
            if sights:
                with self.refused.record():
                    self._add_sights(quantity, sights)
        if self.records.levels and self.records.kind != "2D":
            with self.refused.record():
                self._add_levels(self.records.levels)
        elif n := len(self.records.levels):
            self.survey.warnings.append(
                f"the job is in plan (.2D): {n} levelling line{'s take' if n > 1 else ' takes'} "
                "no part"
            )
        if self.records.vectors:
            with self.refused.record():
                self._add_vectors(self.records.vectors)
        if self.lacking:
            n = len(self.lacking)
            self.survey.warnings.append(
                f"the length of {n} sight{'s' if n > 1 else ''} is not known "
                f"({', '.join(self.lacking[:3])}{', ...' if n > 3 else ''}): errors of centring "
                "are left out there; give coordinates of their ends"
            )

    def _used(self, sights: Iterable[Sight]) -> list[Sight]:
        """Sights that say something in a job of this kind; slope distances of a plan made level.

        A scale stretches what is horizontal in slope distances and zenith angles.
        """
        kind = self.records.kind
        out = []
        for sight in sights:
            if sight.scale != 1 and kind == "3D":
                with self.refused.record():
                    sight = self._scaled(sight)
            if kind == "2D" and sight.quantity is Quantity.SLOPE:
                if sight.length is None or sight.value is None:
                    continue
                sight = _levelled(sight)
            if sight.quantity in _USED[kind]:
                out.append(sight)
        return out

    def _scaled(self, sight: Sight) -> Sight:
        """A slope distance or zenith angle in a local system with a scale."""
        if sight.value is None or sight.quantity not in (Quantity.SLOPE, Quantity.ZENITH):
            return sight
        if sight.quantity is Quantity.ZENITH:
            plan, up = np.sin(sight.value), np.cos(sight.value)
            return sight._replace(value=float(np.arctan2(sight.scale * plan, up)))
        rise = sight.rise
        if sight.rise == 0 and sight.length == sight.value:
            # the line has no zenith angle: the coordinates tell how steep it is
            rise = float(self.places.line([(sight.at, sight.to)])[0, 1])
            rise += sight.heights[1] - sight.heights[0]
        if not abs(rise) < sight.value:
            raise InputError(
                f"how steep the line {sight.at} to {sight.to} is nothing tells, and the scale "
                "changes its horizontal part alone",
                record=sight.source,
                cure="give its zenith angle in the same line, or coordinates of its ends",
            )
        plan = np.sqrt(sight.value**2 - rise**2)
        return sight._replace(value=float(np.hypot(sight.scale * plan, rise)))

    def _add_sights(self, quantity: Quantity, sights: list[Sight]) -> None:
        """All sights of one quantity: weighted ones, conditions, check values."""
        if self.planned:
            lengths = self.places.line([(s.at, s.to) for s in sights])
            sights = [_with_place(s, row) for s, row in zip(sights, lengths, strict=True)]
        else:
            self._refuse_planned(sights)
        sigma, lacking = sigmas_of(sights, self.places.line)
        self.lacking += [s.source for s, lacks in zip(sights, lacking, strict=True) if lacks]
        hard = np.isnan(sigma)
        hard &= ~np.array([self._all_held(s) for s in sights])
        # what lies between held points cannot be a condition: it is compared
        check = np.isnan(sigma) & ~hard | np.array([s.sigma is SigmaMark.FREE for s in sights])
        angular = quantity not in (Quantity.SLOPE, Quantity.LEVEL_DISTANCE, Quantity.RISE)
        exact = self.settings.fixed_angle if angular else self.settings.fixed_length
        sigma = np.where(np.isnan(sigma), exact, sigma)
        self._add(_KINDS[quantity], sights, sigma, hard, check, self._columns(quantity, sights))

    def _reduction(self, sight: Sight) -> float:
        """Distance as it is written over the horizontal one on the ground."""
        if not sight.on_grid:
            return 1 / sight.scale
        stretch = self.places.stretch(sight.at, sight.to)
        if stretch is None:
            raise InputError(
                "a distance on the grid has no grid, or neither end has coordinates",
                record=sight.source,
                cure="write .CRS with the code of the grid, and rough coordinates of the points",
            )
        return stretch

    def _all_held(self, sight: Sight) -> bool:
        ends = {sight.at, sight.to, sight.back} - {""}
        return ends <= self.places.held and sight.quantity is not Quantity.DIRECTION

    def _refuse_planned(self, sights: Sequence[Sight | Level | Vector]) -> None:
        """Observations without values are planned."""
        planned = [s for s in sights if (s.delta if isinstance(s, Vector) else s.value) is None]
        if planned:
            raise InputError(
                f"{len(planned)} observations have no values: they are planned",
                record=planned[0].source,
                cure="name the file under observations of [plan] and use tribrach plan",
            )

    def _add(
        self,
        kind: type[Observations],
        records: Sequence[Sight | Level],
        sigma: Array,
        hard: NDArray[np.bool_],
        check: NDArray[np.bool_],
        columns: Mapping[str, Any],
    ) -> None:
        """Add observations, conditions by themselves."""
        values = np.array([record.value for record in records], dtype=float)
        sources = np.array([record.source for record in records], dtype=object)
        whole = {name: np.asarray(column) for name, column in columns.items()}
        for rows, exact in ((~hard, False), (hard, True)):
            if not rows.any():
                continue
            further: dict[str, Any] = {name: column[rows] for name, column in whole.items()}
            if exact:
                further["hard"] = True
            else:
                further["sigma"] = sigma[rows]
                if check[rows].any():
                    use = np.where(check[rows], Use.CHECK, Use.ACTIVE).astype(np.int8)
                    reason = np.where(check[rows], _FREE, "").astype(object)
                    further |= {"use": use, "reason": reason}
            self.survey.add(kind, values=values[rows], source=list(sources[rows]), **further)

    def _columns(self, quantity: Quantity, sights: Sequence[Sight]) -> dict[str, Any]:
        """Names and heights of sights, and what their kind has besides."""

        def names(name: str) -> Array:
            return np.array([getattr(s, name) for s in sights], dtype=object)

        start, end = (
            ("height_start", "height_end")
            if quantity is Quantity.RISE
            else (
                "height_instrument",
                "height_target",
            )
        )
        heights = np.array([s.heights for s in sights])
        out: dict[str, Any] = {"start": names("at"), "end": names("to")}
        if quantity is Quantity.ANGLE:
            out |= {"end": names("back"), "foresight": names("to")}
        if self.records.kind == "3D":
            out |= {start: heights[:, 0], end: heights[:, 1]}
        if quantity is Quantity.DIRECTION:
            out["orientation"] = names("set_name")
        elif quantity is Quantity.BEARING:
            out["convergence"] = self._convergences(sights)
            out["astronomic"] = np.zeros(len(sights))
        elif quantity is Quantity.LEVEL_DISTANCE:
            out["reduction"] = np.array([self._reduction(s) for s in sights])
        elif quantity is Quantity.RISE:
            out |= self._geoid(len(sights))
        elif quantity is Quantity.ZENITH:
            out["refraction"] = np.array([s.refraction for s in sights])
        return out

    def _geoid(self, n: int) -> dict[str, Array]:
        """Geoid heights of n height differences, which the deflection does not tilt."""
        return {name: np.zeros(n) for name in ("geoid_start", "geoid_end")} if self.leans else {}

    def _convergences(self, sights: Sequence[Sight]) -> Array:
        """Azimuth less bearing (n,) of each sight."""
        out = np.zeros(len(sights))
        for i, sight in enumerate(sights):
            found = self.places.convergence(sight.at, sight.to)
            if found is None:
                raise InputError(
                    f"neither {sight.at} nor {sight.to} has coordinates, and the convergence of "
                    "the bearing is not known without",
                    record=sight.source,
                    cure="give approximate coordinates of one of them",
                )
            out[i] = found
        return out

    def _add_levels(self, levels: Sequence[Level]) -> None:
        """Levelled height differences."""
        if not self.planned:
            self._refuse_planned(levels)
        default = np.array([level.default for level in levels])
        given = np.array([s.sigma if isinstance(s.sigma, float) else np.nan for s in levels])
        sigma = np.where(np.isnan(given), default, given)
        held = self.places.held
        fixed = np.array([s.sigma is SigmaMark.FIXED for s in levels])
        hard = fixed & ~np.array([{s.at, s.to} <= held for s in levels])
        check = fixed & ~hard | np.array([s.sigma is SigmaMark.FREE for s in levels])
        sigma = np.where(fixed, self.settings.fixed_length, sigma)
        columns = {
            "start": np.array([level.at for level in levels], dtype=object),
            "end": np.array([level.to for level in levels], dtype=object),
        }
        columns |= self._geoid(len(levels))
        self._add(HeightDifferences, levels, sigma, hard, check, columns)

    def _add_vectors(self, vectors: Sequence[Vector]) -> None:
        """GNSS vectors in the work frame, with their covariances."""
        site = self.places.frame.site
        if not isinstance(site, EllipsoidSite):
            raise InputError(
                "GNSS vectors need the place of the job on the ellipsoid, and it is local",
                record=vectors[0].source,
                cure="give the project of the job, with its grid",
            )
        nowhere = np.zeros(3)
        start = np.array([self.places.xyz.get(v.at, nowhere) for v in vectors])
        start = np.where(np.isnan(start), 0.0, start)
        if self.planned:
            ends = np.array([self.places.xyz.get(v.to, nowhere) for v in vectors])
            values = ends - start
        else:
            self._refuse_planned(vectors)
            values = np.array([v.delta for v in vectors]) @ site.w_from_ecef.T
        lengths = np.linalg.norm(values, axis=1)
        own = np.array([_covariance(v, float(n)) for v, n in zip(vectors, lengths, strict=True)])
        covariance = site.w_from_ecef @ own @ site.w_from_ecef.T
        axes = site.axes(start)
        factors = np.array([(v.factor[0], v.factor[0], v.factor[1]) for v in vectors])
        stretch = np.einsum("nki,nk,nkj->nij", axes, factors, axes)
        covariance = stretch @ covariance @ stretch
        # both ends are centred
        centring = 2 * np.array(
            [(v.centring[0] ** 2, v.centring[0] ** 2, v.centring[1] ** 2) for v in vectors]
        )
        covariance += np.einsum("nki,nk,nkj->nij", axes, centring, axes)
        heights = np.array([v.heights for v in vectors])
        self.survey.add(
            GnssBaselines,
            values=values,
            covariance=(covariance + covariance.transpose(0, 2, 1)) / 2,
            source=[v.source for v in vectors],
            start=[v.at for v in vectors],
            end=[v.to for v in vectors],
            height_start=heights[:, 0],
            height_end=heights[:, 1],
        )


def _covariance(vector: Vector, length: float) -> Array:
    """Covariance (3, 3) [m^2] of a vector along X, Y, Z, as the file has it."""
    if not vector.deviations:
        return np.eye(3) * (vector.default[0] + vector.default[1] * length) ** 2
    couplings = vector.couplings or (0.0, 0.0, 0.0)
    out = np.diag(np.array(vector.deviations))
    for (i, j), coupling in zip(((0, 1), (0, 2), (1, 2)), couplings, strict=True):
        out[i, j] = out[j, i] = coupling
    if vector.covariances:
        return out
    deviations = np.array(vector.deviations)
    np.fill_diagonal(out, 1.0)
    scaled: Array = out * np.outer(deviations, deviations)
    return scaled


def _levelled(sight: Sight) -> Sight:
    """A slope distance with its zenith angle as horizontal distance."""
    return sight._replace(quantity=Quantity.LEVEL_DISTANCE, value=sight.length)


def _with_place(sight: Sight, line: Array) -> Sight:
    """A planned sight with the length and rise that the coordinates tell, and a value by them."""
    length, rise = float(line[0]), float(line[1])
    if not np.isfinite(line).all():
        raise InputError(
            f"{sight.at} or {sight.to} has no coordinates",
            record=sight.source,
            cure="give approximate coordinates of points in planned observations",
        )
    value = {
        Quantity.SLOPE: float(np.hypot(length, rise)),
        Quantity.LEVEL_DISTANCE: length,
        Quantity.ZENITH: float(np.arctan2(length, rise)),
        Quantity.RISE: rise,
    }.get(sight.quantity, 1.0)
    return sight._replace(value=value, length=length, rise=rise)
