"""The chapter on georeferencing: what is absolute, what is relative, in numbers and in words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result, Vector
from tribrach.geodesy.projection import flat_effects
from tribrach.geodesy.site import FlatSite
from tribrach.network.adjustment import Adjustment
from tribrach.network.facts import frame_sentences
from tribrach.network.site_accuracy import CommonShift, SiteAccuracy, sessions, site_accuracy
from tribrach.observations.base import Use
from tribrach.observations.declaration import Category, Role
from tribrach.report.chapter import Chapter
from tribrach.report.columns import component
from tribrach.report.content import Head
from tribrach.report.numbers import Style
from tribrach.report.subject import Subject
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell
from tribrach.report.warnings import ReportWarning, Severity, warned
from tribrach.sentences import Sentence, capital, joined

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.project import Project

#: what is neglected counts beyond this share of the sigma of a place: below it the error of a
#: place grows by a twentieth at most
_COUNTS = 1 / 3


@dataclass(frozen=True)
class AbsolutePart(Result):
    """How well the site as a whole is known [m, rad]."""

    shift: Vector
    turn: Vector
    place: Vector  #: one place, root mean square of all
    common: dict[str, CommonShift]  #: what the positions of a session have in common


@dataclass(frozen=True)
class RelativePart(Result):
    """How well places of the site are known to each other [m]."""

    within: Vector
    pair: Vector
    worst: Vector
    worst_between: tuple[str, ...]


@dataclass(frozen=True)
class CheckPointsPart(Result):
    """Root mean square of the differences at check points [m]."""

    points: int
    rmse: Vector


@dataclass(frozen=True)
class GeoreferencingPart(Result):
    """Absolute and relative accuracy."""

    absolute: AbsolutePart | None
    relative: RelativePart
    check: CheckPointsPart | None
    radius: float


@dataclass(frozen=True)
class _Row:
    what: str
    sigma: tuple[float, float, float]
    remark: str


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where the network of a project in space has three places or more."""
    adjustment = head.adjustment
    # in a large network the joint covariance takes long, and without a project nobody reads it
    accuracy = None if job.project is None else site_accuracy(adjustment, head.variance_factor)
    if job.project is None or accuracy is None:
        return
    common = sessions(adjustment)
    check = _check_rmse(head)
    free = head.datum.kind == "free" or adjustment.defect > 0
    rows = _rows(accuracy, common, free)
    sentences = [
        *_rests_on(head, job.project, adjustment, common),
        *_words(accuracy, common, free, head.columns.style),
        _checked(check),
    ]
    yield Chapter(
        "georeferencing",
        "Georeferencing",
        (
            *(capital(text) + "." for text in sentences),
            *frame_sentences(adjustment.network.facts, vectors=False),
        ),
        (),
        (_table(rows, head),),
        _data(accuracy, common, check, free),
    )


def site_warnings(head: Head, job: JobResults) -> tuple[ReportWarning, ...]:
    """What a flat site neglects, to be looked into only where the network could show it."""
    network, project = head.adjustment.network, job.project
    if project is None or project.site.kind != "flat" or not isinstance(network.site, FlatSite):
        return ()
    xyz, sigma = (
        np.array([getattr(p, name) for p in head.points], dtype=float).reshape(-1, 3)
        for name in ("xyz", "sigma")
    )
    site = project.site
    out: list[ReportWarning] = []
    for effect in flat_effects(xyz, site.crs, curved=site.curvature_radius_m is not None):
        known = sigma[:, effect.axes][np.isfinite(sigma[:, effect.axes])]
        place = float(np.sqrt((known**2).mean())) if len(known) else 0.0
        counts = effect.size > _COUNTS * place
        severity = Severity.INPUT if counts else Severity.NOTE
        out += warned(severity, [effect.sentence], "flat_site")
    return tuple(out)


def _check_rmse(head: Head) -> CheckPointsPart | None:
    """The check points; None without any."""
    rows = [c.difference for c in head.control if c.use == "check"]
    whole = np.array(
        [[np.nan if v is None else v for v in row] for row in rows], dtype=float
    ).reshape(-1, 3)
    whole = whole[np.isfinite(whole).all(axis=1)]
    return CheckPointsPart(len(whole), np.sqrt((whole**2).mean(axis=0))) if len(whole) else None


def _rests_on(
    head: Head, project: Project, adjustment: Adjustment, common: list[CommonShift]
) -> list[str]:
    """What fixes the site, and in which system."""
    gnss = _active(adjustment, absolute=True)
    vectors = _active(adjustment, absolute=False)
    held = sum(c.use == "held" for c in head.control)
    weighted = sum(c.use == "weighted" for c in head.control)
    parts = [
        f"{n} {what}{'s' * (n > 1)}" for n, what in (
            (gnss, "GNSS position"), (vectors, "GNSS baseline"),
            (weighted, "weighted control point"), (held, "held point"),
        ) if n
    ]  # fmt: skip
    out: list[str] = []
    if parts:
        out.append(
            Sentence(
                "the place of the site rests on {parts}; {system}",
                parts=", ".join(parts),
                system=_system(project),
            )
        )
    if held:
        out.append("held points count as free of errors: theirs are in none of these numbers")
    if gnss and not common:
        out.append(
            "the GNSS positions are taken as independent of each other: if they share a reference, "
            "give them a set, or the site as a whole looks better than it is"
        )
    return out


def _active(adjustment: Adjustment, *, absolute: bool) -> int:
    """How many readings of satellites take part: positions, or vectors between them."""
    return sum(
        int((o.use == Use.ACTIVE).sum())
        for o in adjustment.network.observations
        if o.facts.category is Category.GNSS
        and o.facts.role is Role.READING
        and o.facts.absolute == absolute
    )


def _system(project: Project) -> str:
    """Coordinates and heights in words."""
    site = project.site
    if site.kind == "flat":
        return "coordinates are taken as Cartesian"
    heights = "ellipsoidal heights"
    if site.geoid_grid is not None:
        heights = f"heights through the geoid grid {site.geoid_grid}"
    elif site.geoid_height_m:
        heights = Sentence("heights with one geoid height of {site.geoid_height_m:mg}", site=site)
    if site.geoid_sigma_grid is not None:
        heights = f"{heights} with the sigmas of {site.geoid_sigma_grid}"
    elif site.geoid_sigma_mm:
        heights = Sentence(
            "{heights} with a sigma of {sigma:mmg}",
            heights=heights,
            sigma=site.geoid_sigma_mm / 1e3,
        )
    name = site.crs or "geocentric and local coordinates on GRS80"
    return Sentence("{name}, {heights}, converted point by point", name=name, heights=heights)


def _mm(values: Array) -> str:
    """Three sigmas in words."""
    return joined(
        ", ",
        (
            Sentence("{v:mm2} in {axis}", v=v, axis=axis)
            for v, axis in zip(values, ("E", "N", "U"), strict=True)
        ),
    )


def _words(
    accuracy: SiteAccuracy, common: list[CommonShift], free: bool, style: Style
) -> list[str]:
    """Absolute and relative in words."""
    a, b = accuracy.worst_names
    relative = Sentence(
        "relative: two places of the site are known to each other to {median} (median of "
        "all pairs), at worst {worst} ({a} and {b})",
        median=_mm(accuracy.pair),
        worst=_mm(accuracy.worst),
        a=a,
        b=b,
    )
    if free:
        return [
            "there is no absolute accuracy: inner constraints fix the frame, which has no place "
            "of its own",
            relative,
        ]
    out = [Sentence("absolute: the site as a whole is known to {mm}", mm=_mm(accuracy.shift))]
    for session in common:
        out.append(
            Sentence(
                "of that, {mm} is the {session.name}, the same for its {session.count} "
                "positions: no measurement on the site makes it smaller",
                mm=_mm(session.sigma),
                session=session,
            )
        )
    edge = accuracy.turn * accuracy.radius
    out.append(
        Sentence(
            "as a whole the site may be turned by {turn} in azimuth, {edge:mm2} at its "
            "edge, {accuracy.radius:m0} away, and tilted by {tilt}, {rise:mm2} in height "
            "there",
            turn=_turn(accuracy.turn[2], style),
            edge=edge[2],
            accuracy=accuracy,
            tilt=_turn(float(np.hypot(*accuracy.turn[:2])), style),
            rise=np.hypot(*edge[:2]),
        )
    )
    return [*out, relative]


def _turn(angle: float, style: Style) -> str:
    """A small angle in the unit of the report."""
    return Sentence(f"{{angle:{style.small_unit('rad')}g3}}", angle=angle)


def _checked(check: CheckPointsPart | None) -> str:
    if check is None:
        return (
            "there are no check points: all of these numbers follow from the sigmas that were "
            "given, and nothing independent confirms them"
        )
    n, rmse = check.points, check.rmse
    points = "one check point differs" if n == 1 else f"{n} check points differ"
    return Sentence(
        "independent of that, {points} by {mm} (root mean square)", points=points, mm=_mm(rmse)
    )


def _rows(accuracy: SiteAccuracy, common: list[CommonShift], free: bool) -> list[_Row]:
    def row(what: str, sigma: Array, remark: str) -> _Row:
        return _Row(what, (float(sigma[0]), float(sigma[1]), float(sigma[2])), remark)

    out = []
    if not free:
        out = [
            row("absolute, the site as a whole", accuracy.shift, "shift of its centroid"),
            *(row(f"of that, {s.name}", s.sigma, f"{s.count} positions, a priori") for s in common),
            row("absolute, one place", accuracy.point, "root mean square of all"),
        ]
    return [
        *out,
        row("relative, within the site", accuracy.inner, "without shift and turn of the site"),
        row("relative, two places", accuracy.pair, "median of all pairs"),
        row("relative, two places at worst", accuracy.worst, " and ".join(accuracy.worst_names)),
    ]


def _table(rows: list[_Row], head: Head) -> ReportTable:
    note = (
        f"Standard deviations {head.origin} of targets, points and stations. Absolute errors are "
        "common to all places and show in no residual; relative ones matter within the site."
    )
    columns = [
        (ColumnHead("Accuracy", numeric=False), lambda row: text_cell(row.what)),
        *(head.columns.mm(f"σ {name}", component("sigma", k)) for k, name in enumerate("ENU")),
        (ColumnHead("of", numeric=False), lambda row: text_cell(row.remark)),
    ]
    return build_table("georeferencing", "Absolute and relative accuracy", note, rows, columns)


def _data(
    accuracy: SiteAccuracy, common: list[CommonShift], check: CheckPointsPart | None, free: bool
) -> GeoreferencingPart:
    a, of_sessions = accuracy, {session.name: session for session in common}
    absolute = None if free else AbsolutePart(a.shift, a.turn, a.point, of_sessions)
    relative = RelativePart(a.inner, a.pair, a.worst, a.worst_names)
    return GeoreferencingPart(absolute, relative, check, a.radius)


SUBJECT = Subject("georeferencing", _chapters, GeoreferencingPart)
