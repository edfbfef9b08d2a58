"""From an adjustment, its quality and what a job left besides to the content of a report."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from dataclasses import fields
from importlib.metadata import version
from typing import Literal

from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.job.results import JobResults
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.snooping import SnoopingLog
from tribrach.network.facts import HEIGHTS, AssumedSigmas, ListReading, Reference, facts_of
from tribrach.network.observation_rows import observation_rows
from tribrach.network.quality import Quality
from tribrach.network.variance_components import VarianceComponents
from tribrach.report.chapters import subjects
from tribrach.report.chapters.adjustment import adjustment_warnings
from tribrach.report.chapters.control import control
from tribrach.report.chapters.georeferencing import site_warnings
from tribrach.report.chapters.points import points, position_uncertainty
from tribrach.report.chapters.stations import stations
from tribrach.report.chapters.unknowns import correlations, other_unknowns
from tribrach.report.content import ComponentRow, Head, Report, ReportSettings, SnoopingRow
from tribrach.report.names import spoken
from tribrach.report.numbers import number
from tribrach.report.summary import datum_statement, sigma_origin, summary
from tribrach.report.warnings import ReportWarning, Severity, in_order
from tribrach.sentences import Sentence, joined
from tribrach.units import format_angle

NOTHING = JobResults()


def build(
    adjustment: Adjustment,
    quality: Quality,
    *,
    confidence: float = 0.95,
    posterior: bool = False,
    angle: Literal["gon", "deg"] = "gon",
    title: str | None = None,
    date: str | None = None,
    facts: Mapping[str, str] | None = None,
    snooping: SnoopingLog | None = None,
    components: VarianceComponents | None = None,
    warnings: Iterable[ReportWarning] = (),
    apart: Adjustment | None = None,
    job: JobResults = NOTHING,
) -> Report:
    """Everything a report says about an adjustment."""
    settings = ReportSettings(confidence, posterior, quality.global_test.alpha, angle)
    covariances, uncertainty = position_uncertainty(adjustment, settings)
    rows = observation_rows(adjustment, quality)
    network = adjustment.network
    head = Head(
        title=title or network.title or "Network adjustment",
        version=version("tribrach"),
        date=date or datetime.date.today().isoformat(),
        facts=_facts(adjustment, rows.column("source").tolist(), facts or {}),
        settings=settings,
        datum=datum_statement(adjustment),
        sigma_origin=sigma_origin(adjustment, posterior, components),
        readings=tuple(
            f"{fact.file}: {joined('; ', fact.sentences)}."
            for fact in facts_of(adjustment.network.facts, ListReading)
        ),
        summary=summary(adjustment, quality, posterior),
        control=control(adjustment, settings),
        points=points(adjustment, quality, settings, covariances, uncertainty),
        stations=stations(adjustment, settings, uncertainty),
        unknowns=other_unknowns(adjustment, settings),
        observations=rows,
        components=_components(components),
        snooping=_snooping(snooping),
        correlations=correlations(adjustment),
        adjustment=adjustment,
        quality=quality,
        apart=adjustment if apart is None else apart,
    )
    asked = subjects(head, job)
    made = [chapter for subject in asked for chapter in subject.chapters(head, job)]
    chapters = tuple(sorted(made, key=lambda chapter: not chapter.signed))
    graded = [*adjustment_warnings(head), *site_warnings(head, job), *warnings]
    graded += [warning for chapter in chapters for warning in chapter.warnings]
    given = {item.name: getattr(head, item.name) for item in fields(Head)}
    grave = in_order(w for w in graded if w.severity <= Severity.DOUBT)
    return Report(**given, warnings=in_order(graded), grave=len(grave), chapters=chapters, job=job)


def _facts(
    adjustment: Adjustment, sources: list[str], facts: Mapping[str, str]
) -> tuple[tuple[str, str], ...]:
    """Lines of the head: what the caller gives, the reference system, the files."""
    written = dict.fromkeys(s.rsplit(":", 1)[0] for s in sources if s)
    files = list(dict.fromkeys(map(spoken, written)))
    lines = [*facts.items(), ("Reference system", _reference(adjustment))]
    if files:
        more = f" and {len(files) - 8} more" if len(files) > 8 else ""
        lines.append(("Files", "; ".join(files[:8]) + more))
    for fact in adjustment.network.facts:
        if isinstance(fact, ListReading):
            lines.append((f"How {fact.file} was read", joined("; ", fact.sentences)))
        elif isinstance(fact, AssumedSigmas):
            lines.append((f"Sigmas of {fact.file}", fact.sentence))
    return tuple(lines)


def _reference(adjustment: Adjustment) -> str:
    """The work frame in words."""
    site, reference = adjustment.network.site, adjustment.network.reference
    if isinstance(site, EllipsoidSite):
        latitude, longitude = (
            format_angle(value, "dms", 3) for value in (site.latitude, site.longitude)
        )
        place: str = Sentence(
            "local East-North-Up at latitude {latitude}, longitude {longitude}, "
            "ellipsoidal height {site.ellipsoidal_height:m3}",
            latitude=latitude,
            longitude=longitude,
            site=site,
        )
    else:
        place = "plane East-North-Up, parallel verticals"
        if isinstance(site, FlatSite) and site.curvature_radius:
            place += Sentence(
                ", Earth radius {site.curvature_radius:km1} for zenith angles", site=site
            )
    heights = "" if reference.heights is None else f"{HEIGHTS[reference.heights]}s"
    known = reference.crs, heights, _epoch(reference), place
    return joined("; ", (text for text in known if text))


def _epoch(reference: Reference) -> str:
    """Frame and epoch in words, "" where there are none."""
    when = (
        ""
        if reference.epoch is None
        else Sentence("epoch {reference.epoch:2}", reference=reference)
    )
    return joined(", ", (text for text in (reference.frame, when) if text))


def _components(components: VarianceComponents | None) -> tuple[ComponentRow, ...]:
    """Variance components as the report lists them."""
    if components is None:
        return ()
    return tuple(
        ComponentRow(c.group, c.sigma_factor, number(c.sigma_of_factor), c.redundancy, c.note)
        for c in components.components
    )


def _snooping(log: SnoopingLog | None) -> tuple[SnoopingRow, ...]:
    """Steps of the snooping, numbered."""
    if log is None:
        return ()
    return tuple(
        SnoopingRow(
            number=i + 1,
            observation=step.observation,
            test=number(step.statistic),
            limit=number(step.critical),
            error=number(step.gross_error) if step.gross_error else None,
            unit=step.unit,
            action=step.action,
        )
        for i, step in enumerate(log.steps)
    )
