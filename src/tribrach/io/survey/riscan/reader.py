"""RiSCAN PRO projects (``.rsp``): scanner stations, reflectors with accuracy, on-board GNSS.

Every scan position becomes a station with six unknowns, every reflector a target centre with the
covariance of its stated accuracies (along and across the beam) plus a floor.

**Names.** A reflector that is linked to control or to another tie point has the name of that one.
Others RiSCAN PRO links by name, but numbers them anew at every scan position, so that a name may
mean two things. Distances between targets do not depend on the station: a reflector
whose distances to the others differ between two stations is not the same one there.

**Frames.** If anything in the project is geocentric, the work frame is East-North-Up at the
centroid of the scanners' GNSS positions and the program's own poses are only start values, because
the heading of its project frame is a convention. Otherwise the work frame is the project's. The
scanners' GNSS positions are observations with an own and a common part (method section 2.6);
control in the global frame is weighted; project tie points are not independent of the reflectors
and are not used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.geometry.alignment import umeyama
from tribrach.io.survey.riscan.links import linked_stations
from tribrach.io.survey.riscan.records import (
    Position,
    RiscanProject,
    ScanPosition,
    TiePoint,
    parse,
)
from tribrach.network.facts import Fact
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.sentences import Sentence
from tribrach.statistics import chi2, norm

# Distances between reflectors are measured; those between the same points of a map projection
# differ from them by its scale and by the height over its surface. A similarity of the reflectors
# of each scan position onto their control (Umeyama 1991) shows that scale, and what it leaves of
# the misfits.

#: error probability of both tests
_ALPHA = 0.001


@dataclass(frozen=True)
class GridScale:
    """Scale of control against measured distances."""

    scale: float  #: control over measurement, less one
    sigma: float  #: its standard deviation
    explains: bool  #: the misfits that remain with the scale are not larger than their sigmas allow

    @property
    def test_value(self) -> float:
        """The scale in terms of its sigma."""
        return abs(self.scale) / self.sigma

    @property
    def limit(self) -> float:
        """What the test value exceeds by chance once in a thousand times."""
        return float(norm.ppf(1 - _ALPHA / 2))

    @property
    def told(self) -> bool:
        """True if there is a scale, and nothing but a scale."""
        return self.explains and self.test_value > self.limit


def grid_scale(
    stations: Sequence[Mapping[str, tuple[Array, Array]]],
    control: Mapping[str, tuple[Array, Array]],
) -> GridScale | None:
    """Scale of control points against the reflectors of scan positions.

    Scan positions share their control, so that their scales are correlated; the mean has the sigma
    of the best of them and not a smaller one.

    ``stations``: place (3,) in the scanner frame [m] and covariance (3, 3) of each reflector, by
    name; ``control``: place (3,) [m] and standard deviations (3,) of each control point, by name.
    """
    scales, sigmas, misfit, dof = [], [], 0.0, 0
    for targets in stations:
        names = [name for name in targets if name in control]
        if len(names) < 3:
            continue
        local = np.array([targets[name][0] for name in names])
        world = np.array([control[name][0] for name in names])
        spread = np.array(
            [np.trace(targets[n][1]) / 3 + np.mean(np.square(control[n][1])) for n in names]
        )
        weight = 1 / spread
        try:
            fit = umeyama(local, world, weight)
        except InputError:
            continue
        around = local - np.average(local, axis=0, weights=weight)
        scales.append(fit.scale - 1)
        sigmas.append(float(1 / np.sqrt(weight @ np.square(around).sum(axis=1))))
        misfit += float(weight @ np.square(world - fit(local)).sum(axis=1))
        dof += 3 * len(names) - 7
    if not scales:
        return None
    weights = 1 / np.square(sigmas)
    explains = misfit <= float(chi2.ppf(1 - _ALPHA, dof))
    return GridScale(float(np.average(scales, weights=weights)), min(sigmas), explains)


def grid_sentence(found: GridScale, crs: str) -> str:
    """What to say of a scale that is there."""
    name = f" ({crs})" if crs else ""
    return Sentence(
        "control fits the measured distances with a scale of {found.scale:ppm+1}, "
        "sigma {found.sigma:ppm1} (test value {found.test_value:1}, limit "
        "{found.limit:2}), and not without: its grid{name} is not Cartesian, as that "
        "of a map projection is not, or all ranges have this scale; no single control "
        "point is wrong by it; give the control in a CSV file of a project whose site "
        "has the crs of the grid",
        found=found,
        name=name,
    )


#: distances between the same two reflectors from two stations differ by less than this [m]
SAME_TARGET = 0.1
#: semi-major axis [m] and flattening of WGS 84
WGS84 = (6378137.0, 1 / 298.257223563)
#: a project frame whose z axis is this close to the vertical stands upright [rad]
UPRIGHT = 3e-4
#: standard deviation added to every coordinate of a target centre [m] (method section 2.2)
TARGET_FLOOR = 0.0005
#: share of a GNSS position's variance that all stations have in common (method section 2.6)
COMMON_SHARE = 0.5
#: standard deviation of control whose accuracy the project does not state [m]
CONTROL_SIGMA = 0.005
#: standard deviation of a tilt from the scanner's inclination sensors [rad], 0.01 degrees
TILT_SIGMA = radians(0.01)
#: reason of what the program has switched off
OFF = "switched off in RiSCAN PRO"


def identities(stations: Sequence[ScanPosition]) -> tuple[list[list[str]], list[str]]:
    """Names of the targets of each station, made different where the targets are."""
    names: list[list[str]] = []
    places: list[dict[str, Array]] = []
    warnings: list[str] = []
    for station in stations:
        vectors = {target.name: target.vector for target in station.targets}
        others: dict[str, str] = {}
        for earlier, place in zip(stations, places, strict=False):
            for name in _different(place, vectors):
                others.setdefault(name, earlier.name)
        for name, earlier_name in others.items():
            warnings.append(
                Sentence(
                    "reflector {name} of {station.name} is not that of {earlier_name}: its "
                    "distances to the others differ by more than {same_target:mg}; it is called "
                    "{name}@{station.name}",
                    name=name,
                    station=station,
                    earlier_name=earlier_name,
                    same_target=SAME_TARGET,
                )
            )
        own = [f"{t.name}@{station.name}" if t.name in others else t.name for t in station.targets]
        names.append(own)
        places.append({n: t.vector for n, t in zip(own, station.targets, strict=True)})
    return names, warnings


def _different(a: dict[str, Array], b: dict[str, Array]) -> list[str]:
    """Common names whose distances to most other common names disagree."""
    common = [name for name in b if name in a]
    if len(common) < 2:
        return []
    gap = np.abs(_distances(a, common) - _distances(b, common))
    np.fill_diagonal(gap, np.nan)
    middle = np.nanmedian(gap, axis=1)
    return [name for name, value in zip(common, middle, strict=True) if value > SAME_TARGET]


def _distances(places: dict[str, Array], names: Sequence[str]) -> Array:
    """Distances (n, n) [m] between named places."""
    xyz = np.array([places[name] for name in names])
    out: Array = np.linalg.norm(xyz[:, None] - xyz[None], axis=2)
    return out


def is_geocentric(vector: Array) -> bool:
    """True if a vector (3,) [m] is as long as that of a place near the Earth's surface."""
    return bool(6.3e6 < np.linalg.norm(vector) < 6.42e6)


class Frames:
    """The work frame W of a project, and the motions from the project's frames to it.

    ``upright``: the project's z axis is known to be vertical; ``w_from_prcs`` (4, 4): from the
    project's frame to W.
    """

    def __init__(self, project: RiscanProject) -> None:
        self.project = project
        pop = np.eye(4) if project.pop is None else project.pop
        places = [
            s.position.vector
            for s in project.stations
            if s.position is not None and is_geocentric(s.position.vector)
        ]
        control = [p.vector for p in project.glcs if is_geocentric(p.vector)]
        origin = [pop[:3, 3]] if is_geocentric(pop[:3, 3]) else []
        # control in a projected or local frame cannot be joined with geocentric positions
        local = bool(project.glcs) and not control
        geocentric = [] if local else places or control or origin
        self.site: EllipsoidSite | FlatSite = FlatSite()
        self.upright = False
        #: (4, 4) from the project's frame to W
        self.w_from_prcs = pop if project.glcs else np.eye(4)
        if geocentric:
            self.site = EllipsoidSite.centred(np.array(geocentric), WGS84)
            self.w_from_prcs = self._oriented(self.site, pop, bool(origin))
            self.upright = bool(origin) and self.w_from_prcs[2, 2] > np.cos(UPRIGHT)
            self._to_gnss(self.site)

    def _oriented(self, site: EllipsoidSite, pop: Array, known: bool) -> Array:
        """Project frame in W by the POP, or as an East-North-Up frame if the POP is not known."""
        out = np.eye(4)
        if known:
            out[:3, :3] = site.w_from_ecef @ pop[:3, :3]
            out[:3, 3] = site.from_ecef(pop[None, :3, 3])[0]
        return out

    def _to_gnss(self, site: EllipsoidSite) -> None:
        """Turn about the vertical and shift the project so that it fits the GNSS positions."""
        both = [
            (s.sop[:3, 3], s.position.vector)
            for s in self.project.stations
            if s.sop is not None
            and s.registered
            and s.position is not None
            and s.position.enabled
            and is_geocentric(s.position.vector)
        ]
        if not both:
            return
        here = np.array([p for p, _ in both]) @ self.w_from_prcs[:3, :3].T
        there = site.from_ecef(np.array([g for _, g in both]))
        a, b = here - here.mean(axis=0), there - there.mean(axis=0)
        turn = np.arctan2(
            np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a[:, :2] * b[:, :2])
        )
        rotation = np.eye(3)
        rotation[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        self.w_from_prcs[:3, :3] = rotation @ self.w_from_prcs[:3, :3]
        self.w_from_prcs[:3, 3] = there.mean(axis=0) - rotation @ here.mean(axis=0)

    @property
    def geocentric(self) -> bool:
        """True if W is tied to the Earth."""
        return isinstance(self.site, EllipsoidSite)

    def start(self, station: ScanPosition) -> tuple[Array, Array]:
        """Start values: World from scanner, translation (3,) [m], rotation (3, 3); NaN if none."""
        if station.sop is None or not station.registered:
            return np.full(3, np.nan), np.full((3, 3), np.nan)
        pose = self.w_from_prcs @ station.sop
        return pose[:3, 3], pose[:3, :3]

    def from_ecef(self, xyz: Array) -> Array:
        """W coordinates (n, 3) of ECEF positions (n, 3); only with geocentric positions."""
        assert isinstance(self.site, EllipsoidSite)
        return self.site.from_ecef(xyz)

    def from_global(self, vector: Array) -> Array:
        """W coordinates (3,) of a vector (3,) of the global frame."""
        if isinstance(self.site, EllipsoidSite):
            inside: Array = self.site.from_ecef(vector[None])[0]
            return inside
        return vector

    def global_covariance(self, sigma: Array) -> Array:
        """Covariance (3, 3) in W from standard deviations (3,) along the global axes."""
        if isinstance(self.site, EllipsoidSite):
            r = self.site.w_from_ecef
            out: Array = r @ np.diag(sigma**2) @ r.T
            return out
        return np.diag(sigma**2)


@dataclass(frozen=True)
class RiscanFacts(Fact):
    """What a RiSCAN PRO project says besides its observations."""

    project: str  #: its name
    #: conditions of the atmosphere by scan position, as the project writes them
    conditions: Mapping[str, Mapping[str, str]]


def read(path: Path) -> Survey:
    """Survey of a project file."""
    project = parse(path)
    linked, warnings = linked_stations(project)
    project = replace(project, stations=tuple(linked))
    frames = Frames(project)
    survey = Survey(site=frames.site)
    survey.warnings += warnings
    stations = _stations(survey, project, frames)
    conditions = {station.name: station.conditions for station in stations}
    survey.facts = (RiscanFacts(project.name, conditions),)
    names = _targets(survey, stations)
    positions = _positions(survey, stations, frames)
    tilts = _tilts(survey, stations, frames)
    control = _control(survey, project, frames)
    if not frames.geocentric:
        survey.warnings[:0] = _grid(project, stations, names)
    if control < 3 and not (positions >= 3 or (positions == 2 and tilts)):
        survey.datum = Datum("free")
        survey.warnings.append(
            "the project has neither three control points nor enough GNSS positions: what they "
            "leave open is closed by inner constraints on the start positions"
        )
    return survey


def _stations(survey: Survey, project: RiscanProject, frames: Frames) -> list[ScanPosition]:
    """Scan positions with reflectors become stations; the others are named in a warning."""
    used = [station for station in project.stations if station.targets]
    for station in project.stations:
        if not station.targets:
            survey.warnings.append(
                f"{station.source}: scan position {station.name} has no reflectors and is left out"
            )
    for station in used:
        translation, rotation = frames.start(station)
        survey.station(
            station.name,
            translation=translation,
            rotation=rotation,
            source=station.source,
        )
    if project.prcs:
        survey.warnings.append(
            f"{len(project.prcs)} tie points of the project frame are not used: they come from "
            "the same reflectors"
        )
    return used


def _grid(
    project: RiscanProject, stations: Sequence[ScanPosition], names: Sequence[Sequence[str]]
) -> list[str]:
    """The grid of the control is not Cartesian, if reflectors show that it explains all."""
    seen = [
        {
            name: (target.vector, _covariance(target))
            for name, target in zip(own, station.targets, strict=True)
            if target.active
        }
        for own, station in zip(names, stations, strict=True)
    ]
    given = {
        point.name: (point.vector, _control_sigma(point)) for point in project.glcs if point.active
    }
    found = grid_scale(seen, given)
    return [grid_sentence(found, project.crs)] if found is not None and found.told else []


def _control_sigma(point: TiePoint) -> Array:
    """Standard deviations (3,) of a control point [m]."""
    return point.accuracy if point.accuracy is not None else np.full(3, CONTROL_SIGMA)


def _targets(survey: Survey, stations: Sequence[ScanPosition]) -> list[list[str]]:
    """All reflectors as target centres; returns their names by station."""
    names, warnings = identities(stations)
    survey.warnings += warnings
    with RefusalCollector() as refused:
        for target in (target for station in stations for target in station.targets):
            with refused.record():
                _covariance(target)
    for station, targets in zip(stations, names, strict=True):
        active = np.array([target.active for target in station.targets])
        survey.add(
            TargetCentres,
            values=np.array([target.vector for target in station.targets]),
            covariance=np.array([_covariance(target) for target in station.targets]),
            station=[station.name] * len(targets),
            target=targets,
            source=[target.source for target in station.targets],
            use=np.where(active, Use.ACTIVE, Use.OFF).astype(np.int8),
            reason=np.where(active, "", OFF).astype(object),
            group="reflectors",
        )
    return names


def _covariance(target: TiePoint) -> Array:
    """Covariance (3, 3) [m^2] in the scanner frame: along the beam, across it, and the floor.

    The two lateral accuracies are equal in all projects seen. If they differed the larger would be
    taken for both, because the file does not say which is which.
    """
    if target.accuracy is None or not (target.accuracy > 0).all():
        raise target.error(f"reflector {target.name} has no accuracy above zero")
    along, lateral = target.accuracy[0], target.accuracy[1:].max()
    beam = target.vector if target.direction is None else target.direction
    length = float(np.linalg.norm(beam))
    if length == 0:
        raise target.error(f"reflector {target.name} lies at the scanner's origin")
    line = np.outer(beam, beam) / length**2
    out: Array = along**2 * line + lateral**2 * (np.eye(3) - line) + TARGET_FLOOR**2 * np.eye(3)
    return out


def _positions(survey: Survey, stations: Sequence[ScanPosition], frames: Frames) -> int:
    """Add the GNSS positions of the scanners, correlated.

    They belong to the antenna; its decimetres from the scanner's origin are far below the metres of
    such positions.
    """
    named = []
    for station in stations:
        p = station.position
        if p is None:
            continue
        why = _unusable(p, frames)
        if why:
            survey.warnings.append(
                f"{p.source}: the GNSS position of {station.name} is not used: {why}"
            )
            continue
        named.append((station.name, p))
    if not named:
        return 0
    sigma = np.array([p.accuracy for _, p in named])
    enabled = np.array([p.enabled for _, p in named])
    among = COMMON_SHARE * np.outer(sigma, sigma) + (1 - COMMON_SHARE) * np.diag(sigma**2)
    n = len(named)
    table = survey.add(
        GnssPositions,
        values=frames.from_ecef(np.array([p.vector for _, p in named])),
        covariance=sigma[:, None, None] ** 2 * np.eye(3),
        position=[name for name, _ in named],
        source=[p.source for _, p in named],
        use=np.where(enabled, Use.ACTIVE, Use.OFF).astype(np.int8),
        reason=np.where(enabled, "", OFF).astype(object),
        group="on-board GNSS",
    )
    if n > 1:
        item, row = np.divmod(np.arange(3 * n), 3)
        survey.correlate(np.full(3 * n, table), item, row, np.kron(among, np.eye(3)))
    return int(enabled.sum())


def _unusable(position: Position, frames: Frames) -> str:
    """Why a GNSS position cannot be used, empty if it can."""
    if not is_geocentric(position.vector):
        return f"it is not geocentric (coordinate system {position.system or 'not named'})"
    if not frames.geocentric:
        return "the control is in a local frame that it cannot be transformed to"
    return "" if position.accuracy > 0 else "its accuracy is not stated"


def _tilts(survey: Survey, stations: Sequence[ScanPosition], frames: Frames) -> int:
    """Inclinations of the stations whose SOP is roll and pitch without yaw.

    The program sets such a pose from the inclination sensors before anything is registered; in
    a registered pose the yaw is not exactly zero. It needs a project frame that stands upright.
    """
    levelled = [s for s in stations if frames.upright and _without_yaw(s)]
    if not levelled:
        return 0
    up = np.array([s.sop[2, :3] for s in levelled if s.sop is not None])
    survey.add(
        Inclinations,
        values=up[:, :2] / up[:, 2:],
        sigma=np.full((len(levelled), 2), TILT_SIGMA),
        station=[s.name for s in levelled],
        source=[s.source for s in levelled],
        group="inclination sensors",
    )
    names = ", ".join(s.name for s in levelled)
    survey.warnings.append(
        Sentence(
            "the tilt of {names} is taken from the inclination sensors with a standard "
            "deviation of {tilt_sigma:degreesg}: its SOP is roll and pitch without yaw",
            names=names,
            tilt_sigma=TILT_SIGMA,
        )
    )
    return len(levelled)


def _without_yaw(station: ScanPosition) -> bool:
    if station.sop is None:
        return False
    r = station.sop[:3, :3]
    return r[1, 0] == 0.0 and r[0, 0] > 0 and not np.array_equal(r, np.eye(3))


def _control(survey: Survey, project: RiscanProject, frames: Frames) -> int:
    """Global tie points as weighted control; returns their number."""
    for point in project.glcs:
        sigma = _control_sigma(point)
        if not (sigma > 0).all():
            raise point.error(f"control point {point.name} has no accuracy above zero")
        if point.height:
            survey.warnings.append(
                Sentence(
                    "{point.source}: the height {point.height:mg} of control point {point.name} is "
                    "not applied: its coordinates are taken as those of the reflector",
                    point=point,
                )
            )
        if not point.active:
            survey.warnings.append(f"{point.source}: control point {point.name} is {OFF}")
            continue
        survey.point(
            point.name,
            frames.from_global(point.vector),
            covariance=frames.global_covariance(sigma),
            role="control",
            source=point.source,
        )
    if any(point.accuracy is None for point in project.glcs):
        survey.warnings.append(
            Sentence(
                "control points without accuracy are given {control_sigma:mmg}",
                control_sigma=CONTROL_SIGMA,
            )
        )
    return sum(point.active for point in project.glcs)
