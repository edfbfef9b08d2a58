"""From a survey to signed figures: the page to read first.

Every verb is a module: find, name, adjust, clean, weigh, assess, report, georeference, compare,
write.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tribrach._types import Progress
from tribrach.io.outputs import write_texts
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.job.antennas import carried_antennas
from tribrach.job.opened import open_job
from tribrach.job.results import JobResults
from tribrach.job.station_comparison import StationComparison
from tribrach.job.steps import compare, find_and_name, georeference
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.mistakes import first_adjustment, mistakes
from tribrach.network.blunders.robust import adjust_robust
from tribrach.network.blunders.snooping import SnoopingLog, snoop
from tribrach.network.network import Network
from tribrach.network.placement import placement_sentences
from tribrach.network.quality import Quality, assess
from tribrach.network.reactions import constraint_reactions
from tribrach.network.separability import confusable
from tribrach.network.variance_components import VarianceComponents, estimate_components
from tribrach.project import Project
from tribrach.registration.geometry_warnings import geometry_sentences
from tribrach.report import html, json_result, text
from tribrach.report.build import build
from tribrach.report.content import Content
from tribrach.report.summary import sigma_origin
from tribrach.report.warnings import ReportWarning, Severity, warned

__all__ = [
    "AdjustmentSettings",
    "SolvedNetwork",
    "adjust_network",
    "report",
    "run",
    "solve",
    "write",
]


@dataclass(frozen=True)
class AdjustmentSettings:
    """What is done with a network besides adjusting it."""

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    confidence: float = 0.95
    angle: Literal["gon", "deg"] = "gon"


@dataclass(frozen=True)
class SolvedNetwork:
    """An adjusted network, its quality, what was done to it, and what looks wrong."""

    adjustment: Adjustment
    quality: Quality
    snooping: SnoopingLog | None
    components: VarianceComponents | None
    warnings: tuple[ReportWarning, ...]


def solve(network: Network, settings: AdjustmentSettings) -> SolvedNetwork:
    """Adjust a network as the settings say, clean it, weigh it, assess it."""
    log: SnoopingLog | None = None
    components: VarianceComponents | None = None
    adjustment = first_adjustment(network)
    warnings = [*warned(Severity.INPUT, mistakes(adjustment))]
    if settings.robust != "none":
        robust = adjust_robust(network, settings.robust)
        warnings += warned(Severity.BLUNDER, robust.sentences())
    if settings.snoop:
        adjustment, log = snoop(network)
    if settings.vce:
        components = estimate_components(adjustment.network)
        adjustment = components.adjustment
    quality = assess(adjustment, confidence=settings.confidence)
    warnings += warned(Severity.BLUNDER, constraint_reactions(adjustment).sentences())
    warnings += warned(Severity.WEAK, confusable(adjustment, quality)[:10])
    warnings += warned(Severity.NOTE, placement_sentences(adjustment))
    warnings += warned(Severity.WEAK, geometry_sentences(adjustment)[:20])
    return SolvedNetwork(adjustment, quality, log, components, tuple(warnings))


def report(
    solution: SolvedNetwork,
    settings: AdjustmentSettings,
    facts: Mapping[str, str] | None = None,
    job: JobResults | None = None,
) -> Content:
    """Everything there is to say of a solution, and of what a job left besides."""
    return build(
        solution.adjustment,
        solution.quality,
        confidence=settings.confidence,
        posterior=settings.posterior,
        angle=settings.angle,
        facts=facts,
        snooping=solution.snooping,
        components=solution.components,
        warnings=solution.warnings,
        job=job or JobResults(),
    )


def adjust_network(
    network: Network, settings: AdjustmentSettings, facts: Mapping[str, str] | None = None
) -> Content:
    """Adjust a network as the settings say; the content of its report."""
    return report(solve(network, settings), settings, facts)


def write(content: Content, folder: Path, further: Mapping[Path, str] | None = None) -> list[Path]:
    """Write report.html, report.txt and result.json into a folder, and further files by path."""
    files = dict(further or {}) | {
        folder / "report.html": html.render(content),
        folder / "report.txt": text.render(content),
        folder / "result.json": json_result.dumps(content),
    }
    return write_texts(files)


def run(
    project: Project,
    folder: Path | None = None,
    progress: Progress = lambda what, done, total: None,
) -> Content:
    """Run a project and leave its results in a folder, its own if none is given."""
    folder = project.results if folder is None else folder
    wish = project.adjustment
    settings = AdjustmentSettings(
        wish.snoop, wish.robust, wish.vce, wish.posterior, project.confidence, project.output.angle
    )
    job = open_job(project, progress)
    work = find_and_name(job, folder, progress) if project.scans else None
    further = None if work is None else work.registered.survey
    survey = job.surveyed(further)
    network = job.network_of(survey, whole=further is not None)
    solution = solve(network, settings)
    adjustment = solution.adjustment
    origin = sigma_origin(adjustment, settings.posterior)
    placed = None
    comparisons: tuple[StationComparison, ...] = ()
    if work is not None:
        placed = georeference(job, work, adjustment, folder, origin, progress)
        comparisons = compare(job, work, adjustment, progress)
    antennas = carried_antennas(
        survey, adjustment, adjustment.variance_factor(posterior=settings.posterior)
    )
    results = JobResults(
        project,
        job.sessions,
        None if work is None else work.registered,
        placed,
        comparisons,
        antennas,
    )
    content = report(solution, settings, project.facts, results)
    arms = () if antennas is None else antennas.lever_arms
    write(content, folder, lever_arm_files(arms, folder, content.datum.sentence, origin))
    return content
