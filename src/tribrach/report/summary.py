"""The adjustment in figures, its datum, and its global test (report chapters 2 and 6)."""

from __future__ import annotations

import numpy as np

from tribrach.network.adjustment import Adjustment
from tribrach.network.quality import Quality
from tribrach.network.roles import datum_names, datum_sentence
from tribrach.network.variance_components import VarianceComponents
from tribrach.observations.base import Observations, Use
from tribrach.report.content import (
    DatumStatement,
    GlobalVerdict,
    KindCount,
    Summary,
)
from tribrach.report.numbers import number
from tribrach.sentences import Sentence, capital, joined, stopped


def sigma_origin(
    adjustment: Adjustment, posterior: bool, components: VarianceComponents | None = None
) -> str:
    """Where the standard deviations come from, in one sentence or two."""
    own = ""
    if components is not None:
        factors = [component.sigma_factor for component in components.components]
        own = " No variance component changes those of the observations."
        if any(factor != 1 for factor in factors):
            own = Sentence(
                " Those of the observations are as given times {least:g3} to {most:g3}, "
                "the factors of their variance components.",
                least=min(factors),
                most=max(factors),
            )
    if adjustment.scaled(posterior=posterior):
        scale = float(np.sqrt(adjustment.posterior_factor))
        return Sentence(
            "Standard deviations and covariances of unknowns are a posteriori: those of "
            "the observations times {scale:4}, the ratio of sigma0 a posteriori to a "
            "priori (redundancy {adjustment.dof}).{own}",
            scale=scale,
            adjustment=adjustment,
            own=own,
        )
    words = "Standard deviations and covariances are a priori: " + (
        "they follow from those of the observations." + own
        if own
        else "the observations' own, unscaled."
    )
    if not posterior:
        return words
    if adjustment.dof > 0:
        return Sentence(
            "{words} All residuals are zero: there is no sigma0 to estimate from them.", words=words
        )
    return Sentence("{words} There is no redundancy to estimate sigma0 from.", words=words)


def datum_statement(adjustment: Adjustment) -> DatumStatement:
    """The datum in a sentence."""
    kind = "free" if adjustment.defect else adjustment.network.datum.kind
    return DatumStatement(kind, datum_sentence(adjustment), datum_names(adjustment))


def summary(adjustment: Adjustment, quality: Quality, posterior: bool) -> Summary:
    """The adjustment in numbers."""
    tables = adjustment.network.observations
    test = quality.global_test
    said = stopped(capital(test.sentence()))
    verdict = GlobalVerdict(
        test.vtpv, number(test.lower), number(test.upper), test.alpha, test.passed,
        joined(" ", filter(None, [said, adjustment.network.edits_sentence])),
    )  # fmt: skip
    return Summary(
        kinds=_kinds(adjustment, quality),
        n_observations=adjustment.n_observations,
        n_check=sum(_values(o, Use.CHECK) for o in tables),
        n_off=sum(_values(o, Use.OFF) for o in tables),
        n_unknowns=adjustment.n_unknowns,
        n_constraints=adjustment.n_constraints,
        defect=adjustment.defect,
        dof=adjustment.dof,
        iterations=adjustment.iterations,
        vtpv=adjustment.vtpv,
        sigma0=adjustment.sigma0,
        sigma0_posterior=number(adjustment.sigma0_posterior),
        test=verdict,
        covariances="posterior" if adjustment.scaled(posterior=posterior) else "prior",
    )


def _values(o: Observations, use: Use) -> int:
    """Observed values in a state."""
    return int((o.use == use).sum()) * o.rows


def _kinds(adjustment: Adjustment, quality: Quality) -> tuple[KindCount, ...]:
    """Counts, redundancy and sigma0 of every kind and group."""
    out = []
    # v_i (P v)_i: the share of each value in v^T P v, joint covariances included
    pull = adjustment.whitener.T @ adjustment.whitened_residuals
    share = adjustment.residuals * pull
    for number_, o in enumerate(adjustment.network.observations):
        rows = adjustment.rows.table == number_
        r = float(quality.redundancy[rows].sum())
        square = float(share[rows].sum())
        controlled = r > 1e-6 and square >= 0
        out.append(
            KindCount(
                kind=o.kind,
                group=o.group,
                active=_values(o, Use.ACTIVE),
                check=_values(o, Use.CHECK),
                off=_values(o, Use.OFF),
                redundancy=r,
                sigma0=float(np.sqrt(square / r)) if controlled else None,
            )
        )
    return tuple(out)
