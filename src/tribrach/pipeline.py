"""From a survey to signed figures: the page to read first.

Every verb is a module: find, name, adjust, clean, weigh, assess, report, georeference, compare,
write.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from tribrach._types import Progress
from tribrach.gnss.sessions import SessionResult
from tribrach.io.outputs import write_texts
from tribrach.job.antennas import add_antennas
from tribrach.job.instruments import instrument_figures
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
from tribrach.report.chapters.georeferencing import add_georeferencing
from tribrach.report.chapters.gnss import gnss_chapter
from tribrach.report.chapters.registration import add_registration
from tribrach.report.content import Content

__all__ = ["AdjustmentSettings", "adjust_network", "run", "solve", "write"]


@dataclass(frozen=True)
class AdjustmentSettings:
    """What is done with a network besides adjusting it."""

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    confidence: float = 0.95
    angle: Literal["gon", "deg"] = "gon"


def adjust_network(
    network: Network, settings: AdjustmentSettings, facts: Mapping[str, str] | None = None
) -> Content:
    """Adjust a network as the settings say; the content of its report."""
    return solve(network, settings, facts)[1]


def solve(
    network: Network,
    settings: AdjustmentSettings,
    facts: Mapping[str, str] | None = None,
    sessions: Sequence[SessionResult] = (),
) -> tuple[Adjustment, Content]:
    """Adjust a network as the settings say; the adjustment and the content of its report.

    sessions : of receivers whose baselines were computed for it.
    """
    log: SnoopingLog | None = None
    components: VarianceComponents | None = None
    warnings: list[str] = []
    adjustment = first_adjustment(network)
    warnings += [f"{text}." for text in mistakes(adjustment)]
    if settings.robust != "none":
        robust = adjust_robust(network, settings.robust)
        warnings += robust.sentences()
    if settings.snoop:
        adjustment, log = snoop(network)
    if settings.vce:
        components = estimate_components(adjustment.network)
        adjustment = components.adjustment
    quality: Quality = assess(adjustment, confidence=settings.confidence)
    warnings += constraint_reactions(adjustment).sentences()
    warnings += confusable(adjustment, quality)[:10]
    warnings += placement_sentences(adjustment)
    warnings += geometry_sentences(adjustment)[:20]
    gnss = gnss_chapter(adjustment, sessions)
    warnings += [] if gnss is None else gnss[1]
    content = build(
        adjustment,
        quality,
        confidence=settings.confidence,
        posterior=settings.posterior,
        angle=settings.angle,
        facts=facts,
        snooping=log,
        components=components,
        further_warnings=warnings,
    )
    if gnss is not None:
        content = replace(content, chapters=(*content.chapters, gnss[0]))
    return adjustment, content


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
    if project.gnss.sessions and project.scans:
        project.survey(progress=progress)  # baselines show their progress, and are kept
    work = find_and_name(project, folder, progress) if project.scans else None
    further = None if work is None else work.registered.survey
    survey = project.survey(further, progress)
    network = project.network_of(survey, whole=further is not None)
    adjustment, content = solve(network, settings, project.facts, project.computed_sessions)
    content = replace(content, instruments=instrument_figures(project))
    content = add_georeferencing(content, project, adjustment)
    if work is not None:
        chapter = georeference(project, work, adjustment, folder, content.sigma_origin, progress)
        warnings = (*content.warnings, *chapter.warnings)
        compared = compare(project, work, adjustment, progress)
        content = replace(content, scans=chapter, warnings=warnings, comparisons=compared)
        content = add_registration(content, project, work.registered, adjustment)
    content, files = add_antennas(content, survey, adjustment, folder)
    write(content, folder, files)
    return content
