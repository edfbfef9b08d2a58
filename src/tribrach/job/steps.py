"""A project with scans, step by step, up to its clouds: what `tribrach run` does besides adjusting.

Every step remembers its product; a second run goes on where the first one stopped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.geodesy.output_frame import FrameKind, OutputFrame
from tribrach.io.outputs import write_texts
from tribrach.job.budget import error_budget, reach_sentences
from tribrach.job.clouds import Product, place, write_clouds
from tribrach.job.find_targets import Findings, extract
from tribrach.job.grouping import refuse_impossible
from tribrach.job.name_targets import Named
from tribrach.job.poses import MOST_STATIONS, joint_covariance, pose_texts, station_order
from tribrach.job.scans import StationScan, as_adjusted, calibration_sentences, open_scans
from tribrach.job.state import Remembered
from tribrach.job.station_comparison import Wish, compare_stations, wishes
from tribrach.job.tie import Registered, register
from tribrach.job.truth import against_truth, read_truth
from tribrach.network.adjustment import Adjustment
from tribrach.report.budget_tables import budget_charts
from tribrach.report.chapters.scans import scan_chapter
from tribrach.report.comparison_chapter import ComparisonChapter
from tribrach.report.scan_content import ScanChapter

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["ScanWork", "compare", "find_and_name", "georeference"]


@dataclass(frozen=True)
class ScanWork:
    """Scans of a project with their targets and what ties them, before the adjustment."""

    scans: Sequence[StationScan]
    findings: Sequence[Findings]
    registered: Registered
    state: Remembered
    comparisons: Sequence[Wish] = ()

    def corrected(self, adjustment: Adjustment) -> ScanWork:
        """The same with scans corrected by the adjusted calibration of their scanners."""
        scans = as_adjusted(self.scans, adjustment)
        new = {scan.name: scan for scan in scans}
        comparisons = [
            replace(
                wish,
                a=tuple(new[scan.name] for scan in wish.a),
                b=tuple(new[scan.name] for scan in wish.b),
            )
            for wish in self.comparisons
        ]
        return replace(self, scans=scans, comparisons=comparisons)

    @property
    def named(self) -> Named | None:
        """Targets with their names; None if none are sought."""
        return self.registered.named


def find_and_name(project: Project, folder: Path, progress: Progress) -> ScanWork:
    """Open the scans, find their targets, give them names, tie the stations to each other.

    Raises
    ------
    InputError : scans that cannot be read or matched, clouds that are asked for and impossible.
    """
    state = Remembered(folder)
    scans = open_scans(project)
    refuse_impossible(project, scans)
    wished = wishes(project, scans)
    findings: Sequence[Findings] = ()
    if project.targets.wanted:
        findings = extract(scans, project.targets, state, lambda what: progress(what, 0, None))
    registered = register(project, scans, findings, state, progress)
    return ScanWork(scans, findings, registered, state, wished)


def georeference(
    project: Project,
    work: ScanWork,
    adjustment: Adjustment,
    folder: Path,
    sigma_origin: str,
    progress: Progress,
) -> ScanChapter:
    """Write poses and clouds through the adjusted stations; the chapter of the report."""
    frame = output_frame(project)
    work = work.corrected(adjustment)
    factor = adjustment.variance_factor(posterior=project.adjustment.posterior)
    stations = set(adjustment.layout.names["pose"])
    lost = [scan.station for scan in work.scans if scan.station not in stations]
    if lost:
        raise InputError(
            f"station {lost[0]} has a scan and nothing that places it",
            record=lost[0],
            cure="add [targets] that its scan shows, or observations of the station",
        )
    placements = {scan.name: place(scan, adjustment, factor) for scan in work.scans}
    clouds = folder / "clouds"
    names = station_order(work.scans)
    few = len(names) <= MOST_STATIONS
    joint = joint_covariance(adjustment, names, frame, factor) if few else None
    write_texts(pose_texts(clouds, work.scans, placements, frame, sigma_origin, joint))
    products: list[Product] = []
    if project.cloud.write:
        products = write_clouds(
            work.scans, placements, frame, project.cloud, clouds, work.state, progress
        )
    chapter = scan_chapter(work.findings, work.named, products, placements, frame)
    odd = (f"{s.scan.source}: {warning}." for s in work.scans for warning in s.scan.warnings)
    corrected = calibration_sentences(work.scans, adjustment)
    chapter = replace(chapter, warnings=(*odd, *corrected, *chapter.warnings))
    budget = error_budget(work.scans, placements, adjustment, work.state, factor)
    charts = budget_charts(budget)
    reach = reach_sentences(work.scans, placements, adjustment, work.state)
    chapter = replace(
        chapter,
        error_budget=tuple(budget),
        pictures=(*chapter.pictures, *charts),
        warnings=(*chapter.warnings, *(f"{text[:1].upper()}{text[1:]}." for text in reach)),
    )
    if project.truth is None:
        return chapter
    if adjustment.defect and not adjustment.layout.count("point"):
        said = "Nothing ties the stations to the frame of the truth: they are not compared with it."
        return replace(chapter, warnings=(*chapter.warnings, said))
    file = project.folder / project.truth
    rows = against_truth(
        read_truth(file),
        file.parent,
        adjustment,
        work.scans,
        placements,
        work.named,
        project.cloud.incidence,
    )
    return replace(chapter, truth=tuple(rows))


def compare(
    project: Project, work: ScanWork, adjustment: Adjustment, progress: Progress
) -> tuple[ComparisonChapter, ...]:
    """The comparisons between stations that the project asks for."""
    factor = adjustment.variance_factor(posterior=project.adjustment.posterior)
    scans = {scan.name: scan for scan in work.corrected(adjustment).scans}
    wished = [wish.of(scans) for wish in work.comparisons]
    frame = output_frame(project)
    return tuple(compare_stations(wished, adjustment, frame, factor, work.state, progress))


def output_frame(project: Project) -> OutputFrame:
    """The frame of the clouds: as the project says, else the site's own coordinates."""
    work = project.frame()
    kind: FrameKind = project.cloud.frame or ("work" if work.grid is None else "projected")
    crs, site = project.site.crs, project.site
    if kind == "ecef":
        crs = "EPSG:4978" if site.frame is None else frames.code(site.frame)
    elif kind == "work" and project.site.kind != "flat":
        crs = None
    epoch = site.epoch if project.cloud.epoch is None else project.cloud.epoch
    return OutputFrame(work, kind, crs, epoch)
