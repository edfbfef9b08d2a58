"""What ties the stations of a project to each other: targets, planes, clouds, all in one network.

Planes and clouds join stations without targets and approximate poses; what they join is matched to
the known points as one. A station that they leave open is placed by its targets: once a first
adjustment has its pose to millimetres, its planes are tied to those of the others as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.site import Site
from tribrach.geometry.pose import Pose
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses, approximate_poses
from tribrach.job.cloud_pairs import (
    CloudPairs,
    StationSurfels,
    cloud_pairs,
    contradicted,
    observable,
)
from tribrach.job.find_planes import surroundings
from tribrach.job.find_targets import Findings
from tribrach.job.name_targets import Named, known_points, name_targets, named_centres
from tribrach.job.plausibility import after_doubts
from tribrach.job.references import OnReferences, placed_on_references
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.network.adjustment import adjust
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.planes import FittedPlanes
from tribrach.registration.alternatives import ApproximateSigma, Witnesses
from tribrach.registration.clouds.graph import CloudEdge, observe
from tribrach.registration.clouds.reference import ReferencePlace
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import PairPoses, information, pair_poses
from tribrach.registration.planes.stations import PlaneRegistration, register_by_planes
from tribrach.registration.planes.ties import PlaneTies, tie_planes
from tribrach.registration.views import StationView, Surroundings
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence
from tribrach.units import MM, SEC


def remembered_pairs(state: Remembered) -> Callable[[Surroundings, Surroundings], PairPoses]:
    """What finds the poses of a pair, or recalls them where both stations are as they were."""
    marks: dict[str, str] = {}

    def mark(station: Surroundings) -> str:
        if station.name not in marks:
            marks[station.name] = state.key(Surroundings, station)
        return marks[station.name]

    def pair(first: Surroundings, second: Surroundings) -> PairPoses:
        key = state.key(pair_poses, mark(first), mark(second))
        product = f"planes-{first.name}-{second.name}"
        return state.once(product, key, PairPoses, lambda: pair_poses(first, second))

    return pair


if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.project import Project

#: adjusted poses may be wrong by this where planes are tied between groups [m]; chosen by hand on
#: the simulated yards, no source
_ADJUSTED_POSE_M = 0.004


@dataclass(frozen=True, eq=False)
class Tying:
    """What there is to tie.

    network : makes the network of the project and a further survey; site : of the survey; targets :
    observations of target centres, None if there are none; stations : with the planes to tie;
    edges : relative poses from clouds; groups : stations whose relative poses are sharp already;
    references : what edges may begin at.
    """

    network: Callable[[Survey], Network]
    site: Site
    targets: Survey | None
    stations: Sequence[Surroundings]
    edges: Sequence[CloudEdge]
    groups: Sequence[Mapping[str, Pose]]
    references: Sequence[ReferencePlace] = ()

    def tied(
        self, poses: Mapping[str, Pose], *, framed: bool
    ) -> tuple[Survey, PlaneTies, Mapping[str, Pose]]:
        """The survey with planes and clouds, surfaces in common, and poses.

        Planes are tied within the groups, then between all stations: poses from the matching of
        targets are too coarse to tell a wall from a window in it. framed : the poses are in the
        frame of the survey and serve as start values.
        """
        ties = tie_planes(self.stations, poses, groups=self.groups)
        survey = self._survey(ties, poses, framed=framed)
        whole = len(self.groups) == 1 and len(self.groups[0]) == len(poses)
        if whole or not self.stations:
            return survey, ties, poses
        try:
            first = adjust(self.network(survey))
        except AdjustmentError:
            return survey, ties, poses
        state, layout = first.state, first.layout
        at = {name: layout.index("pose", name) for name in poses}
        poses = {name: Pose(state.pose_r[k], state.pose_t[k]) for name, k in at.items()}
        ties = tie_planes(self.stations, poses, _ADJUSTED_POSE_M)
        return self._survey(ties, poses, framed=True), ties, poses

    def _survey(self, ties: PlaneTies, poses: Mapping[str, Pose], *, framed: bool) -> Survey:
        """Stations, targets, surfaces and relative poses."""
        survey = Survey(site=self.site)
        if self.targets is not None:
            survey.merge(self.targets)
        for name, pose in poses.items():
            if name not in survey.stations:
                survey.station(name, source=f"scan {name}")
            if framed:
                known = survey.stations[name]
                survey.stations[name] = replace(
                    known, translation=pose.translation, rotation=pose.rotation
                )
        plane_factor, cloud_factor = self._factors(ties, poses)
        if len(ties.surface):
            self._planes(survey, ties, plane_factor, framed=framed)
        for place in self.references:
            place.observe(survey)
        observe(survey, observable(self.edges, survey.stations, cloud_factor))
        return survey

    def _factors(self, ties: PlaneTies, poses: Mapping[str, Pose]) -> tuple[float, float]:
        """Factors of the covariances of planes and of clouds where both are used.

        Both are taken from the same points. Counted with the weights w and 1 - w in the ratio of
        what either knows of a pair (the sixth root of the determinants of their information, the
        median over the pairs), two equal ones know as much together as one of them, and next to a
        better one a worse one adds hardly anything.
        """
        planes = {s.name: s.planes for s in self.stations}
        ratios = []
        for edge in self.edges:
            pairs = ties.pairs.get((edge.first, edge.second))
            if pairs is None or not len(pairs):
                continue
            one, two = planes[edge.first], planes[edge.second]
            between = poses[edge.first].inverse @ poses[edge.second]
            matrix, _ = information(one, two, pairs, between)
            sign, size = np.linalg.slogdet(matrix)
            if sign > 0:
                ratios.append((size + np.linalg.slogdet(edge.covariance)[1]) / 6)
        if not ratios:
            return 1.0, 1.0
        ratio = float(np.exp(np.clip(np.median(ratios), -20, 20)))
        return (1 + ratio) / ratio, 1 + ratio

    def _planes(self, survey: Survey, ties: PlaneTies, shared: float, *, framed: bool) -> None:
        """Surfaces that several stations see, and how each station fitted them."""
        names = [f"plane {k + 1}" for k in range(len(ties.normal))]
        if framed:
            for name, normal, offset in zip(names, ties.normal, ties.offset, strict=True):
                survey.planes[name] = (normal, float(offset))
        planes = {s.name: s.planes for s in self.stations}
        rows = [(planes[name], k) for name, k in zip(ties.station, ties.number, strict=True)]
        survey.add(
            FittedPlanes,
            values=np.zeros((len(rows), 3)),
            covariance=shared * np.array([p.covariance[k] for p, k in rows]),
            station=list(ties.station),
            plane=[names[k] for k in ties.surface],
            normal=np.array([p.normal[k] for p, k in rows]),
            centroid=np.array([p.center[k] for p, k in rows]),
            source=[f"{p.scans[k]}: plane" for p, k in rows],
        )


@dataclass(frozen=True, eq=False)
class Registered:
    """All that ties the scans of a project to each other.

    survey : what the scans add to the survey; named : their targets, None if none are sought;
    stations : planes and views, empty without planes and clouds; ties : surfaces in common, None
    if planes are not used; poses : approximate, in one frame; sentences : how stations were
    placed and what was not used; references : what they were placed on.
    """

    survey: Survey | None
    named: Named | None
    stations: Sequence[Surroundings] = ()
    ties: PlaneTies | None = None
    poses: Mapping[str, Pose] | None = None
    sentences: tuple[str, ...] = ()
    references: OnReferences = OnReferences()


def register(
    job: Job,
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    known: ApproximatePoses,
    state: Remembered,
    progress: Callable[[str, int, int | None], None],
) -> Registered:
    """Names, approximate poses and observations of all stations; known as :func:`known_poses`."""
    project = job.project
    by = project.registration.by
    with_targets = bool(("targets" in by and project.targets.wanted) or job.edits.pick)
    if by == ("targets",) and not project.reference:
        named = name_targets(job, scans, findings) if with_targets else None
        return Registered(None if named is None else named.survey, named)
    around = _stations(project, scans, state, progress)
    settings = project.registration
    floor = settings.cloud_floor_mm * MM, settings.cloud_floor_arcsec * SEC
    clouds = None
    witnesses = _witnesses(job, scans, findings, known, with_targets)
    surfels: StationSurfels | None = None
    if "clouds" in by or project.reference:
        surfels = StationSurfels(scans, state, progress)
    if surfels is not None and "clouds" in by:
        clouds = cloud_pairs(
            surfels, floor, state, progress, known, settings.cloud_pairs, witnesses
        )
    joined = register_by_planes(
        around,
        lambda k, n: progress("pairs of stations by planes", k, n),
        () if clouds is None else clouds.joints,
        _by_targets(job, scans, findings) if with_targets else None,
        doubtful=() if clouds is None else clouds.open,
        witnesses=witnesses,
        choice=settings.cloud_pairs,
        pair=remembered_pairs(state),
    )
    groups = [group for group in joined.groups if len(group) > 1]
    named = name_targets(job, scans, findings, groups, partial=True) if with_targets else None
    poses, adrift = _poses(named, joined)
    references = OnReferences()
    if surfels is not None and project.reference:
        near = _near(job, known, {} if adrift else poses)
        references = placed_on_references(job, surfels, near, poses, floor, state, progress)
        poses, adrift = references.frame(poses, groups, adrift=adrift)
    surveyed = job.survey
    obstacles = _obstacles(by, joined, clouds, references)
    try:
        _refuse_lost(surveyed, scans, poses, joined, obstacles, named)
    except InputError as error:
        raise after_doubts(error, project, surveyed) from error
    framed = not adrift or (project.datum.kind == "free" and not surveyed.points)
    edges, wrong = _believed(() if clouds is None else clouds.edges, references, poses)
    tying = Tying(
        job.network,
        surveyed.site,
        None if named is None else named.survey,
        around if "planes" in by else (),
        edges,
        groups,
        references.places,
    )
    survey, ties, poses = tying.tied(poses, framed=framed)
    if named is not None:
        named = replace(named, survey=survey)
    sentences = (*_sentences(joined, obstacles, ties, clouds, poses), *wrong)
    sentences += references.sentences
    tied = ties if "planes" in by else None
    return Registered(survey, named, around, tied, poses, sentences, references)


def known_poses(job: Job, scans: Sequence[StationScan]) -> ApproximatePoses:
    """Approximate poses of the stations, as the project says where from."""
    settings = job.project.registration
    used = settings.by != ("targets",) or job.project.reference
    if not used or not (settings.approximate or settings.poses):
        return NO_POSES
    for k, name in enumerate(settings.poses):
        if not (job.folder / name).exists():
            keys = ("registration", "poses", k)
            raise job.error(keys, f"there is no file or folder {name}", "check its name")
    sigma = ApproximateSigma(settings.pose_sigma_m, float(np.radians(settings.pose_sigma_deg)))
    stations: dict[str, list[Scan]] = {}
    for scan in scans:
        stations.setdefault(scan.station, []).append(scan.scan)
    # what the scans of a station do not have in common says nothing of it
    named = {
        name: replace(parts[0], pose=None if _differ(parts) else parts[0].pose)
        for name, parts in stations.items()
    }
    return approximate_poses(named, [job.folder / name for name in settings.poses], sigma)


def _near(job: Job, known: ApproximatePoses, poses: Mapping[str, Pose]) -> ApproximatePoses:
    """Approximate poses in the frame of the network, those of targets before others."""
    frame = job.frame
    if frame.grid is None:
        return replace(known, poses={**known.poses, **poses})
    own = OutputFrame(frame, "projected")
    turned = {}
    for name, pose in known.poses.items():
        there = frame.from_own(pose.translation[None])[0][0]
        turned[name] = Pose(own.rotation(there).T @ pose.rotation, there)
    return replace(known, poses={**turned, **poses})


def _differ(scans: Sequence[Scan]) -> bool:
    """Have scans of one station several poses in their headers?"""
    poses = [scan.pose.matrix for scan in scans if scan.pose is not None]
    return bool(poses) and not all(np.allclose(pose, poses[0]) for pose in poses)


def _witnesses(
    job: Job,
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    known: ApproximatePoses,
    with_targets: bool,
) -> Witnesses:
    """What decides between places that look alike: approximate poses, and targets with names."""
    targets = named_centres(job, scans, findings) if with_targets else {}

    def points() -> Mapping[str, Array]:
        return {name: xyz for name, (xyz, _) in known_points(job.survey, job.edits).items()}

    return Witnesses(known.poses, known.sigma, targets, points)


def _by_targets(
    job: Job, scans: Sequence[StationScan], findings: Sequence[Findings]
) -> Mapping[str, Pose]:
    """Poses of the stations that their own targets place."""
    return name_targets(job, scans, findings, partial=True).identification.poses


def _believed(
    clouds: Sequence[CloudEdge], references: OnReferences, poses: Mapping[str, Pose]
) -> tuple[list[CloudEdge], list[str]]:
    """Pairs of clouds that the poses do not contradict, and sentences on the others."""
    at = {place.name: Pose(np.eye(3), place.origin) for place in references.places}
    edges = [*clouds, *references.edges]
    shared = {place.name: place.shared for place in references.places}
    wrong = contradicted(edges, {**at, **poses}, shared)
    sentences: list[str] = [
        Sentence(
            "the clouds of {e.first} and {e.second} fit at a place that contradicts the "
            "other ties by {gap:m2}: not used",
            e=e,
            gap=gap,
        )
        for e, gap in wrong
    ]
    return [e for e in edges if all(e is not bad for bad, _ in wrong)], sentences


def _stations(
    project: Project,
    scans: Sequence[StationScan],
    state: Remembered,
    progress: Callable[[str, int, int | None], None],
) -> list[Surroundings]:
    """Planes and views of all stations; both empty where planes are not wanted."""
    settings = project.registration
    if "planes" in settings.by:
        return surroundings(
            scans,
            settings.plane_area_m2,
            settings.plane_floor_mm * MM,
            state,
            progress,
        )
    blank, blind = PlaneSet.joined([]), StationView.empty()
    levelled = {scan.station: scan.levelled for scan in scans}
    return [Surroundings.of(name, blank, blind, flat) for name, flat in levelled.items()]


def _poses(named: Named | None, joined: PlaneRegistration) -> tuple[Mapping[str, Pose], bool]:
    """Approximate poses of all stations that were placed; are they in a frame of their own?"""
    if named is not None and named.identification.poses:
        return named.identification.poses, named.identification.adrift
    return joined.groups[0], True


def _obstacles(
    by: Sequence[str],
    joined: PlaneRegistration,
    clouds: CloudPairs | None,
    references: OnReferences,
) -> dict[str, str]:
    """Why stations are alone, by planes, by clouds and on references."""
    out = {}
    for name, reason in joined.obstacles.items():
        words = [f"by planes {reason}"] if "planes" in by else []
        if clouds is not None:
            reasons = [why for pair, why in clouds.obstacles.items() if name in pair]
            words.append(f"by clouds {reasons[0]}" if reasons else "no pair of clouds holds it")
        if name in references.obstacles:
            words.append(references.obstacles[name])
        out[name] = "; ".join(words)
    return out


def _refuse_lost(
    surveyed: Survey,
    scans: Sequence[StationScan],
    poses: Mapping[str, Pose],
    joined: PlaneRegistration,
    obstacles: Mapping[str, str],
    named: Named | None,
) -> None:
    """Say which stations nothing places, unless the survey itself observes them."""
    lost = [s for s in dict.fromkeys(scan.station for scan in scans) if s not in poses]
    lost = [name for name in lost if name not in surveyed.stations]
    if not lost:
        return
    name = lost[0]
    reason = obstacles.get(name)
    if reason is None:
        group = next(group for group in joined.groups if name in group)
        reason = (
            f"it hangs together with {', '.join(n for n in group if n != name)}, and nothing joins "
            "these to the rest"
        )
    words = f"station {name} cannot be registered: {reason}"
    if named is not None:
        unplaced = named.identification.unplaced.get(name)
        why = "it shows none" if unplaced is None else unplaced.words
        words += Sentence("; by targets: {why}", why=why)
    if len(lost) > 1:
        words += f" (and so for {', '.join(lost[1:6])}{' ...' * (len(lost) > 6)})"
    raise InputError(
        words,
        record=name,
        cure="add what is named there, or take the scans of these stations out of the project",
    )


def _sentences(
    joined: PlaneRegistration,
    obstacles: Mapping[str, str],
    ties: PlaneTies,
    clouds: CloudPairs | None,
    poses: Mapping[str, Pose],
) -> tuple[str, ...]:
    """What joined the stations, what was left to others and what was not used."""
    sentences = []
    by = "planes and clouds" if clouds is not None and len(ties.normal) else "clouds"
    by = "planes" if clouds is None else by
    for group in joined.groups:
        if len(group) > 1:
            names = list(group)
            sentences.append(f"{by} join {', '.join(names[:-1])} and {names[-1]}")
    for name, reason in obstacles.items():
        how = "its targets place it" if name in poses else "other observations have to place it"
        sentences.append(f"{name} is not joined to the others: {reason}; {how}")
    sentences += joined.sentences
    if clouds is not None:
        sentences += clouds.sentences
    if len(ties.normal):
        sentences.append(f"{len(ties.normal)} surfaces are seen by two or more stations")
    return tuple(sentences)
