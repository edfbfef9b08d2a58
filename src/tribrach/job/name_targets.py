"""From detections to observations of the network: names, approximate poses, target centres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.geometry.polar import polar_by_xyz, polar_from_xyz
from tribrach.geometry.pose import Pose
from tribrach.instruments.precision import covariance_of_readings
from tribrach.job.board_orientation import BoardSighting, correlate_boards
from tribrach.job.decided_targets import names_by_hand, with_names
from tribrach.job.edits import decided_marks
from tribrach.job.find_targets import NOTHING, Findings, merged
from tribrach.job.mounted_antennas import mounted_antennas
from tribrach.job.plausibility import after_doubts
from tribrach.job.polar_targets import Sighted, observe_readings
from tribrach.job.scans import StationScan
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.gross import explain
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.control import Offsets
from tribrach.observations.scanner import ScannerPolar, TargetCentres
from tribrach.project.edits import Edits
from tribrach.registration.identify import Identification, Sighting, identify
from tribrach.targets.detection import Detection
from tribrach.units import MM

if TYPE_CHECKING:
    from tribrach.job.opened import Job


@dataclass(frozen=True)
class NamingGates:
    """What names and coordinates that the user gives are taken for; chosen by hand, no source."""

    #: a target that the user names lies within this distance of the place given [m]
    named_within_m: float = 0.5
    unknown_sigma_m: float = 0.05  #: sigma of given coordinates that come without one [m]


GATES = NamingGates()


@dataclass(frozen=True)
class Named:
    """Targets of all stations with their names.

    targets : station to detections; identification : their names, by station in the same order,
    and approximate poses; survey : stations and observations of target centres.
    """

    targets: Mapping[str, Sequence[Detection]]
    identification: Identification
    survey: Survey


def name_targets(
    job: Job,
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    groups: Sequence[Mapping[str, Pose]] = (),
    *,
    partial: bool = False,
) -> Named:
    """Match all detections to the points of the survey and to each other.

    groups : stations whose poses relative to each other are known, each in a frame of its own;
    partial : a station that cannot be placed is left to others.
    """
    targets = merged(findings)
    surveyed, stations = job.survey, job.project.stations
    points = known_points(surveyed, job.edits)
    mounted = mounted_antennas(job, surveyed, points)
    on_scanners = {name for section in stations.values() for name in section.mounted_point}
    points = {name: known for name, known in points.items() if name not in on_scanners}
    first = {scan.station: scan for scan in reversed(scans)}
    by_hand = names_by_hand(job.edits, targets, scans)
    sightings = [
        Sighting(
            station=station,
            centers=np.array([d.center for d in detections]).reshape(-1, 3),
            sigmas=np.array([np.sqrt(np.trace(d.covariance) / 3) for d in detections]),
            kinds=[d.kind for d in detections],
            levelled=first[station].levelled,
            known=_given_names(station, detections, scans, by_hand.get(station, {})),
            mounted=mounted.get(station, ()),
        )
        for station, detections in targets.items()
        if detections
    ]
    antennas = any(section.lever_arm for section in stations.values())
    try:
        identification = identify(sightings, points, free=antennas, groups=groups, partial=partial)
    except InputError as error:
        raise after_doubts(error, job.project, surveyed) from error
    if by_hand:
        decided = with_names(identification.names, by_hand)
        identification = replace(identification, names=decided)
    survey = Survey(site=surveyed.site)
    boards: list[BoardSighting] = []
    for station in identification.poses:
        survey.station(station, source=f"scan {station}")
    for station, names in identification.names.items():
        if job.calibrations.has(station):
            detections = zip(names, targets[station], strict=True)
            own = {name: d for name, d in detections if name}
            sighted = observe_readings(survey, station, own, scans, findings)
        else:
            sighted = _observe(survey, station, names, targets[station], scans)
        if sighted:
            _hold_out(survey, job.edits, sighted)
            boards += _boards(survey, sighted, identification.poses[station])
    correlate_boards(survey, boards, job.project.targets.orientation_mm * MM)
    return Named(targets, identification, survey)


def named_centres(
    job: Job, scans: Sequence[StationScan], findings: Sequence[Findings]
) -> dict[str, dict[str, Array]]:
    """Centres (3,) in the frame of each station of the targets that the user named [m]."""
    targets = merged(findings)
    by_hand = names_by_hand(job.edits, targets, scans)
    out = {}
    for station, detections in targets.items():
        if not detections:
            continue
        names = _given_names(station, detections, scans, by_hand.get(station, {}))
        out[station] = {name: np.asarray(detections[k].center) for k, name in names.items()}
    return out


def _observe(
    survey: Survey,
    station: str,
    names: Sequence[str],
    detections: Sequence[Detection],
    scans: Sequence[StationScan],
) -> Sighted:
    """Target centres of one station, and what they are; targets without a name tie nothing.

    A fit averages the noise of the points only: what the angles are wrong by for the whole target
    is added to it (method section 2.2).
    """
    named = [(name, d) for name, d in zip(names, detections, strict=True) if name]
    if not named:
        return ()
    systematic = {scan.name: scan.noise.systematic for scan in scans if scan.noise is not None}
    centres = np.array([d.center for _, d in named])
    angle = np.array([systematic.get(d.scan, 0.0) for _, d in named])
    common = covariance_of_readings(
        polar_from_xyz(centres), np.stack([np.zeros(len(angle)), angle, angle], axis=1)
    )
    survey.add(
        TargetCentres,
        values=centres,
        covariance=np.array([d.covariance for _, d in named]) + common,
        station=[station] * len(named),
        target=[name for name, _ in named],
        source=[f"{d.scan}: {d.kind}" for _, d in named],
    )
    return named


def _hold_out(survey: Survey, edits: Edits, sighted: Sighted) -> None:
    """Compare what was picked as check only, in the last table of a survey."""
    checks = {(pick.scan, pick.name) for pick in edits.pick if pick.use == "check"}
    use = [Use.CHECK if (d.scan, name) in checks else Use.ACTIVE for name, d in sighted]
    if Use.CHECK in use:
        survey.tables()[-1].columns["use"] = np.array(use)


def _boards(survey: Survey, sighted: Sighted, pose: Pose) -> list[BoardSighting]:
    """The boards among what the last table of a survey observes."""
    number = len(survey.tables()) - 1
    polar = survey.tables()[number].kind is ScannerPolar
    centres = np.array([d.center for _, d in sighted])
    by_place = polar_by_xyz(centres) if polar else np.broadcast_to(np.eye(3), (len(centres), 3, 3))
    return [
        BoardSighting(number, item, name, d, pose, by_place[item])
        for item, (name, d) in enumerate(sighted)
        if d.kind == "checkerboard"
    ]


def known_points(survey: Survey, edits: Edits = NOTHING) -> dict[str, tuple[Array, float]]:
    """Coordinates and one sigma [m] of known points that may be targets.

    The survey is adjusted by itself where that is possible; else the given coordinates serve. A
    mark that a target stands over is none itself. What was decided by hand holds here as well.
    """
    marks = survey.named(Offsets, "start") - survey.named(Offsets, "end")
    return {name: known for name, known in _known(survey, edits).items() if name not in marks}


def _known(survey: Survey, edits: Edits) -> dict[str, tuple[Array, float]]:
    """Coordinates and one sigma of all points.

    What was decided by hand may leave marks to the scans; they are looked for where they lie
    without the decisions.
    """
    decided = decided_marks(survey, edits)
    try:
        alone = adjust(decided.network())
    except (AdjustmentError, InputError):
        return _known_as_measured(survey) if edits.edit or edits.role else _given(survey)
    slip = explain(alone.network, alone)
    if slip is not None:
        raise InputError(slip.sentence(), cure=slip.cure)
    return _given(survey) | _adjusted(alone)


def marks_are_open(survey: Survey, edits: Edits) -> bool:
    """True if what was measured of marks, as it was decided, cannot be adjusted by itself."""
    marks = decided_marks(survey, edits)
    if not marks.tables():
        return False
    try:
        adjust(marks.network())
    except (AdjustmentError, InputError):
        return True
    return False


def _known_as_measured(survey: Survey) -> dict[str, tuple[Array, float]]:
    """Coordinates and one sigma of all points, whatever was decided by hand."""
    try:
        return _given(survey) | _adjusted(adjust(survey.of_marks().network()))
    except (AdjustmentError, InputError):
        return _given(survey)


def _adjusted(alone: Adjustment) -> dict[str, tuple[Array, float]]:
    """Coordinates and one sigma of the points of an adjusted network."""
    covariances = alone.position_covariances()
    names = alone.layout.names["point"]
    sigmas = np.sqrt(np.maximum(np.einsum("nii->n", covariances[: len(names)]) / 3, 0))
    return {
        name: (xyz, float(sigma))
        for name, xyz, sigma in zip(names, alone.state.points, sigmas, strict=True)
        if np.isfinite(xyz).all()
    }


def _given(survey: Survey) -> dict[str, tuple[Array, float]]:
    """Coordinates as they are given, check points as well."""
    out = {}
    for name, point in survey.points.items():
        if np.isfinite(point.xyz).all():
            c = point.covariance
            sigma = GATES.unknown_sigma_m if c is None else float(np.sqrt(np.trace(c) / 3))
            out[name] = (point.xyz, sigma)
    return out


def _given_names(
    station: str,
    detections: Sequence[Detection],
    scans: Sequence[StationScan],
    by_hand: Mapping[int, str],
) -> dict[int, str]:
    """Detection numbers of the targets that the user named, in the project or by hand."""
    out: dict[int, str] = {}
    for scan in scans:
        if scan.station != station:
            continue
        for name, near in scan.names.items():
            distance = [float(np.linalg.norm(d.center - np.array(near))) for d in detections]
            i = int(np.argmin(distance))
            if distance[i] > GATES.named_within_m:
                raise InputError(
                    f"no target was found within {GATES.named_within_m} m of the place given for "
                    f"{name}",
                    file=scan.scan.path,
                    cure="see the detections of the station in the report",
                )
            out[i] = name
    taken = set(by_hand.values())
    return {k: name for k, name in out.items() if name not in taken} | dict(by_hand)
