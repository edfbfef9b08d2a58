"""A network adjusted, cleaned, weighed and assessed, and the report of it: what needs no job.

Files of networks are adjusted with this alone; what reads scans, baselines and projects is loaded
by :mod:`tribrach.pipeline`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tribrach.job.results import JobResults
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.control_mistakes import wrong_coordinate
from tribrach.network.blunders.mistakes import first_adjustment, mistakes
from tribrach.network.blunders.robust import adjust_robust
from tribrach.network.blunders.snooping import SnoopingLog, snoop
from tribrach.network.blunders.suspects import Key
from tribrach.network.datum_control import unchecked_control
from tribrach.network.misread_checks import misread_checks
from tribrach.network.network import Network
from tribrach.network.placement import placement_sentences
from tribrach.network.plausible_sigmas import held_azimuths, implausible_sigmas
from tribrach.network.quality import Quality, assess
from tribrach.network.separability import confusable
from tribrach.network.variance_components import VarianceComponents, estimate_components
from tribrach.network.weakness import weakness_sentences
from tribrach.registration.geometry_warnings import geometry_sentences
from tribrach.report.build import build
from tribrach.report.content import Report
from tribrach.report.warnings import ReportWarning, Severity, warned

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["AdjustmentSettings", "SolvedNetwork", "adjust_network", "report", "solve"]


@dataclass(frozen=True)
class AdjustmentSettings:
    """What is done with a network besides adjusting it, and how its figures are stated.

    Parameters
    ----------
    snoop : bool
        Blunders are switched off, one by one.
    robust : str
        Reweighting that points at blunders, ``none`` for none; with ``snoop`` what it points at
        is switched off first, and tried again at the end.
    vce : bool
        Variance components are estimated.
    posterior : bool
        Covariances are scaled by the a-posteriori variance factor.
    confidence : float
        Probability of ellipses, intervals and ellipsoids, of the global test and of the verdicts
        on control and check points.
    angle : str
        Unit of angles in reports, ``gon`` or ``deg``.
    """

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    confidence: float = 0.95
    angle: Literal["gon", "deg"] = "gon"

    @classmethod
    def of(cls, project: Project) -> AdjustmentSettings:
        """Take the settings that a project file states.

        Parameters
        ----------
        project : Project
            Its sections ``[adjustment]`` and ``[output]`` and its confidence.

        Returns
        -------
        AdjustmentSettings
        """
        section = project.adjustment
        return cls(
            snoop=section.snoop,
            robust=section.robust,
            vce=section.vce,
            posterior=section.posterior,
            confidence=project.confidence,
            angle=project.output.angle,
        )


@dataclass(frozen=True)
class SolvedNetwork:
    """An adjusted network, its quality, what was done to it, and what looks wrong.

    ``apart`` is the same without a given coordinate that was found to be wrong: what looks wrong
    in it as well has another reason.
    """

    adjustment: Adjustment
    quality: Quality
    snooping: SnoopingLog | None
    components: VarianceComponents | None
    warnings: tuple[ReportWarning, ...]
    apart: Adjustment


def solve(network: Network, settings: AdjustmentSettings) -> SolvedNetwork:
    """Adjust a network as the settings say, clean it, weigh it, assess it."""
    log: SnoopingLog | None = None
    components: VarianceComponents | None = None
    adjustment = first_adjustment(network)
    wrong = wrong_coordinate(adjustment)
    warnings = [*warned(Severity.INPUT, implausible_sigmas(network))]
    warnings += [*warned(Severity.INPUT, [] if wrong is None else [wrong.sentence()])]
    # what else is wrong is looked for without a coordinate that is wrong for certain
    wrong = wrong if wrong is not None and wrong.certain else None
    apart = adjustment if wrong is None else wrong.after
    found = mistakes(apart)
    warnings += warned(Severity.INPUT, found.sentences)
    warnings += warned(Severity.NOTE, (*found.notes, *held_azimuths(network)))
    suspects: Mapping[Key, float] = {}
    if settings.robust != "none":
        robust = adjust_robust(apart.network, settings.robust)
        warnings += warned(Severity.BLUNDER, robust.sentences())
        suspects = robust.suspects
    if settings.snoop:
        if wrong is None:
            adjustment, log = snoop(network, suspects=suspects)
        else:
            adjustment, log = wrong.snooped(suspects)
    if settings.vce:
        components = estimate_components(adjustment.network)
        adjustment = components.adjustment
    quality = assess(adjustment, posterior=settings.posterior, confidence=settings.confidence)
    apart = adjustment if wrong is None else wrong.without(adjustment)
    alone = quality if wrong is None else assess(apart, confidence=settings.confidence)
    warnings += warned(Severity.WEAK, confusable(apart, alone)[:10])
    warnings += warned(Severity.NOTE, placement_sentences(adjustment))
    warnings += warned(Severity.INPUT, misread_checks(apart))
    warnings += warned(Severity.WEAK, unchecked_control(adjustment))
    warnings += warned(Severity.WEAK, weakness_sentences(adjustment))
    warnings += warned(Severity.WEAK, geometry_sentences(adjustment)[:20])
    return SolvedNetwork(adjustment, quality, log, components, tuple(warnings), apart)


def report(
    solution: SolvedNetwork,
    settings: AdjustmentSettings,
    facts: Mapping[str, str] | None = None,
    job: JobResults | None = None,
) -> Report:
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
        apart=solution.apart,
        job=job or JobResults(),
    )


def adjust_network(
    network: Network, settings: AdjustmentSettings, facts: Mapping[str, str] | None = None
) -> Report:
    """Adjust a network as the settings say; the content of its report."""
    return report(solve(network, settings), settings, facts)
