"""What a comparison of clouds says, its tables and pictures, for runs and for two clouds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tribrach.comparison.c2c import C2C
from tribrach.comparison.compared import CloudComparison
from tribrach.comparison.predicted import BAND, OffsetTest
from tribrach.comparison.predicted_classes import PredictedClass
from tribrach.comparison.results import WHOLE, SiteResult
from tribrach.report.charts import HALF, Chart, beside, colour_bar
from tribrach.report.columns import along, column
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.names import numbered
from tribrach.report.numbers import Style, counted
from tribrach.report.tables import ReportTable, Spec, build_table
from tribrach.report.views import SIZE, views_in_words, views_of
from tribrach.sentences import Sentence, written
from tribrach.units import MM, span

_STYLE = Style()
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
_PREDICTED_NOTE = Sentence(
    "Along the normal. Predicted: noise of single points of both clouds (range, angles, beam, "
    "incidence) and the joint covariance of both stations and of what their scanners do to all "
    "points alike, in which what they share cancels; systematic angles, which no mean reduces. "
    "Observed: scatter of both clouds about their surfaces and the mean distance between them, "
    "free of sampling. C2C debiased says the same from nearest points, less well where the floor "
    "is large. Level of detection: {times:2} times the propagated sigma of single distances.",
    times=1.96,
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
PREDICTED = "predicted-observed"
#: bins of the histogram
_BINS = 100
#: points on the map, all sites together: more of them hide each other and take seconds to draw
_DRAWN = 40_000


def comparison_tables(
    found: CloudComparison, angle_unit: str = "gon", *, moved: bool = False
) -> list[ReportTable]:
    """Sites, distances from point to point and along normals, predictions; those with rows.

    Predictions are for a surface that stood still; with ``moved`` what moved is told elsewhere.
    """
    sites = found.sites
    tables = [_sites(sites, angle_unit), _c2c(sites), _m3c2(sites)]
    if not moved:
        tables += [_predicted(sites), _classes(found, angle_unit)]
    return [table for table in tables if table.rows]


def comparison_findings(found: CloudComparison, *, moved: bool = False) -> list[Finding]:
    """What predictions of a still surface came to, and what is to know of sites."""
    sites_of_note: dict[str, list[str]] = {}
    for site in found.sites:
        for figures in (site.c2c, site.m3c2):
            for note in () if figures is None else figures.notes:
                sites_of_note.setdefault(note.rstrip("."), []).append(site.name)
    return [
        *(() if moved else _prediction_findings(found)),
        *(
            Finding.of("site_note", "{sites}: {note}.", sites=_sites_named(names), note=note)
            for note, names in sites_of_note.items()
        ),
    ]


def _sites_named(names: Sequence[str]) -> str:
    """Site 3; Sites 3 and 4; the clouds, where they are compared as a whole."""
    if list(names) == [WHOLE]:
        return "The clouds"
    if len(names) == 1:
        return f"Site {names[0]}"
    return f"Sites {numbered(names)}"


def _prediction_findings(found: CloudComparison) -> Iterator[Finding]:
    """Predicted against observed: scatter of the points, offsets of the sites."""
    known = [(s.name, s.prediction) for s in found.sites if s.prediction is not None]
    if not known:
        return
    enough = [(name, p) for name, p in known if p.enough]
    if enough:
        ratios = [p.noise_ratio for _, p in enough]
        low, high = written(min(ratios), "2"), written(max(ratios), "2")
        yield Finding.of(
            "scatter",
            "The scatter of single points (standard deviation) is as predicted within 10 % on "
            "{good} of {sites} with enough points (observed over predicted "
            f"{'{low:2}' if low == high else '{low:2} to {high:2}'}).",
            good=sum(p.noise_agrees for _, p in enough),
            sites=counted(len(enough), "site"),
            low=min(ratios),
            high=max(ratios),
        )
    few = [name for name, p in known if not p.enough]
    if few:
        yield Finding.of("few_points", "Too few points to tell 10 % on {n}.", n=", ".join(few))
    if found.offsets is not None:
        yield offsets_finding(found.offsets)
        far = found.offsets.statistic > found.offsets.limit
        if far and found.offsets.count > 1 and all(p.offset_agrees for _, p in known):
            yield Finding(_BOTH, key="together_only")
    for name, p in enough:
        if p.verdict != "as predicted":
            yield Finding.of("site", "Site {name}: {p.verdict}.", name=name, p=p)


def offsets_finding(test: OffsetTest) -> Finding:
    """The test of all offsets together."""
    several = "Taken together, the offsets of {t.count} sites are"
    taken = "The offset of the site is" if test.count == 1 else several
    how, cure = "as large as", ""
    if test.statistic > test.limit:
        how = "larger than"
        cure = (
            "; look at the sites with the largest ratio of offset and sigma, and for errors of the "
            "scanners that the sigmas of the stations leave out"
        )
    elif test.statistic < test.least:
        how = "smaller than"
    return Finding.of(
        "offsets",
        f"{taken} {{how}} the joint covariance of the stations says: chi-square {{t.statistic:1}}, "
        "where {t.least:1} to {t.limit:1} is to be expected in 95 of 100 surveys{cure}.",
        t=test,
        how=how,
        cure=cure,
    )


def comparison_pictures(found: CloudComparison) -> list[Picture]:
    """Map, histogram, and predicted against observed, those that there is anything for."""
    figures = [_map(found.sites), _histogram(found.sites, found.limit), _ratios(found.sites)]
    return [one for one in figures if one is not None]


def _mm(head: str, path: str, *, wide: bool = False) -> Spec:
    """Small lengths in millimetres, with more digits where all would be zero."""
    return column(head, path, lambda value, _: _STYLE.small(value, "m"), unit="mm", wide=wide)


def _pitch(of: str, *, wide: bool = False) -> Spec:
    """Pitch of a cloud across by upwards."""
    path = f"c2c.pitch_{of.lower()}"
    up = along(f"{path}.up")
    return column(
        f"pitch {of}",
        f"{path}.across",
        lambda across, site: Sentence("{across:mm1~}×{up:mm1~}", across=across, up=up(site)),
        unit="mm",
        wide=wide,
    )


def _sites(sites: Sequence[SiteResult], unit: str) -> ReportTable:
    angle = "gon1" if unit == "gon" else "°1"
    columns = [
        column("Site", "name"),
        column("points of A", "n", "0"),
        column("range A", "seen_a.range", "m2"),
        column("range B", "seen_b.range", "m2"),
        column("incidence A", "seen_a.incidence", angle),
        column("incidence B", "seen_b.incidence", angle),
        _pitch("A", wide=True),
        _pitch("B"),
        _mm("predicted σ", "predicted_sigma"),
    ]
    return build_table("sites", "Sites", _SITE_NOTE, sites, columns)


def _c2c(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.c2c is not None]
    columns = [
        column("Site", "name"),
        _mm("mean", "c2c.mean"),
        _mm("floor", "c2c.floor_mean"),
        _mm("std", "c2c.std"),
        _mm("floor", "c2c.floor_std"),
        _mm("RMS", "c2c.rms"),
        _mm("floor", "c2c.floor_rms"),
        _mm("debiased", "c2c.debiased_rms"),
        _mm("median", "c2c.median", wide=True),
        _mm("95 %", "c2c.q95", wide=True),
        column("beyond", "c2c.beyond", "%1", wide=True),
        _mm("plane mean", "c2c.local_plane.mean", wide=True),
        _mm("plane std", "c2c.local_plane.std"),
    ]
    return build_table("c2c", "Nearest points (C2C)", _C2C_NOTE, rows, columns)


def _m3c2(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.m3c2 is not None]
    columns = [
        column("Site", "name"),
        column("core points", "m3c2.n", "0"),
        _mm("mean", "m3c2.mean"),
        _mm("its σ", "prediction.offset_sigma"),
        _mm("std", "m3c2.std"),
        _mm("LoD", "m3c2.lod95"),
        _mm("quadratic", "m3c2.lod95_quadratic"),
        column("beyond it", "m3c2.changed", "%1"),
        _mm("cylinder", "m3c2.cylinder", wide=True),
        _mm("normals over", "m3c2.scale", wide=True),
    ]
    return build_table("m3c2", "Along normals (M3C2)", _M3C2_NOTE, rows, columns)


def _predicted(sites: Sequence[SiteResult]) -> ReportTable:
    rows = [s for s in sites if s.prediction is not None]
    marks = {"as predicted": "good", "too few points to tell 10 %": ""}
    columns = [
        column("Site", "name"),
        _mm("noise A", "prediction.noise_a", wide=True),
        _mm("noise B", "prediction.noise_b", wide=True),
        _mm("scatter A", "prediction.scatter_a", wide=True),
        _mm("scatter B", "prediction.scatter_b", wide=True),
        column("scatter/noise", "prediction.noise_ratio", "2"),
        _mm("offset", "prediction.offset"),
        _mm("its σ", "prediction.offset_sigma"),
        _mm("stations σ", "prediction.registration", wide=True),
        _mm("angles σ", "prediction.angles", wide=True),
        _mm("predicted", "prediction.sigma"),
        _mm("observed", "prediction.observed"),
        column("ratio", "prediction.ratio", "2"),
        _mm("C2C debiased", "c2c.debiased_rms"),
        _mm("LoD", "prediction.lod95", wide=True),
        column("beyond it", "prediction.changed", "%1", wide=True),
        column(
            "Verdict", "prediction.verdict", mark=lambda s: marks.get(s.prediction.verdict, "bad")
        ),
    ]
    return build_table("predicted", "Predicted against observed", _PREDICTED_NOTE, rows, columns)


def _classes(found: CloudComparison, unit: str) -> ReportTable:
    """Predicted against observed by intensity, range and incidence."""
    columns = [
        column("Clouds seen at", lambda c: _seen_at(c, unit)),
        column("clouds", "clouds", "0"),
        _mm("noise", "noise"),
        _mm("scatter", "scatter"),
        column("ratio", "ratio", "2"),
        column("from", lambda c: c.limits[0], "2"),
        column("to", lambda c: c.limits[1], "2"),
        _mm("offset σ", "offset_sigma"),
        _mm("offset", "offset"),
        column("Verdict", "verdict"),
    ]
    title = "Predicted against observed by class"
    return build_table("predicted-classes", title, _CLASSES_NOTE, found.classes, columns)


def _seen_at(one: PredictedClass, unit: str) -> str:
    """A class in words."""
    if one.by == "intensity":
        return f"intensity {span(one.low, one.high)}"
    if one.by == "range":
        return f"range {span(round(one.low, 1), round(one.high, 1))} m"
    factor = 200 / np.pi if unit == "gon" else 180 / np.pi
    sign = " gon" if unit == "gon" else "°"
    return f"incidence {span(round(factor * one.low), round(factor * one.high))}{sign}"


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
        Sentence("{name}: predicted {p.sigma:mm2}, observed {p.observed:mm2}", name=name, p=p)
        for name, p in zip(named, known, strict=True)
    ]
    chart.points(predicted, observed, words)
    caption = "Along the normal, single points of both clouds; the band is 10 % to both sides."
    title = "Sites, predicted against observed"
    return Picture(PREDICTED, title, beside([[chart]], title), caption)


def _map(sites: Sequence[SiteResult]) -> Picture | None:
    """Distances in plan and in elevation along the longer side of the plan."""
    samples = [s.c2c.sample for s in sites if s.c2c is not None and s.c2c.n]
    if not samples:
        return None
    rows = np.concatenate(samples)
    rows = rows[:: -(-len(rows) // _DRAWN)]
    rows = rows[np.argsort(rows[:, 3])]
    xyz, d = rows[:, :3], rows[:, 3]
    top = max(1e3 * float(np.quantile(d, 0.98)), 1e-3)
    # a plan that is a line shows nothing that the elevation does not
    views = views_of(xyz, "xyz", level=True)
    panels = []
    for view in views:
        panel = view.panel()
        panel.cloud(*view.of(xyz), 1e3 * d / top)
        panels.append([panel])
    scale = colour_bar(0.0, top, "nearest-neighbour distance [mm]", SIZE[0])
    words = views_in_words(views)
    caption = Sentence(
        "{words}; a sample of {rows:,} points, colours up to the 98 % quantile.",
        words=words,
        rows=len(rows),
    )
    drawing = beside(panels, "Distances", scale)
    return Picture("distances", "Distances", drawing, caption, wide=True)


def _histogram(sites: Sequence[SiteResult], limit: float) -> Picture | None:
    """Share of the distances per bin, all sites together, with the mean floor."""
    results: list[C2C] = [s.c2c for s in sites if s.c2c is not None and s.c2c.n]
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
            words = Sentence(
                "{low:mm2~} to {high:mm2}: {count:,} points",
                low=low * MM,
                high=high * MM,
                count=count,
            )
            chart.bar(low, min(high, end), 0.0, float(count), "s0", words)
    known = [(one.floor.mean, one.n) for one in results if one.floor is not None]
    if known:
        mean = 1e3 * float(np.average([m for m, _ in known], weights=[n for _, n in known]))
        words = Sentence("mean floor {mean:mm1}", mean=mean * MM)
        chart.line([mean, mean], [0.0, 1.02 * counts.max()], "ink", dashed=True, words=words)
    floor = Sentence(" Dashed: the mean floor, {mean:mm1}.", mean=mean * MM) if known else ""
    caption = Sentence(
        "All sites; {count:,} distances within {limit:mmg}.{floor}",
        count=int(counts.sum()),
        limit=limit,
        floor=floor,
    )
    return Picture("histogram-distances", title, beside([[chart]], title), caption)
