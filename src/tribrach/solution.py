"""A network adjusted, cleaned, weighed and assessed, and the report of it: what needs no job.

Files of networks are adjusted with this alone; what reads scans, baselines and projects is loaded
by :mod:`tribrach.questions.adjust.adjusted` and :mod:`tribrach.pipeline`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from tribrach.calibration.systematic_errors import SystematicErrors, systematic_errors
from tribrach.job.results import JobResults
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.control_mistakes import (
    WrongCoordinate,
    WrongList,
    wrong_coordinate,
    wrong_list,
)
from tribrach.network.blunders.mistakes import Mistakes, first_adjustment, mistakes
from tribrach.network.blunders.robust import RobustResult, adjust_robust
from tribrach.network.blunders.snooping import SnoopingLog, coverage_after, snoop
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


@dataclass(frozen=True)
class AdjustmentSettings:
    """What is done with a network besides adjusting it, and how its figures are stated."""

    snoop: bool = False  #: blunders are switched off, one by one
    #: reweighting that points at blunders, ``none`` for none; with ``snoop`` what it points at is
    #: switched off first, and tried again at the end
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False  #: variance components are estimated
    posterior: bool = False  #: covariances are scaled by the a-posteriori variance factor
    #: probability of ellipses, intervals and ellipsoids, of the global test and of the verdicts on
    #: control and check points
    confidence: float = 0.95
    angle: Literal["gon", "deg"] = "gon"  #: unit of angles in reports, ``gon`` or ``deg``

    @classmethod
    def of(cls, project: Project) -> AdjustmentSettings:
        """Take the settings that a project file states."""
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

    def questioned(self, questions: Callable[[], Iterable[str]]) -> SolvedNetwork:
        """The same with what looks wrong in what is given first, if it fails its global test."""
        if self.quality.global_test.passed is not False:
            return self
        said = warned(Severity.INPUT, questions(), "question")
        return replace(self, warnings=(*said, *self.warnings))


class Solving:
    """The steps from a network to its solution, each done when it is first asked for.

    What the adjusted values need is done before what only tests and warnings need, so that
    somebody who waits sees the values first.
    """

    def __init__(self, network: Network, settings: AdjustmentSettings) -> None:
        self.network, self.settings = network, settings

    @cached_property
    def first(self) -> Adjustment:
        """The network as it is."""
        return first_adjustment(self.network)

    @cached_property
    def accused(self) -> WrongCoordinate | WrongList | None:
        """Wrong given coordinates or lists, or systematic errors of scanners, if any.

        Of several the most significant; another unit and other axes of a list leave no other.
        """
        listed = wrong_list(self.first)
        if listed is not None and not np.isfinite(listed.scale):
            return listed
        found = [listed, systematic_errors(self.first), wrong_coordinate(self.first)]
        told = [one for one in found if one is not None]
        return min(told, key=lambda one: one.score, default=None)

    @property
    def wrong(self) -> WrongCoordinate | WrongList | None:
        """Given coordinates that are wrong for certain; the other searches go without them."""
        return self.accused if self.accused is not None and self.accused.certain else None

    @cached_property
    def robust(self) -> RobustResult | None:
        """The robust estimate; None if none is wanted."""
        if self.settings.robust == "none":
            return None
        apart = self.first if self.wrong is None else self.wrong.after
        return adjust_robust(apart.network, self.settings.robust)

    @cached_property
    def cleaned(self) -> tuple[Adjustment, SnoopingLog | None]:
        """The network without blunders, and what was done; as it is if snooping is not wanted."""
        if not self.settings.snoop:
            return self.first, None
        suspects = {} if self.robust is None else self.robust.suspects
        if self.wrong is None:
            return snoop(self.network, suspects=suspects)
        return self.wrong.snooped(suspects)

    @property
    def undecided(self) -> list[str]:
        """Groups of observations of which snooping could not tell the wrong one."""
        log = self.cleaned[1]
        return [] if log is None or self.mistakes.explained else log.undecided()

    @property
    def accused_of_group(self) -> bool:
        """True if the coordinate that may be wrong is one of a group that is named as undecided."""
        log = self.cleaned[1]
        if self.accused is None or self.accused.certain or log is None:
            return False
        rivals = set(self.accused.alternatives)
        return any(
            step.undecided and not rivals.isdisjoint((step.observation, *step.alternatives))
            for step in log.steps
        )

    def accusation(self, kind: type[WrongCoordinate | WrongList]) -> list[str]:
        """The accusing sentence of this kind, unless a group has it already."""
        if self.accused is None or type(self.accused) is not kind or self.accused_of_group:
            return []
        return [self.accused.sentence()]

    @cached_property
    def components(self) -> VarianceComponents | None:
        """Variance components; None if they are not wanted."""
        return estimate_components(self.cleaned[0].network) if self.settings.vce else None

    @property
    def adjustment(self) -> Adjustment:
        """The network adjusted, cleaned and weighed."""
        return self.cleaned[0] if self.components is None else self.components.adjustment

    @cached_property
    def quality(self) -> Quality:
        """All tests of the adjustment."""
        settings = self.settings
        return assess(self.adjustment, posterior=settings.posterior, confidence=settings.confidence)

    @cached_property
    def mistakes(self) -> Mistakes:
        """Mistakes of reading, writing and naming, without a coordinate that is wrong for sure."""
        if self.wrong is not None:
            return mistakes(self.wrong.after)
        doubt = self.accused
        return (
            mistakes(self.first)
            if doubt is None
            else mistakes(self.first, doubt.after, doubt.score)
        )

    @cached_property
    def apart(self) -> Adjustment:
        """The solution without a given coordinate that is wrong for certain."""
        return self.adjustment if self.wrong is None else self.wrong.without(self.adjustment)

    @cached_property
    def quality_apart(self) -> Quality:
        """All tests of :attr:`apart`."""
        if self.wrong is None:
            return self.quality
        return assess(self.apart, confidence=self.settings.confidence)

    @cached_property
    def solved(self) -> SolvedNetwork:
        """All of it, with what looks wrong."""
        warnings = [warning for one in DIAGNOSES for warning in one.warnings(self)]
        adjustment, log = self.adjustment, self.cleaned[1]
        return SolvedNetwork(
            adjustment, self.quality, log, self.components, tuple(warnings), self.apart
        )


@dataclass(frozen=True)
class Diagnosis:
    """Something that is looked for in every solution, by a test that could say otherwise."""

    key: str  #: what it is called by programs and tests
    severity: Severity  #: how much it weighs where it is found
    #: sentences with their cures; none where nothing is found
    look: Callable[[Solving], Iterable[str]]

    def warnings(self, solving: Solving) -> tuple[ReportWarning, ...]:
        """Warnings on the findings."""
        return warned(self.severity, self.look(solving), self.key)


#: all that is looked for, in the order of the report
DIAGNOSES = (
    Diagnosis("implausible_sigma", Severity.INPUT, lambda s: implausible_sigmas(s.network)),
    Diagnosis(
        "wrong_coordinate",
        Severity.INPUT,
        lambda s: s.accusation(WrongCoordinate),
    ),
    Diagnosis("wrong_list", Severity.INPUT, lambda s: s.accusation(WrongList)),
    Diagnosis("systematic_error", Severity.BLUNDER, lambda s: s.accusation(SystematicErrors)),
    Diagnosis("mistake", Severity.INPUT, lambda s: s.mistakes.sentences),
    Diagnosis("shared_bias", Severity.NOTE, lambda s: s.mistakes.notes),
    Diagnosis("held_azimuth", Severity.NOTE, lambda s: held_azimuths(s.network)),
    Diagnosis(
        "robust_suspect",
        Severity.BLUNDER,
        lambda s: [] if s.robust is None else s.robust.sentences(),
    ),
    Diagnosis("undecided_blunder", Severity.BLUNDER, lambda s: s.undecided),
    Diagnosis("snooped", Severity.NOTE, lambda s: coverage_after(s.first, *s.cleaned)),
    Diagnosis(
        "confusable",
        Severity.WEAK,
        lambda s: (
            [] if s.undecided or s.mistakes.explained else confusable(s.apart, s.quality_apart)[:10]
        ),
    ),
    Diagnosis("placement", Severity.NOTE, lambda s: placement_sentences(s.adjustment)),
    Diagnosis("misread_check", Severity.INPUT, lambda s: misread_checks(s.apart)),
    Diagnosis("unchecked_control", Severity.WEAK, lambda s: unchecked_control(s.adjustment)),
    Diagnosis("weak_network", Severity.WEAK, lambda s: weakness_sentences(s.adjustment)),
    Diagnosis("weak_geometry", Severity.WEAK, lambda s: geometry_sentences(s.adjustment)[:20]),
)


def solve(network: Network, settings: AdjustmentSettings) -> SolvedNetwork:
    """Adjust a network as the settings say, clean it, weigh it, assess it."""
    return Solving(network, settings).solved


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


def adjust_network(network: Network, settings: AdjustmentSettings) -> Report:
    """Adjust a network as the settings say; the content of its report."""
    return report(solve(network, settings), settings)
