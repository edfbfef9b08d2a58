"""The chapter on control: given coordinates and check points against the network."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.network.quality import ROUNDED
from tribrach.network.roles import given_coordinates, held_names, used_axes
from tribrach.network.significance import block_tau_critical, block_tau_significance
from tribrach.observations.base import Observations, Use
from tribrach.report.chapter import Chapter
from tribrach.report.content import CheckVerdict, Control, Head, ReportSettings
from tribrach.report.numbers import sigmas, triple
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    Worst,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.sentences import Sentence
from tribrach.statistics import chi2, f

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

_USES: dict[Use, Literal["weighted", "check", "off"]] = {
    Use.ACTIVE: "weighted",
    Use.CHECK: "check",
    Use.OFF: "off",
}

#: rows of a network of very many given points
_WORST = Worst(
    "those with the largest test value for its limit",
    lambda c: c.verdict.statistic / c.verdict.limit if c.verdict else 0.0,
)


def control(adjustment: Adjustment, settings: ReportSettings) -> tuple[Control, ...]:
    """Held coordinates, then coordinates given with a covariance, weighted, check or off."""
    out = [_held(adjustment, name) for name in held_names(adjustment)]
    for o in given_coordinates(adjustment):
        out += _coordinates(adjustment, o, settings)
    return tuple(out)


def _held(adjustment: Adjustment, name: str) -> Control:
    """A point with coordinates that are not adjusted; those that are show no given value."""
    i = adjustment.layout.index("point", name)
    free = adjustment.network.free[3 * i : 3 * i + 3]
    unused = free | ~used_axes(adjustment)
    given = np.where(unused, np.nan, adjustment.state.points[i])
    nothing = (None, None, None)
    return Control(name, "held", triple(given), nothing, nothing, nothing, None)


def _coordinates(
    adjustment: Adjustment, o: Observations, settings: ReportSettings
) -> list[Control]:
    """Given coordinates against the adjusted ones, with the sigma that difference should have.

    The covariance of adjusted - given is ``C - Q`` for coordinates that took part and ``C + Q``
    for those held out; those switched off by the datum are only listed.
    """
    axis = o.coordinate_axes()
    if axis is None or len(o) == 0:
        return []
    names = [name for name, _ in o.ends(adjustment.layout)]
    item = np.arange(len(o))[:, None]
    given, difference, sigma = (np.full((len(o), 3), np.nan) for _ in range(3))
    given[item, axis] = o.values
    sigma[item, axis] = o.sigma
    difference[item, axis] = -o.misclosure(adjustment.state)
    unused = ~used_axes(adjustment)
    given[:, unused] = sigma[:, unused] = difference[:, unused] = np.nan
    own = np.full((len(o), 3, 3), np.nan)
    own[item[:, :, None], axis[:, :, None], axis[:, None, :]] = o.covariance
    q = np.stack([_block(adjustment, name) for name in names])
    sign = np.where(o.use == Use.ACTIVE, -1.0, 1.0)[:, None, None]
    predicted = adjustment.variance_factor(posterior=settings.posterior) * (own + sign * q)
    dof = adjustment.dof if adjustment.scaled(posterior=settings.posterior) else None
    out = []
    for i, name in enumerate(names):
        use = Use(int(o.use[i]))
        off = use == Use.OFF
        out.append(
            Control(
                name=name,
                use=_USES[use],
                given=triple(given[i]),
                sigma=triple(sigma[i]),
                difference=triple(difference[i]),
                difference_sigma=(None, None, None) if off else triple(sigmas(predicted[i])),
                verdict=None
                if off
                else _judged(difference[i], predicted[i], _Limits(settings.alpha, dof, use)),
                reason=str(o.reason[i]),
                source=str(o.source[i]),
            )
        )
    return out


def _block(adjustment: Adjustment, name: str) -> Array:
    """A-priori position covariance (3, 3) of a point or station."""
    columns = adjustment.columns(name)[:3]
    return adjustment.covariance_columns(columns, columns)


@dataclass(frozen=True)
class _Limits:
    """Limits of squared differences: of chi-square, or with a redundancy of F.

    A check point is independent of sigma0 a posteriori; control that took part is not, and its
    limit allows for that as tau does (method section 3.4).
    """

    alpha: float
    dof: int | None
    use: Use

    def of(self, freedom: int) -> float:
        """The limit of so many degrees of freedom."""
        if self.dof is None:
            return float(chi2.ppf(1 - self.alpha, freedom))
        if self.use == Use.CHECK:
            return float(freedom * f.ppf(1 - self.alpha, freedom, self.dof))
        return float(block_tau_critical(freedom, self.dof, self.alpha))

    def significance(self, statistic: float, freedom: int) -> float:
        """Probability of as much by chance."""
        if self.dof is None:
            return float(chi2.sf(statistic, freedom))
        if self.use == Use.CHECK:
            return float(f.sf(statistic / freedom, freedom, self.dof))
        return float(block_tau_significance(statistic, freedom, self.dof))


def _judged(difference: Array, predicted: Array, limits: _Limits) -> CheckVerdict | None:
    """Test of a difference against its covariance; None where nothing controls it."""
    used = np.isfinite(difference)
    variance = np.where(used, np.diag(predicted), np.nan)
    used &= np.nan_to_num(variance) > 1e-16
    if not used.any():
        return None
    block = predicted[np.ix_(used, used)]
    values, vectors = np.linalg.eigh(block)
    good = values > 1e-6 * values.max()
    along = vectors[:, good].T @ difference[used]
    statistic = float((along**2 / values[good]).sum())
    freedom = int(good.sum())
    limit, significance = limits.of(freedom), limits.significance(statistic, freedom)
    return CheckVerdict(statistic, limit, statistic <= limit * ROUNDED, significance)


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; its table has no rows where no coordinates are given."""
    yield Chapter("control", "Control and check points", tables=(_table(head),), signed=True)


def _table(head: Head) -> ReportTable:
    """Control and check points against the network."""
    limit = 1 - head.settings.alpha
    note: str = Sentence(
        "Difference: adjusted minus given; its sigma is what the difference should "
        "have if given coordinates and network are right. The test is the squared "
        "difference in that metric against {law} at {limit:%g}. Check points take no "
        "part.",
        law="F" if head.scaled else "chi-square",
        limit=limit,
    )
    if all(c.use == "held" for c in head.control):
        note = "Held coordinates are taken as free of errors: nothing of them is tested."
    columns: list[Spec] = [
        head.columns.word("Point", "name"),
        head.columns.word("Use", "use"),
        *head.columns.axes("given ", "given", head.columns.metres),
        *head.columns.axes("σ given ", "sigma", head.columns.mm, wide=True),
        *head.columns.axes("Δ", "difference", head.columns.mm),
        *head.columns.axes("σ Δ", "difference_sigma", head.columns.mm, wide=True),
        (ColumnHead("test"), _test),
        (ColumnHead("limit"), _limit),
        (ColumnHead("verdict", numeric=False), _verdict),
        head.columns.source(),
    ]
    rows = sorted(head.control, key=lambda c: ("check", "weighted", "held", "off").index(c.use))
    return build_table(
        "control",
        "Control and check points",
        note,
        rows,
        columns,
        _control_state,
        worst=_WORST,
        ends=lambda c: (c.name,),
    )


def _test(c: Control) -> Cell:
    if c.verdict is None:
        return Cell("")
    return number_cell(c.verdict.statistic, f"{c.verdict.statistic:.2f}")


def _limit(c: Control) -> Cell:
    return Cell("") if c.verdict is None else number_cell(c.verdict.limit, f"{c.verdict.limit:.2f}")


def _verdict(c: Control) -> Cell:
    """In words: agrees, does not agree, or why there is no verdict."""
    if c.verdict is None:
        return text_cell({"off": c.reason, "held": "held"}.get(c.use, "not controlled"))
    return text_cell("agrees", "good") if c.verdict.agrees else text_cell("does not agree", "bad")


def _control_state(c: Control) -> str:
    return c.use if c.use in ("off", "check") else ""


SUBJECT = Subject("control", _chapters)
