"""A comparison of two clouds as tables and as a page with a map and a histogram."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.comparison.predicted import BAND, OffsetTest
from tribrach.comparison.predicted_classes import PredictedClass, predicted_classes
from tribrach.comparison.results import WHOLE, SiteResult
from tribrach.report.charts import HALF, Chart, beside, colour_bar
from tribrach.report.columns import ColumnSet
from tribrach.report.figures import Picture
from tribrach.report.motion_pictures import motions_pictures
from tribrach.report.motions import motions_front, motions_sentences, motions_tables
from tribrach.report.names import numbered
from tribrach.report.numbers import Style, count_cell, counted, fixed_cell, percent_cell
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import span

if TYPE_CHECKING:
    from tribrach.comparison.c2c import C2C
    from tribrach.job.motions import CloudMotions

__all__ = [
    "comparison_page",
    "comparison_pictures",
    "comparison_sentences",
    "comparison_tables",
    "prediction_sentences",
]

Make = Callable[[SiteResult], Cell]

#: a plan narrower than this share of its length is a line
_LINE = 0.03

_mm = ColumnSet(Style()).mm

_C2C_NOTE = (
    "Distances from points of A to their nearest points of B within the limit: mean, standard "
    "deviation, RMS (root mean square) and median are of these alone, and what is beyond the limit "
    "is counted and not in them. The floor is what "
    "two clouds without any error would show at this pitch; debiased is the RMS after the floor, "
    "empty where nothing is left. Plane: signed distances from the plane through 16 points of B."
)
_M3C2_NOTE = (
    "Distances from B to A along the normals of B, means over cylinders, positive towards the "
    "scanner of B where it is known. The σ of the mean has all that points of a cloud share "
    "(poses, calibration, systematic angles); it is empty where the stations are not known. The "
    "level of detection holds with 95 %; published: a mean difference and the registration added; "
    "quadratic: variances added."
)
_PREDICTED_NOTE = (
    "Along the normal. Predicted: noise of single points of both clouds (range, angles, beam, "
    "incidence) and the joint covariance of both stations and of what their scanners do to all "
    "points alike, in which what they share cancels; systematic angles, which no mean reduces. "
    "Observed: scatter of both clouds about their surfaces and the mean distance between them, "
    "free of sampling. C2C debiased says the same from nearest points, less well where the floor "
    "is large. Level of detection: 1.96 times the propagated sigma of single distances."
)
_SITE_NOTE = (
    "Range and incidence are means over the site as each scanner saw it. Pitch is the spacing of "
    "points on the surface, across by upwards."
)
_CLASSES_NOTE = (
    "All sites together: each cloud at each site is in the class in which its scanner saw it. Own: "
    "noise of single points and what their scatter shows of it, with the limits of the ratio at "
    "95 %, by chi-square; points that several cylinders share count once. Shared: sigma of the "
    "distance between the clouds, which their stations and what neighbours have in common leave "
    "however many points there are, and the distances observed, root mean squares over the sites."
)
#: why sites may be farther apart than predicted together and none of them by itself
_BOTH = (
    "No site by itself is beyond three times the sigma of its offset, so that no row of the table "
    "is called farther apart: the test of all sites together, at 95 %, knows what they share and "
    "adds up many small excesses."
)
#: name of a picture
_PREDICTED = "predicted-observed"
#: bins of the histogram
_BINS = 100
#: points on the map, all sites together: more of them hide each other and take seconds to draw
_DRAWN = 40_000


def comparison_tables(
    sites: Sequence[SiteResult], angle_unit: str = "gon", *, moved: bool = False
) -> list[ReportTable]:
    """Sites, distances from point to point and along normals, predictions; those with rows.

    Predictions are for a surface that stood still; with ``moved`` what moved is told elsewhere.
    """
    tables = [_sites(sites, angle_unit), _c2c(sites), _m3c2(sites)]
    if not moved:
        tables += [_predicted(sites), _classes(sites, angle_unit)]
    return [table for table in tables if table.rows]


def comparison_sentences(
    sites: Sequence[SiteResult], offsets: OffsetTest | None = None, *, moved: bool = False
) -> list[str]:
    """What predictions came to, and what is to be known of single sites.

    Predictions are for a surface that stood still; with ``moved`` what moved is told elsewhere.
    """
    sites_of_note: dict[str, list[str]] = {}
    for site in sites:
        notes = () if site.c2c is None else site.c2c.sentences
        notes += () if site.m3c2 is None else site.m3c2.sentences
        for note in notes:
            sites_of_note.setdefault(note.rstrip("."), []).append(site.name)
    return [
        *(() if moved else prediction_sentences(sites, offsets)),
        *(f"{_sites_named(names)}: {note}." for note, names in sites_of_note.items()),
    ]


def _sites_named(names: Sequence[str]) -> str:
    """Site 3; Sites 3 and 4; the clouds, where they are compared as a whole."""
    if list(names) == [WHOLE]:
        return "The clouds"
    if len(names) == 1:
        return f"Site {names[0]}"
    return f"Sites {numbered(names)}"


def prediction_sentences(
    sites: Sequence[SiteResult], offsets: OffsetTest | None = None
) -> list[str]:
    """Predicted against observed in words: scatter of the points, offsets of the sites."""
    known = [(s.name, s.prediction) for s in sites if s.prediction is not None]
    if not known:
        return []
    enough = [(name, p) for name, p in known if p.enough]
    sentences = []
    if enough:
        good = sum(p.noise_agrees for _, p in enough)
        ratios = [p.noise_ratio for _, p in enough]
        sentences.append(
            f"The scatter of single points (standard deviation) is as predicted within 10 % on "
            f"{good} of {counted(len(enough), 'site')} with enough points (observed over predicted "
            f"{_span(ratios)})."
        )
    few = [name for name, p in known if not p.enough]
    if few:
        sentences.append(f"Too few points to tell 10 % on {', '.join(few)}.")
    if offsets is not None:
        sentences.append(f"{offsets.sentence()}.")
        far = offsets.statistic > offsets.limit
        if far and offsets.count > 1 and all(p.offset_agrees for _, p in known):
            sentences.append(_BOTH)
    sentences += [f"Site {name}: {p.verdict}." for name, p in enough if p.verdict != "as predicted"]
    return sentences


def _span(values: Sequence[float]) -> str:
    """1.02, or 0.98 to 1.02."""
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"


def comparison_page(
    a: str,
    b: str,
    limit: float,
    sites: Sequence[SiteResult],
    offsets: OffsetTest | None = None,
    motions: CloudMotions | None = None,
) -> str:
    """The whole comparison as one HTML file."""
    figures = comparison_pictures(sites, limit)
    sentences = comparison_sentences(sites, offsets, moved=motions is not None)
    tables = comparison_tables(sites, moved=motions is not None)
    first: list[ReportTable] = []
    if motions is not None:
        figures = [one for one in figures if one.name != _PREDICTED]
        figures = [*motions_pictures(motions), *figures]
        sentences = [*motions_sentences(motions), *sentences]
        first = motions_tables(motions)
    return page(
        "Comparison of clouds",
        f"{a} against {b}",
        _front(sites, offsets) if motions is None else motions_front(motions),
        sentences or ["Every site has enough points, and its figures are above sampling."],
        figures,
        tables,
        f"A: {a}; B, the reference: {b}; limit {1e3 * limit:g} mm. Nearest-neighbour distances "
        "are no accuracy: read them beside their floor.",
        first,
    )


def _front(sites: Sequence[SiteResult], offsets: OffsetTest | None) -> FrontPage:
    """Whether the clouds differ by what was predicted."""
    known = [s.prediction for s in sites if s.prediction is not None]
    enough = [p for p in known if p.enough]
    signed = "The distances between these two clouds, with the sigmas stated here."
    if not known:
        sentence = "The stations are not known with their covariance: nothing was predicted."
        return FrontPage("none", "Measured, not judged", sentence, signed=signed)
    good = all(p.noise_agrees for p in enough)
    sort: Literal["good", "bad", "none"]
    if offsets is not None and offsets.statistic > offsets.limit:
        sort, verdict = "bad", "Farther apart than predicted"
    elif not good:
        sort, verdict = "bad", "Scatter not as predicted"
    elif offsets is not None and not offsets.agrees:
        sort, verdict = "none", "Nearer than predicted"
    elif enough:
        sort, verdict = "good", "As predicted"
    else:
        sort, verdict = "none", "Too few points to judge the scatter"
    sentence = f"{offsets.sentence()}." if offsets is not None else ""
    return FrontPage(sort, verdict, sentence, signed=signed)


def comparison_pictures(sites: Sequence[SiteResult], limit: float) -> list[Picture]:
    """Map, histogram, and predicted against observed, those that there is anything for."""
    figures = [_map(sites), _histogram(sites, limit), _ratios(sites)]
    return [one for one in figures if one is not None]


def _sites(sites: Sequence[SiteResult], unit: str) -> ReportTable:
    columns = [
        (ColumnHead("Site", numeric=False), lambda s: text_cell(s.name)),
        (ColumnHead("points of A"), lambda s: count_cell(s.n)),
        _metres("range A", _at("seen_a.range")),
        _metres("range B", _at("seen_b.range")),
        _degrees("incidence A", unit, _at("seen_a.incidence")),
        _degrees("incidence B", unit, _at("seen_b.incidence")),
        (ColumnHead("pitch A", "mm", wide=True), lambda s: _pitch(s, "pitch_a")),
        (ColumnHead("pitch B", "mm"), lambda s: _pitch(s, "pitch_b")),
        _mm("predicted σ", _at("predicted_sigma")),
    ]
    return build_table("sites", "Sites", _SITE_NOTE, sites, columns)


def _c2c(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.c2c is not None]

    columns = [
        (ColumnHead("Site", numeric=False), lambda s: text_cell(s.name)),
        _mm("mean", _at("c2c.mean")),
        _mm("floor", _at("c2c.floor.mean")),
        _mm("std", _at("c2c.std")),
        _mm("floor", _at("c2c.floor.std")),
        _mm("RMS", _at("c2c.rms")),
        _mm("floor", _at("c2c.floor.rms")),
        _mm("debiased", _at("c2c.debiased")),
        _mm("median", _at("c2c.median"), wide=True),
        _mm("95 %", _at("c2c.q95"), wide=True),
        _percent("beyond", "c2c.beyond", wide=True),
        _mm("plane mean", _at("c2c.plane.mean"), wide=True),
        _mm("plane std", _at("c2c.plane.std")),
    ]
    return build_table("c2c", "Nearest points (C2C)", _C2C_NOTE, rows, columns)


def _m3c2(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.m3c2 is not None]

    columns = [
        (ColumnHead("Site", numeric=False), lambda s: text_cell(s.name)),
        (ColumnHead("core points"), lambda s: count_cell(_at("m3c2.count")(s))),
        _mm("mean", _at("m3c2.mean")),
        _mm("its σ", _at("prediction.offset_sigma")),
        _mm("std", _at("m3c2.std")),
        _mm("LoD", _at("m3c2.lod95")),
        _mm("quadratic", _at("m3c2.lod95_quadratic")),
        _percent("beyond it", "m3c2.changed"),
        _mm("cylinder", _at("m3c2.cylinder"), wide=True),
        _mm("normals over", _at("m3c2.scale"), wide=True),
    ]
    return build_table("m3c2", "Along normals (M3C2)", _M3C2_NOTE, rows, columns)


def _predicted(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.prediction is not None]

    def verdict(site: SiteResult) -> Cell:
        assert site.prediction is not None
        words = site.prediction.verdict
        mark = {"as predicted": "good", "too few points to tell 10 %": ""}.get(words, "bad")
        return text_cell(words, mark)

    columns = [
        (ColumnHead("Site", numeric=False), lambda s: text_cell(s.name)),
        _mm("noise A", _pair("noise", 1), wide=True),
        _mm("noise B", _pair("noise", 0), wide=True),
        _mm("scatter A", _pair("scatter", 1), wide=True),
        _mm("scatter B", _pair("scatter", 0), wide=True),
        (ColumnHead("scatter/noise"), lambda s: fixed_cell(s.prediction.noise_ratio, 2)),
        _mm("offset", _at("prediction.offset")),
        _mm("its σ", _at("prediction.offset_sigma")),
        _mm("stations σ", _at("prediction.registration"), wide=True),
        _mm("angles σ", _at("prediction.angles"), wide=True),
        _mm("predicted", _at("prediction.sigma")),
        _mm("observed", _at("prediction.observed")),
        (ColumnHead("ratio"), lambda s: fixed_cell(s.prediction.ratio, 2)),
        _mm("C2C debiased", _at("c2c.debiased")),
        _mm("LoD", _at("prediction.lod95"), wide=True),
        _percent("beyond it", "prediction.changed", wide=True),
        (ColumnHead("Verdict", numeric=False), verdict),
    ]
    return build_table("predicted", "Predicted against observed", _PREDICTED_NOTE, rows, columns)


def _classes(sites: Sequence[SiteResult], unit: str) -> ReportTable:
    """Predicted against observed by intensity, range and incidence."""
    mm = ColumnSet(Style()).mm
    columns = [
        (ColumnHead("Clouds seen at", numeric=False), lambda c: text_cell(_seen_at(c, unit))),
        (ColumnHead("clouds"), lambda c: count_cell(c.clouds)),
        mm("noise", lambda c: c.noise),
        mm("scatter", lambda c: c.scatter),
        (ColumnHead("ratio"), lambda c: fixed_cell(c.ratio, 2)),
        (ColumnHead("from"), lambda c: fixed_cell(c.limits[0], 2)),
        (ColumnHead("to"), lambda c: fixed_cell(c.limits[1], 2)),
        mm("offset σ", lambda c: c.offset_sigma),
        mm("offset", lambda c: c.offset),
        (ColumnHead("Verdict", numeric=False), lambda c: text_cell(c.verdict)),
    ]
    rows = predicted_classes(sites)
    title = "Predicted against observed by class"
    return build_table("predicted-classes", title, _CLASSES_NOTE, rows, columns)


def _seen_at(one: PredictedClass, unit: str) -> str:
    """A class in words."""
    if one.by == "intensity":
        return f"intensity {span(one.low, one.high)}"
    if one.by == "range":
        return f"range {span(round(one.low, 1), round(one.high, 1))} m"
    factor = 200 / np.pi if unit == "gon" else 180 / np.pi
    sign = " gon" if unit == "gon" else "°"
    return f"incidence {span(round(factor * one.low), round(factor * one.high))}{sign}"


def _pair(name: str, k: int) -> Callable[[SiteResult], float | None]:
    """One of both clouds' figures of a prediction."""

    def get(site: SiteResult) -> float | None:
        both = getattr(site.prediction, name, None)
        return None if both is None else float(both[k])

    return get


def _ratios(sites: Sequence[SiteResult]) -> Picture | None:
    """Observed against predicted sigma of every site with enough points."""
    known = [s.prediction for s in sites if s.prediction is not None and s.prediction.enough]
    if not known:
        return None
    predicted = 1e3 * np.array([p.sigma for p in known])
    observed = 1e3 * np.array([p.observed for p in known])
    end = 1.1 * float(max(predicted.max(), observed.max()))
    chart = Chart((0.0, end), (0.0, end), ("predicted [mm]", "observed [mm]"), HALF)
    # the upper edge of the band leaves the panel at its top
    chart.area([0.0, end, end, end / BAND[1]], [0.0, BAND[0] * end, end, end], "s0")
    chart.line([0.0, end], [0.0, end])
    named = [s.name for s in sites if s.prediction is not None and s.prediction.enough]
    words = [
        f"{name}: predicted {p:.2f} mm, observed {o:.2f} mm"
        for name, p, o in zip(named, predicted, observed, strict=True)
    ]
    chart.points(predicted, observed, words)
    caption = "Along the normal, single points of both clouds; the band is 10 % to both sides."
    title = "Sites, predicted against observed"
    return Picture(_PREDICTED, title, beside([[chart]], title), caption)


def _at(path: str) -> Callable[[SiteResult], float | None]:
    """A number of a site by the names that lead to it; None where one of them is None."""

    def get(site: SiteResult) -> float | None:
        value: Any = site
        for name in path.split("."):
            value = None if value is None else getattr(value, name)
        return None if value is None else float(value)

    return get


def _metres(head: str, get: Callable[[SiteResult], float | None]) -> tuple[ColumnHead, Make]:
    return ColumnHead(head, "m"), lambda s: number_cell(get(s), Style.plain(get(s), 2))


def _degrees(
    head: str, unit: str, get: Callable[[SiteResult], float | None]
) -> tuple[ColumnHead, Make]:
    factor = 200 / np.pi if unit == "gon" else 180 / np.pi

    def cell(site: SiteResult) -> Cell:
        angle = get(site)
        return number_cell(angle, "" if angle is None else f"{factor * angle:.1f}")

    return ColumnHead(head, "gon" if unit == "gon" else "°"), cell


def _pitch(site: SiteResult, name: str) -> Cell:
    pitch = getattr(site.c2c, name, None)
    if pitch is None:
        return text_cell("")
    return number_cell(pitch.across, f"{1e3 * pitch.across:.1f}×{1e3 * pitch.up:.1f}")


def _percent(head: str, path: str, *, wide: bool = False) -> tuple[ColumnHead, Make]:
    def cell(site: SiteResult) -> Cell:
        return percent_cell(_at(path)(site))

    return ColumnHead(head, "%", wide=wide), cell


def _map(sites: Sequence[SiteResult]) -> Picture | None:
    """Distances in plan and in elevation along the longer side of the plan."""
    samples = [s.c2c.sample for s in sites if s.c2c is not None and s.c2c.count]
    if not samples:
        return None
    rows = np.concatenate(samples)
    rows = rows[:: -(-len(rows) // _DRAWN)]
    rows = rows[np.argsort(rows[:, 3])]
    corner = np.floor(rows[:, :3].min(axis=0) / 10) * 10
    x, y, z, d = (rows - np.append(corner, 0)).T
    along, name = (x, "x") if np.ptp(x) >= np.ptp(y) else (y, "y")
    top = max(1e3 * float(np.quantile(d, 0.98)), 1e-3)
    start = {"x": corner[0], "y": corner[1], "z": corner[2]}
    # a plan that is a line shows nothing that the elevation does not
    flat = min(np.ptp(x), np.ptp(y)) < _LINE * max(np.ptp(x), np.ptp(y))
    views = [] if flat else [(x, y, "xy")]
    views.append((along, z, f"{name}z"))
    rows_of_panels = []
    for u, v, names in views:
        labels = [f"{axis}{_less(start[axis])} [m]" for axis in names]
        panel = Chart(_wide(u), _wide(v), (labels[0], labels[1]), (900.0, 420.0), equal=True)
        panel.cloud(u, v, 1e3 * d / top)
        rows_of_panels.append([panel])
    scale = colour_bar(0.0, top, "nearest-neighbour distance [mm]", 900.0)
    what = "Elevation" if flat else "Plan and elevation"
    caption = f"{what}; a sample of {len(rows):,} points, colours up to the 98 % quantile."
    drawing = beside(rows_of_panels, "Distances", scale)
    return Picture("distances", "Distances", drawing, caption, wide=True)


def _less(start: float) -> str:
    """What an axis is shortened by."""
    return f" - {start:.0f}" if start > 0 else f" + {-start:.0f}" if start < 0 else ""


def _wide(values: Array) -> tuple[float, float]:
    """Ends of an axis with a little space beside the values."""
    low, high = float(values.min()), float(values.max())
    margin = 0.03 * (high - low) + 1e-6
    return low - margin, high + margin


def _histogram(sites: Sequence[SiteResult], limit: float) -> Picture | None:
    """Share of the distances per bin, all sites together, with the mean floor."""
    results: list[C2C] = [s.c2c for s in sites if s.c2c is not None and s.c2c.count]
    if not results:
        return None
    edges = results[0].tally.histogram(_BINS)[0]
    counts = np.sum([one.tally.histogram(_BINS)[1] for one in results], axis=0)
    last = int(np.searchsorted(np.cumsum(counts), 0.999 * counts.sum())) + 1
    end = 1e3 * float(edges[min(last + 1, _BINS)])
    title = "Histogram of distances"
    labels = ("nearest-neighbour distance [mm]", "points")
    chart = Chart((0.0, end), (0.0, 1.05 * float(counts.max())), labels, HALF)
    for low, high, count in zip(1e3 * edges[:-1], 1e3 * edges[1:], counts, strict=True):
        if count and low < end:
            words = f"{low:.2f} to {high:.2f} mm: {count:,} points"
            chart.bar(low, min(high, end), 0.0, float(count), "s0", words)
    known = [(one.floor.mean, one.count) for one in results if one.floor is not None]
    if known:
        mean = 1e3 * float(np.average([m for m, _ in known], weights=[n for _, n in known]))
        words = f"mean floor {mean:.1f} mm"
        chart.line([mean, mean], [0.0, 1.02 * counts.max()], "ink", dashed=True, words=words)
    floor = f" Dashed: the mean floor, {mean:.1f} mm." if known else ""
    caption = f"All sites; {counts.sum():,} distances within {1e3 * limit:g} mm.{floor}"
    return Picture("histogram-distances", title, beside([[chart]], title), caption)
