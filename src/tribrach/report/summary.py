"""How was the network adjusted, in which datum, and does it fit? (report chapters 2 and 6)"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.network.adjustment import Adjustment
from tribrach.network.quality import Quality
from tribrach.observations.base import Observations, Use
from tribrach.report.content import (
    DatumStatement,
    GlobalVerdict,
    KindCount,
    Summary,
)
from tribrach.report.numbers import number

__all__ = [
    "datum_statement",
    "given_coordinates",
    "held_names",
    "sigma_origin",
    "summary",
    "used_axes",
]


def sigma_origin(adjustment: Adjustment, posterior: bool) -> str:
    """Where the standard deviations come from, one sentence."""
    if posterior and adjustment.dof > 0:
        scale = float(np.sqrt(adjustment.posterior_factor))
        return (
            "Standard deviations and covariances of unknowns are a posteriori: those of the "
            f"observations times {scale:.4f}, the ratio of sigma0 a posteriori to a priori "
            f"(redundancy {adjustment.dof})."
        )
    words = "Standard deviations and covariances are a priori: the observations' own, unscaled."
    if posterior:
        return f"{words} There is no redundancy to estimate sigma0 from."
    return words


def held_names(adjustment: Adjustment) -> tuple[str, ...]:
    """Points that have a coordinate held at a given value."""
    layout = adjustment.layout
    held = ~adjustment.network.free[: 3 * layout.count("point")].reshape(-1, 3)
    held &= used_axes(adjustment)
    return tuple(np.array(layout.names["point"], dtype=object)[held.any(axis=1)])


def used_axes(adjustment: Adjustment) -> NDArray[np.bool_]:
    """Which of E, N, U (3,) the network has at all: free somewhere, or given and not zero."""
    layout = adjustment.layout
    free = adjustment.network.free
    points = free[: 3 * layout.count("point")].reshape(-1, 3).any(axis=0)
    given = (np.nan_to_num(adjustment.network.start.points) != 0).any(axis=0)
    out: NDArray[np.bool_] = points | given | (layout.count("pose") > 0)
    return out


def given_coordinates(adjustment: Adjustment) -> list[Observations]:
    """Tables of given coordinates: control and check points with a covariance."""
    tables = adjustment.network.observations
    return [o for o in tables if o.group == "control" or o.facts.listed_as_control]


def _weighted_names(adjustment: Adjustment) -> tuple[str, ...]:
    """Points whose coordinates are observed and take part."""
    out: dict[str, None] = {}
    for o in given_coordinates(adjustment):
        ends = o.ends(adjustment.layout)
        out |= {ends[i][0]: None for i in np.flatnonzero(o.use == Use.ACTIVE)}
    return tuple(out)


def _carriers(adjustment: Adjustment) -> tuple[str, ...]:
    """Names of the points and stations that a mask of datum components marks."""
    mask, layout = adjustment.network.datum.components, adjustment.layout
    if mask is None:
        return ()
    position = np.arange(layout.count("point") + layout.count("pose"))
    carries = mask[layout.position_columns(position)].any(axis=1)
    return tuple(layout.position_name(int(i)) for i in np.flatnonzero(carries))


def _listed(names: tuple[str, ...], most: int = 12) -> str:
    """Names in a sentence, shortened when there are many."""
    if len(names) > most:
        return ", ".join(names[:most]) + f" and {len(names) - most} more"
    return ", ".join(names)


def datum_statement(adjustment: Adjustment) -> DatumStatement:
    """The datum in a sentence."""
    datum = adjustment.network.datum
    held, weighted = held_names(adjustment), _weighted_names(adjustment)
    if adjustment.defect:
        names = datum.names or _carriers(adjustment)
        who = _listed(names) if names else "all points and stations"
        motions = f"{adjustment.defect} open motion" + "s" * (adjustment.defect != 1)
        sentence = (
            f"Free network: inner constraints over {who} close {motions}; the standard "
            "deviations of coordinates hold in this datum only."
        )
        return DatumStatement("free", sentence, names)
    parts = []
    if held:
        parts.append(f"{_listed(held)} held without error")
    if weighted:
        parts.append(f"{_listed(weighted)} weighted by given covariances")
    if not parts:
        parts.append("no control point, the observations themselves fix the frame")
    nouns = {"fixed": "Fixed points", "free": "Inner constraints were asked for but none is needed"}
    noun = nouns.get(datum.kind, "Control" if held or weighted else "Observations")
    return DatumStatement(datum.kind, f"{noun}: {'; '.join(parts)}.", held + weighted)


def summary(adjustment: Adjustment, quality: Quality) -> Summary:
    """The adjustment in numbers."""
    tables = adjustment.network.observations
    test = quality.global_test
    verdict = GlobalVerdict(
        test.vtpv, number(test.lower), number(test.upper), test.alpha, test.passed,
        _capital(test.sentence()),
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
    )


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:] + "." * (not sentence.endswith("."))


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
        mine = adjustment.rows.table == number_
        r = float(quality.redundancy[mine].sum())
        square = float(share[mine].sum())
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
