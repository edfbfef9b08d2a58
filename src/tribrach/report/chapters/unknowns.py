"""The chapter on other unknowns: orientations, calibration, lever arms, planes; correlations."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from tribrach.instruments.calibration import meaning_of
from tribrach.network.adjustment import Adjustment
from tribrach.network.roles import scalar_roles, unknown_references
from tribrach.observations.sights import ECCENTRICITY_UNKNOWN
from tribrach.report.chapter import Chapter
from tribrach.report.content import (
    CorrelationRow,
    Head,
    PlaneUnknown,
    ReportSettings,
    ScalarUnknown,
    Unknown,
    VectorUnknown,
)
from tribrach.report.numbers import Style, matrix, numbers, sigmas
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
from tribrach.statistics import largest_first

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: correlations of unknowns from here on are told
CORRELATED = 0.7

#: at most this many unknowns are compared, and this many pairs of correlated ones listed
MOST_UNKNOWNS = 1500
MOST_PAIRS = 300


def _size(unknown: Unknown) -> float:
    """Orientations by their sigma, everything else before them."""
    return (unknown.sigmas[0][0] or 0.0) if unknown.role == "orientation" else np.inf


#: rows of a network of very many set-ups
_WORST = Worst("all but orientations, and the orientations with the largest sigma", _size)


def other_unknowns(adjustment: Adjustment, settings: ReportSettings) -> tuple[Unknown, ...]:
    """Scalars, vectors and planes, in this order; eccentricities are residuals of centrings."""
    factor = adjustment.variance_factor(posterior=settings.posterior)
    return (
        *_scalars(adjustment, factor),
        *_vectors(adjustment, factor),
        *_planes(adjustment, factor),
    )


def _scalars(adjustment: Adjustment, factor: float) -> list[ScalarUnknown]:
    names = adjustment.layout.names["scalar"]
    covariance = adjustment.family_covariances("scalar") * factor
    roles = scalar_roles(adjustment)
    sigma = numbers(sigmas(covariance)[:, 0])
    out = []
    for i, name in enumerate(names):
        unit, role, at = roles.get(i, ("1", "parameter", ""))
        value = float(adjustment.state.scalars[i])
        if role == "orientation":
            value = value % (2 * np.pi) % (2 * np.pi)  # the second brings 2 pi itself to 0
        out.append(ScalarUnknown(name, role, value, sigma[i], unit, at))
    return out


def _roles(adjustment: Adjustment) -> dict[int, str]:
    """What the vectors are, by number."""
    return {i: r.means for _, r, i, _ in unknown_references(adjustment, "vector") if r.means}


def _vectors(adjustment: Adjustment, factor: float) -> list[VectorUnknown]:
    covariance = adjustment.family_covariances("vector") * factor
    roles = _roles(adjustment)
    return [
        VectorUnknown(
            name,
            roles.get(i, "vector"),
            tuple(adjustment.state.vectors[i].tolist()),
            matrix(covariance[i]),
            numbers(sigmas(covariance[i])),
        )
        for i, name in enumerate(adjustment.layout.names["vector"])
        if roles.get(i) != ECCENTRICITY_UNKNOWN
    ]


def _planes(adjustment: Adjustment, factor: float) -> list[PlaneUnknown]:
    """Normal and offset; their sigmas and covariance are of the tangent (two turns, offset)."""
    covariance = adjustment.family_covariances("plane") * factor
    state = adjustment.state
    return [
        PlaneUnknown(
            name,
            tuple(state.plane_n[i].tolist()),
            float(state.plane_d[i]),
            matrix(covariance[i]),
            numbers(sigmas(covariance[i])),
        )
        for i, name in enumerate(adjustment.layout.names["plane"])
    ]


def correlations(adjustment: Adjustment, limit: float = CORRELATED) -> tuple[CorrelationRow, ...]:
    """Pairs of unknowns other than point coordinates with ``|rho| > limit``, strongest first.

    Points are left out: how their coordinates go together shows in their ellipses. So are
    eccentricities, which nobody wants to know. In networks
    with more than :data:`MOST_UNKNOWNS` such unknowns the list is empty.
    """
    layout = adjustment.layout
    columns = adjustment.free_columns
    shared = [i for i, role in _roles(adjustment).items() if role == ECCENTRICITY_UNKNOWN]
    eccentric = layout.columns("vector", np.array(shared, dtype=np.int64))
    others = (columns >= 3 * layout.count("point")) & ~np.isin(columns, eccentric)
    chosen = np.flatnonzero(others)
    if len(chosen) < 2 or len(chosen) > MOST_UNKNOWNS:
        return ()
    unit = np.zeros((len(columns), len(chosen)))
    unit[chosen, np.arange(len(chosen))] = 1.0
    q = adjustment.cofactor.solve(unit)[chosen]
    sigma = np.sqrt(np.maximum(np.diag(q), 0.0))
    good = sigma > 1e-12 * sigma.max(initial=0.0)
    size = np.where(good, sigma, np.inf)
    rho = np.triu(q / np.outer(size, size), 1)
    i, j = np.nonzero(np.abs(rho) > limit)
    order = largest_first(np.abs(rho[i, j]))[:MOST_PAIRS]
    label = [layout.label(int(c)) for c in columns[chosen]]
    return tuple(
        CorrelationRow(label[a], label[b], float(rho[a, b]))
        for a, b in zip(i[order], j[order], strict=True)
    )


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; its tables have no rows where points and stations are all unknowns."""
    yield Chapter(
        "unknowns", "Other unknowns", tables=(_unknown_table(head), _correlation_table(head))
    )


def _unknown_table(head: Head) -> ReportTable:
    """Orientations, calibration parameters, lever arms and planes."""
    note = (
        f"Sigmas are {head.origin}. Sigmas of a plane are those of two turns of its normal "
        "and of its offset."
    )
    # numbers lie one below the other unless an unknown has several
    one = all(len(unknown.values) == 1 for unknown in head.unknowns)
    columns: list[Spec] = [
        head.columns.word("Name", "name"),
        (ColumnHead("What", numeric=False), _what),
        head.columns.word("At", "at"),
        (ColumnHead("value", numeric=one), _values(head.columns.style)),
        (ColumnHead("σ", numeric=one), _sigmas(head.columns.style)),
    ]
    return build_table("unknowns", "Other unknowns", note, head.unknowns, columns, worst=_WORST)


def _what(unknown: Unknown) -> Cell:
    """What an unknown is; a calibration parameter by the name of its error."""
    if unknown.role != "calibration":
        return text_cell(unknown.role)
    return text_cell(f"calibration: {meaning_of(unknown.name.split('(')[0])}")


def _values(style: Style) -> Callable[[Unknown], Cell]:
    """Estimates with their units."""

    def cell(unknown: Unknown) -> Cell:
        if len(unknown.values) == 1:
            ((value, unit),) = unknown.values
            return number_cell(value, style.value(value, unit), unit=style.value_unit(unit))
        parts = [
            f"{style.value(v, unit)} {style.value_unit(unit)}".strip() for v, unit in unknown.values
        ]
        return Cell("; ".join(parts), unknown.values[0][0])

    return cell


def _sigmas(style: Style) -> Callable[[Unknown], Cell]:
    """Standard deviations with their units; what is held says so."""

    def cell(unknown: Unknown) -> Cell:
        (first, unit), *more = unknown.sigmas
        if not more and first is not None:
            return number_cell(first, style.small(first, unit), unit=style.small_unit(unit))
        parts = [
            "held" if s is None else f"{style.small(s, unit)} {style.small_unit(unit)}"
            for s, unit in unknown.sigmas
        ]
        return Cell("; ".join(parts), first)

    return cell


def _correlation_table(head: Head) -> ReportTable:
    """Unknowns that are hard to tell apart."""
    columns: list[Spec] = [
        head.columns.word("Unknown", "a"),
        head.columns.word("and", "b"),
        head.columns.plain("correlation", "value", 3),
    ]
    note = Sentence(
        "Pairs of unknowns other than point coordinates, stronger than {limit:g}.",
        limit=0.7,
    )
    return build_table("correlations", "Correlations", note, head.correlations, columns)


SUBJECT = Subject("unknowns", _chapters)
