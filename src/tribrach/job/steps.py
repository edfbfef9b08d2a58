"""A project with scans, step by step, up to its clouds: what `tribrach run` does besides adjusting.

Every step remembers its product; a second run goes on where the first one stopped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribrach._types import Progress
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import SharedPart
from tribrach.errors import AdjustmentError, InputError, TribrachError
from tribrach.geodesy import frames
from tribrach.geodesy.output_frame import FrameKind, OutputFrame
from tribrach.io.keeping import refuse_loss
from tribrach.io.outputs import write_texts
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses
from tribrach.job.budget import BudgetRow, error_budget, reach_sentences
from tribrach.job.clouds import Product, write_clouds
from tribrach.job.decided_targets import found_again
from tribrach.job.find_planes import plane_wish
from tribrach.job.find_targets import Findings, extract, target_wish
from tribrach.job.grouping import groups, refuse_impossible
from tribrach.job.name_targets import Named, marks_are_open
from tribrach.job.nothing_found import refuse_unplaced
from tribrach.job.poses import MOST_STATIONS, pose_texts, station_order
from tribrach.job.scans import StationScan, as_adjusted, calibration_sentences, open_scans
from tribrach.job.shared import shared_part
from tribrach.job.state import Remembered
from tribrach.job.stated_noise import StatedNoise, stated_noise
from tribrach.job.station_comparison import (
    RequestedComparison,
    StationComparison,
    compare_stations,
    requested_comparisons,
)
from tribrach.job.surface_samples import SurfaceSamples, sample_wish
from tribrach.job.tie import Registered, known_poses, register
from tribrach.job.truth import TruthRow, against_truth, read_truth
from tribrach.job.visits import Wish, Wishes, visit
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.project.edits import Edits
from tribrach.project.sections import CloudSection, TargetSection
from tribrach.tasks.engine import HERE, Engine
from tribrach.units import MM

if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.project import Project


@dataclass(frozen=True)
class GivenBesides:
    """What a project gives besides its scans, read before the first of them."""

    survey: Survey  #: everything that was measured and given without them
    known: ApproximatePoses = NO_POSES  #: where the scanners stood, approximately
    truth: Mapping[str, Any] | None = None  #: what a simulated project is compared with


@dataclass(frozen=True)
class FoundInScans:
    """Scans of a project with what was found in them, before anything is matched."""

    scans: Sequence[StationScan]  #: all scans
    #: targets and rejected candidates by scan; empty if none are wanted
    findings: Sequence[Findings]
    wanted: TargetSection  #: targets that the project looks for
    state: Remembered  #: what is remembered of them
    given: GivenBesides  #: what the project gives besides
    comparisons: Sequence[RequestedComparison] = ()  #: comparisons that the project asks for


@dataclass(frozen=True)
class ScanWork:
    """Scans of a project with their targets and what ties them, before the adjustment."""

    scans: Sequence[StationScan]
    findings: Sequence[Findings]
    registered: Registered
    state: Remembered
    given: GivenBesides
    comparisons: Sequence[RequestedComparison] = ()

    def corrected(self, adjustment: Adjustment) -> ScanWork:
        """The same with scans corrected by the adjusted calibration of their scanners."""
        scans = as_adjusted(self.scans, adjustment)
        new = {scan.name: scan for scan in scans}
        comparisons = [request.of(new) for request in self.comparisons]
        return replace(self, scans=scans, comparisons=comparisons)

    @property
    def named(self) -> Named | None:
        """Targets with their names; None if none are sought."""
        return self.registered.named


@dataclass(frozen=True)
class Standing:
    """Scans at their adjusted stations, before anything is made of them."""

    work: ScanWork  #: with scans corrected by the adjusted calibration of their scanners
    adjustment: Adjustment  #: what placed them
    factor: float  #: on a-priori covariances (a posteriori variance)
    frame: OutputFrame  #: of the clouds
    placements: Mapping[str, Placement]  #: pose and covariance by scan, in the work frame
    #: what the points of all scans share, in the work frame and in that of the clouds; None with
    #: more stations than a joint covariance is kept of
    shared: SharedPart | None
    delivered: SharedPart | None

    @classmethod
    def of(cls, job: Job, work: ScanWork, adjustment: Adjustment) -> Standing:
        """The scans of a job where its adjusted network puts them."""
        frame, work = output_frame(job), work.corrected(adjustment)
        factor = adjustment.variance_factor(posterior=job.project.adjustment.posterior)
        names = station_order(work.scans)
        if len(names) <= MOST_STATIONS:
            shared = shared_part(work.scans, adjustment, factor)
            delivered = shared.delivered(frame)
            return cls(work, adjustment, factor, frame, shared.scans, shared, delivered)
        parts = [shared_part(work.scans, adjustment, factor, only=[name]) for name in names]
        placements = {name: place for part in parts for name, place in part.scans.items()}
        return cls(work, adjustment, factor, frame, placements, None, None)

    def shared_by(self, stations: Sequence[str]) -> tuple[SharedPart, SharedPart]:
        """What points of the scans of some stations share, in both frames."""
        if self.shared is not None and self.delivered is not None:
            return self.shared, self.delivered
        some = shared_part(self.work.scans, self.adjustment, self.factor, only=stations)
        return some, some.delivered(self.frame)


@dataclass(frozen=True)
class PlacedScans:
    """Scans through the adjusted stations, and what was made of them."""

    scans: Sequence[StationScan]  #: corrected by the adjusted calibration of their scanners
    findings: Sequence[Findings]  #: targets found in each scan, and what was rejected
    named: Named | None  #: their names; None if none were sought
    placements: Mapping[str, Placement]  #: pose and covariance by scan
    frame: OutputFrame  #: of the clouds
    products: Sequence[Product]  #: clouds that were written
    budget: Sequence[BudgetRow]  #: what the uncertainty of points comes from, region by region
    #: which scans were corrected and by what; which reach far beyond their targets
    corrected: Sequence[str] = ()
    reach: Sequence[str] = ()
    #: noise of single points as it is stated for each scanner and as its scans show it
    noise: Sequence[StatedNoise] = ()
    truth: Sequence[TruthRow] = ()  #: the comparison of a simulated job with its truth
    loose: bool = False  #: true if there is a truth and nothing ties the stations to its frame
    #: what the points of the clouds share, in their frame; None with more stations than a joint
    #: covariance is kept of
    shared: SharedPart | None = None


def find(
    job: Job, folder: Path, progress: Progress, engine: Engine = HERE, *, writes: bool = False
) -> FoundInScans:
    """Open the scans, find their targets and planes; an engine does this and later work on scans.

    All other files are checked before the first scan is read, and each scan is decoded once. Who
    writes clouds into the folder later is refused now.
    """
    job.refuse_unstated()
    project, state = job.project, Remembered(folder, engine)
    scans = open_scans(job, state)
    refuse_impossible(project, scans)
    requests = requested_comparisons(project, scans)
    given = _given_besides(job, scans)
    if writes and project.cloud.write:
        _refuse_clouds(scans, project.cloud, folder)
    scans = visit(scans, _wanted(project, job.edits), _besides, state=state, progress=progress)
    members = {scan.name: scan for scan in scans}
    requests = [request.of(members) for request in requests]
    findings: Sequence[Findings] = ()
    if project.targets.wanted or job.edits.pick:
        findings = extract(scans, project.targets, state, progress, job.edits)
    return FoundInScans(scans, findings, project.targets, state, given, requests)


def _given_besides(job: Job, scans: Sequence[StationScan]) -> GivenBesides:
    """Read all other files of a project before the first scan, which may be hours of work."""
    survey, truth = job.survey, job.project.truth
    return GivenBesides(
        survey, known_poses(job, scans), None if truth is None else read_truth(job.folder / truth)
    )


def _refuse_clouds(scans: Sequence[StationScan], section: CloudSection, folder: Path) -> None:
    """Refuse clouds that would take the place of another file, before any of them is made."""
    for group in groups(scans, section):
        refuse_loss(folder / "clouds" / group.file)


def _wanted(project: Project, edits: Edits) -> Wishes:
    """What the scans of a project are read for."""
    marked = project.targets.wanted or edits.pick
    settings = project.registration
    area, floor = settings.plane_area_m2, settings.plane_floor_mm * MM

    def wanted(scan: StationScan) -> list[Wish]:
        wishes = [target_wish(scan, project.targets, edits)] if marked else []
        if "planes" in settings.by and scan.origin_known:
            wishes.append(plane_wish(scan, area, floor))
        return wishes

    return wanted


def _besides(scan: StationScan) -> list[Wish]:
    """Sample of a scan for the error budget, where its noise is known."""
    return [sample_wish(scan)] if scan.noise is not None else []


def name_and_tie(job: Job, found: FoundInScans, progress: Progress) -> ScanWork:
    """Give targets their names and tie the stations to each other."""
    scans, findings = found.scans, found_again(found.findings, job.edits)
    registered = register(job, scans, findings, found.given.known, found.state, progress)
    observed = registered.survey is not None and registered.survey.tables()
    if not observed and not found.given.survey.tables():
        stations = dict.fromkeys(scan.station for scan in scans)
        refuse_unplaced(stations, scans, findings, found.wanted)
    return ScanWork(scans, findings, registered, found.state, found.given, found.comparisons)


def find_and_name(job: Job, folder: Path, progress: Progress) -> ScanWork:
    """Open the scans, find their targets, give them names, tie the stations to each other."""
    return name_and_tie(job, find(job, folder, progress), progress)


def scans_to_tell_of(error: TribrachError, job: Job, found: FoundInScans) -> list[Findings]:
    """Scans without targets that an error may come from.

    An error about a decision by hand has nothing to do with them. Where the control network is open
    by itself, only stations are told of that show no target at all.
    """
    if isinstance(error, InputError) and error.file is not None and error.file == job.edits.file:
        return []
    bare = [finding for finding in found.findings if not finding.detections]
    if bare and isinstance(error, AdjustmentError) and marks_are_open(job.survey, job.edits):
        showing = {finding.station for finding in found.findings if finding.detections}
        bare = [finding for finding in bare if finding.station not in showing]
    return bare


def refuse_lost(job: Job, work: ScanWork, adjustment: Adjustment) -> None:
    """Refuse scans at stations that the adjusted network does not have."""
    stations = set(adjustment.layout.names["pose"])
    lost = [scan.station for scan in work.scans if scan.station not in stations]
    if lost:
        refuse_unplaced(dict.fromkeys(lost), work.scans, work.findings, job.project.targets)
        raise InputError(
            f"station {lost[0]} has a scan and nothing that places it",
            record=lost[0],
            cure="add [targets] that its scan shows, or observations of the station",
        )


def georeference(
    job: Job, standing: Standing, folder: Path, sigma_origin: str, progress: Progress
) -> PlacedScans:
    """Write poses and clouds through the adjusted stations; what was made of the scans."""
    project, work, adjustment = job.project, standing.work, standing.adjustment
    scans, placements, frame = work.scans, standing.placements, standing.frame
    clouds = folder / "clouds"
    if project.cloud.write:
        _refuse_clouds(scans, project.cloud, folder)
    write_texts(pose_texts(clouds, scans, placements, frame, sigma_origin, standing.delivered))
    products: list[Product] = []
    if project.cloud.write:
        products = write_clouds(
            scans, placements, frame, project.cloud, clouds, work.state, progress, sigma_origin
        )
    samples = SurfaceSamples(work.state, progress)
    whose = {name: job.instruments.of_station(name) for name in station_order(scans)}
    loose = bool(adjustment.defect and not adjustment.layout.count("point"))
    return PlacedScans(
        scans,
        work.findings,
        work.named,
        placements,
        frame,
        products,
        error_budget(scans, placements, adjustment, samples, standing.factor),
        corrected=calibration_sentences(scans, adjustment),
        reach=reach_sentences(scans, placements, adjustment, samples),
        noise=stated_noise(
            scans,
            whose,
            project.instruments,
            work.state,
            progress,
            incidence=project.cloud.incidence,
        ),
        truth=[] if loose else _truth(project, standing, progress),
        loose=loose and project.truth is not None,
        shared=standing.delivered,
    )


def _truth(project: Project, standing: Standing, progress: Progress) -> list[TruthRow]:
    """The comparison of a simulated project with its truth; none without a truth."""
    work = standing.work
    if work.given.truth is None or project.truth is None:
        return []
    return against_truth(
        work.given.truth,
        (project.folder / project.truth).parent,
        standing.adjustment,
        work.scans,
        standing.placements,
        work.named,
        project.cloud.incidence,
        state=work.state,
        progress=progress,
    )


def compare(standing: Standing, progress: Progress) -> tuple[StationComparison, ...]:
    """The comparisons between stations that the project asks for."""
    requests, state = standing.work.comparisons, standing.work.state
    if not requests:
        return ()
    compared = [scan.station for request in requests for scan in (*request.a, *request.b)]
    shared, delivered = standing.shared_by(compared)
    return tuple(compare_stations(requests, shared, delivered, standing.frame, state, progress))


def output_frame(job: Job) -> OutputFrame:
    """The frame of the clouds: as the project says, else the site's own coordinates."""
    project, work = job.project, job.frame
    kind: FrameKind = project.cloud.frame or ("work" if work.grid is None else "projected")
    crs, site = project.site.crs, project.site
    if kind == "ecef":
        own = site.frame if work.grid is None else work.grid.datum.frame
        crs = frames.identifier(own or "WGS 84")
    elif kind == "work" and project.site.kind != "flat":
        crs = None
    epoch = site.epoch if project.cloud.epoch is None else project.cloud.epoch
    return OutputFrame(work, kind, crs, epoch)
