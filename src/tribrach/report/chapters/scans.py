"""The chapter on scans: targets found, clouds written, their uncertainty, and their truth if known.

Metres and radians; pictures are WebP files in base64.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.cloud.budget import Weakest, weakest_direction
from tribrach.cloud.summary import EDGES, CloudSummary
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import grid_scale
from tribrach.job.budget import BudgetRow
from tribrach.job.truth import TruthRow
from tribrach.report.chapter import Chapter
from tribrach.report.chapters.error_budget import budget_charts, budget_table
from tribrach.report.characters import anchor
from tribrach.report.charts import Chart, beside, colour_bar
from tribrach.report.columns import ColumnSet, component
from tribrach.report.content import Head
from tribrach.report.figures import Picture
from tribrach.report.names import some_of, spoken
from tribrach.report.numbers import counted
from tribrach.report.panoramas import panorama_drawing
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.report.warnings import ReportWarning, Severity, warned
from tribrach.sentences import Sentence, joined, stopped
from tribrach.units import MM

if TYPE_CHECKING:
    from tribrach.cloud.placement import Placement
    from tribrach.job.clouds import Product
    from tribrach.job.name_targets import Named
    from tribrach.job.results import JobResults
    from tribrach.job.scans import StationScan
    from tribrach.job.steps import PlacedScans
    from tribrach.targets.detection import Detection

Triple = tuple[float, float, float]

_CONVERTED = "; every point was converted by itself, so that nothing of it is lost."
#: radius of the Earth for the size of its curvature [m]
_EARTH = 6371000.0
#: comparisons with the truth that are named where they are not as stated
_NAMED = 4


@dataclass(frozen=True, kw_only=True)
class FoundTarget(Result):
    """A target found in a scan: its number in the picture, the name it got, its numbers.

    center and sigma along x, y, z of the scanner frame; name "" if nothing else saw it; range and
    incidence None where the place of the scanner is not known.
    """

    scan: str
    number: int
    kind: str
    name: str
    center: Triple
    sigma: Triple
    range: float | None
    incidence: float | None
    points: int
    rms: float
    coverage: float
    remark: str = ""


@dataclass(frozen=True, kw_only=True)
class Rejection(Result):
    """What looked like a target and was none, with the reason."""

    scan: str
    kind: str
    center: Triple
    reason: str


@dataclass(frozen=True, kw_only=True)
class LeftOutBeams(Result):
    """Points that a scan's file has for beams without return; the shell's mean range [m]."""

    scan: str
    points: int
    zeros: int
    repeated: int
    in_shell: int
    shell: float | None
    share: float


@dataclass(frozen=True, kw_only=True)
class WrittenCloud(Result):
    """A cloud that was written; without sigmas all figures but the step are None."""

    name: str
    file: str
    points: int
    sigma: Triple | None  #: root mean square along the axes of its frame [m]
    #: of the three-dimensional sigma [m]
    median: float | None
    p95: float | None
    largest: float | None
    #: sigma [m], azimuth and elevation [rad] of the direction in which the cloud as a whole is
    #: known least; None for merged clouds
    weakest: Triple | None
    step: float | None  #: of stored coordinates [m]; None for copies of a source
    shares: dict[str, float]  #: share of the points within each tolerance class


@dataclass(frozen=True, kw_only=True)
class ScansPart(Result):
    """Targets found and rejected, clouds, precision, comparison with the truth."""

    no_return: list[LeftOutBeams]
    targets: list[FoundTarget]
    rejected: list[Rejection]
    clouds: list[WrittenCloud]
    placement: list[str]
    precision_budget: list[str]
    truth: list[TruthRow]
    error_budget: list[BudgetRow]


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where scans were placed."""
    if job.placed is None:
        return
    placed, columns = job.placed, head.columns
    targets = [
        _target(f.scan, number, d, _name(placed.named, f.station, d))
        for f in placed.findings
        for number, d in enumerate(f.detections, start=1)
    ]
    rejections = [
        Rejection(scan=f.scan, kind=r.kind, center=_triple(r.center), reason=r.reason)
        for f in placed.findings
        for r in f.rejected
    ]
    beams = [_beams(scan) for scan in placed.scans if scan.scan.no_return is not None]
    clouds = [_cloud(product, placed.placements, placed.frame) for product in placed.products]
    said = () if placed.named is None else placed.named.identification.sentences
    placement = tuple(map(stopped, said))
    precision = _precision(placed.products, placed.frame)
    if clouds:
        yield Chapter(
            "clouds",
            "Clouds and their sigma",
            tuple(precision),
            tuple(_maps(placed.products, placed.frame)),
            (_cloud_table(clouds, columns), _class_table(clouds, columns)),
            signed=True,
        )
    yield Chapter(
        "scans",
        "Targets in the scans",
        placement,
        tuple(_panoramas(placed, head)),
        (
            _target_table(targets, columns),
            _rejection_table(rejections, columns),
            _beam_table(beams, columns),
        ),
        ScansPart(
            no_return=beams,
            targets=targets,
            rejected=rejections,
            clouds=clouds,
            placement=list(placement),
            precision_budget=precision,
            truth=list(placed.truth),
            error_budget=list(placed.budget),
        ),
        _warnings(placed),
    )
    if placed.budget:
        yield Chapter(
            "error-budgets",
            "Error budget",
            (),
            tuple(budget_charts(placed.budget, columns)),
            (budget_table(placed.budget, columns),),
        )
    if placed.truth:
        bad = sum(not row.agrees for row in placed.truth)
        verdict = (
            f"All {len(placed.truth)} comparisons with the truth are as stated."
            if not bad
            else f"{bad} of {len(placed.truth)} comparisons with the truth "
            f"{'is' if bad == 1 else 'are'} not as stated: "
            f"{some_of([f'{r.what} {r.name}' for r in placed.truth if not r.agrees], _NAMED)}."
        )
        yield Chapter(
            "against-truth",
            "Agreement with the truth",
            (verdict,),
            tables=(_truth_table(placed.truth, columns),),
        )


def _warnings(placed: PlacedScans) -> tuple[ReportWarning, ...]:
    """What looks wrong in scans, what corrected them, what clouds do not carry, weak reaches."""
    odd = [f"{s.scan.source}: " + text for s in placed.scans for text in s.scan.warnings]
    unseen = [text for finding in placed.findings for text in finding.sentences]
    lacking = [text for product in placed.products for text in product.sentences]
    loose = ["Nothing ties the stations to the frame of the truth: they are not compared with it"]
    return (
        *warned(Severity.INPUT, [*odd, *unseen], "scans"),
        *warned(Severity.NOTE, [*placed.corrected, *lacking], "clouds"),
        *warned(Severity.WEAK, placed.reach, "reach"),
        *warned(Severity.NOTE, loose if placed.loose else [], "not_tied"),
    )


def _beams(scan: StationScan) -> LeftOutBeams:
    """Sentence on points of a scan that are left out."""
    found = scan.scan.no_return
    assert found is not None
    return LeftOutBeams(
        scan=scan.name,
        points=found.points,
        zeros=found.zeros,
        repeated=found.repeated,
        in_shell=found.in_shell,
        shell=None if found.shell is None else sum(found.shell) / 2,
        share=found.points / max(found.total, 1),
    )


def _name(named: Named | None, station: str, detection: Detection) -> str:
    """The name that a detection got; "" if it takes no part."""
    if named is None:
        return ""
    for name, other in zip(
        named.identification.names.get(station, ()), named.targets.get(station, ()), strict=False
    ):
        if other.scan == detection.scan and np.array_equal(other.center, detection.center):
            return name
    return ""


def _target(scan: str, number: int, d: Detection, name: str) -> FoundTarget:
    return FoundTarget(
        scan=scan,
        number=number,
        kind=d.kind,
        name=name,
        center=_triple(d.center),
        sigma=_triple(d.sigmas),
        range=_known(d.range),
        incidence=_known(d.incidence),
        points=d.points,
        rms=d.rms,
        coverage=d.coverage,
        remark=joined("; ", d.sentences),
    )


def _known(value: float) -> float | None:
    """None for what is not known without the place of the scanner."""
    return float(value) if np.isfinite(value) else None


def _triple(x: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]]) -> Triple:
    return float(x[0]), float(x[1]), float(x[2])


def _cloud(
    product: Product, placements: Mapping[str, Placement], frame: OutputFrame
) -> WrittenCloud:
    """One line of the table of clouds."""
    summary, known = product.summary, len(product.summary.sample) > 0
    weakest = None
    if known and len(product.scans) == 1:
        direction = _weakest(summary, placements[product.scans[0]], frame)
        weakest = direction.sigma, direction.azimuth, direction.elevation
    return WrittenCloud(
        name=", ".join(product.scans[:4]) + ("" if len(product.scans) < 5 else ", ..."),
        file=product.path.name,
        points=summary.points,
        sigma=_triple(summary.rms) if known else None,
        median=summary.quantile(0.5) if known else None,
        p95=summary.quantile(0.95) if known else None,
        largest=summary.largest if known else None,
        weakest=weakest,
        step=product.step,
        shares=summary.shares,
    )


def _weakest(summary: CloudSummary, where: Placement, frame: OutputFrame) -> Weakest:
    """Of a single scan, along the axes of the work frame."""
    at = where.pose.translation
    turn = frame.rotation(at)
    around = (summary.sample[:, :3] - frame.from_work(at[None])[0]) @ turn
    return weakest_direction(around, where.covariance)


def _panoramas(placed: PlacedScans, head: Head) -> list[Picture]:
    """The scans as their scanners saw them, with names of targets and azimuths."""
    headings = {station.name: station.heading for station in head.stations}
    return [
        Picture(
            f"panorama-{anchor(f.scan)}",
            f"Scan {spoken(f.scan)}",
            panorama_drawing(
                f.panorama,
                [_name(placed.named, f.station, d) for d in f.detections],
                headings.get(f.station),
                head.settings.angle,
            ),
            Sentence(
                "{f.points:,} points; {detections} found, {rejected} rejected.",
                f=f,
                detections=counted(len(f.detections), "target"),
                rejected=counted(len(f.rejected), "candidate"),
            ),
            wide=True,
        )
        for f in placed.findings
        if f.panorama is not None
    ]


#: points of the plan of sigmas
_MOST_DRAWN = 60_000
#: classes of the counts that make a histogram; of fewer the sample is counted anew
_FEW_CLASSES = 6


def _told_apart(counts: Array) -> bool:
    """Do the counts have classes enough for a histogram?"""
    return bool(np.count_nonzero(counts) >= _FEW_CLASSES)


def _histogram(counts: Array, sigma: Array) -> Chart:
    """How often sigmas are how large.

    counts : by classes that grow as the sigmas do; sigma : (n,) [mm] of the sample, which takes
    their place where all sigmas are almost alike.
    """
    used = np.flatnonzero(counts)
    if _told_apart(counts):
        edges, numbers, log = (
            1e3 * EDGES[used[0] : used[-1] + 2],
            counts[used[0] : used[-1] + 1],
            "x",
        )
        ends = edges[0] / 1.1, edges[-1] * 1.1
    else:
        numbers, edges = np.histogram(sigma, 20)
        log, margin = "", 0.05 * float(edges[-1] - edges[0])
        ends = edges[0] - margin, edges[-1] + margin
    highest = 1.05 * max(float(numbers.max(initial=0)), 1.0)
    labels = ("3D sigma [mm]", "points" if log else "points of the sample")
    bars = Chart(ends, (0.0, highest), labels, (540.0, 340.0), log="x" if log else "")
    for left, right, number in zip(edges, edges[1:], numbers.tolist(), strict=False):
        words = Sentence(
            "{left:mm2~} to {right:mm2}: {number:,} points",
            left=left * MM,
            right=right * MM,
            number=number,
        )
        bars.bar(float(left), float(right), 0.0, float(number), "s0", words)
    return bars


def _maps(products: Sequence[Product], frame: OutputFrame) -> list[Picture]:
    """Plan and histogram of the sigma of points over all clouds."""
    sample = np.concatenate([np.zeros((0, 4)), *(p.summary.sample for p in products)])
    if len(sample) == 0:
        return []
    sample = sample[:: -(-len(sample) // _MOST_DRAWN)]
    corner = np.floor(sample[:, :2].min(axis=0) / 10) * 10
    xy, sigma = sample[:, :2] - corner, 1e3 * sample[:, 3]
    # what stands at the edge, as facades do, is seen whole
    margin = 0.02 * float(np.ptp(xy, axis=0).max())
    low, high = xy.min(axis=0) - margin, xy.max(axis=0) + margin
    top = float(np.quantile(sigma, 0.98))
    labels = [
        f"{axis.upper()} {'-' if c >= 0 else '+'} {abs(c):.0f} [m]"
        for axis, c in zip(frame.axes[:2], corner, strict=True)
    ]
    plan = Chart(
        (low[0], high[0]), (low[1], high[1]), (labels[0], labels[1]), (620.0, 420.0), equal=True
    )
    bottom = float(sigma.min())
    plan.cloud(xy[:, 0], xy[:, 1], (sigma - bottom) / max(top - bottom, 1e-9))
    counts = np.sum([p.summary.counts for p in products], axis=0)[1:-1]
    bars = _histogram(counts, sigma)
    counted_are = "all of them" if _told_apart(counts) else "the sample"
    total = sum(p.summary.points for p in products)
    caption = Sentence(
        "Predicted uncertainty of {total:,} points: a sample of {sample:,} in plan, "
        "colours up to the 98 % quantile; {counted_are} in the histogram.",
        total=total,
        sample=len(sample),
        counted_are=counted_are,
    )
    scale = colour_bar(bottom, top, "3D sigma [mm]", 620.0)
    drawing = beside([[plan, bars]], "Uncertainty of points", scale)
    return [Picture("point-sigma", "Uncertainty of points", drawing, caption, wide=True)]


def _precision(products: Sequence[Product], frame: OutputFrame) -> list[str]:
    """What storage, projection and curvature do to coordinates, in numbers."""
    if not products:
        return []
    low = np.min([p.summary.low for p in products], axis=0)
    high = np.max([p.summary.high for p in products], axis=0)
    if not np.isfinite(low).all():
        return []
    coarsest = max((p.step for p in products if p.step is not None), default=None)
    single = float(np.spacing(np.float32(max(np.abs(low).max(), np.abs(high).max()))))
    stored = "coordinates are those of the sources to the last bit"
    if coarsest is not None:
        stored = Sentence(
            "coordinates are stored in steps of {coarsest:mmg} or finer (rounding {rounding:mmg2})",
            coarsest=coarsest,
            rounding=coarsest / np.sqrt(12),
        )
    spec = "mm0" if single > 0.01 else "mmg2"
    sentences: list[str] = [
        Sentence(
            "Precision budget: {stored}; a program that reads them as 32-bit floats "
            f"without a shift would round them to {{left:{spec}}}.",
            stored=stored,
            left=single,
        )
    ]
    extent = float(np.linalg.norm((high - low)[:2]))
    rigid = any(p.path.suffix == ".e57" for p in products)
    if frame.kind == "projected" and frame.crs is not None:
        middle = (low + high) / 2
        scale = grid_scale(frame.crs, middle)
        sentences.append(
            Sentence(
                "In {frame.crs} lengths differ from those on the ground by {scale:ppm+1}, "
                "{change:mm+1} over the {extent:m0} of the clouds",
                frame=frame,
                scale=scale,
                change=scale * extent,
                extent=extent,
            )
            + ("." if rigid else _CONVERTED)
        )
    elif frame.kind == "work":
        sag = (extent / 2) ** 2 / (2 * _EARTH)
        sentences.append(
            Sentence(
                "Heights are along the vertical of the work frame; the Earth falls away by "
                "{sag:mmg2} at the edge of the clouds.",
                sag=sag,
            )
        )
    return sentences


def _truth_table(truth: Sequence[TruthRow], columns: ColumnSet) -> ReportTable:
    note = (
        "The job is simulated and its truth is known. Squared errors in the metric of their stated "
        "covariances against chi-square: single ones at a level at which all of one kind pass in "
        "99 % of jobs, all jointly on both sides at 99 %, since smaller errors than stated are "
        "wrong statements too. Clouds show the mean squared normalised error."
    )
    specs: list[Spec] = [
        columns.word("What", "what"),
        columns.scan("Name", "name"),
        columns.word("Error", "words"),
        columns.plain("test", "statistic"),
        columns.plain("least", "least"),
        columns.plain("most", "limit"),
        (
            ColumnHead("verdict", numeric=False),
            lambda r: text_cell(r.verdict, "good" if r.agrees else "bad"),
        ),
    ]
    return build_table("truth", "Against the truth", note, truth, specs)


def _beam_table(beams: Sequence[LeftOutBeams], columns: ColumnSet) -> ReportTable:
    specs: list[Spec] = [
        columns.scan("Scan", "scan"),
        columns.plain("points left out", "points", 0),
        (ColumnHead("of all", "%"), lambda b: number_cell(100 * b.share, f"{100 * b.share:.2f}")),
        columns.plain("at the scanner", "zeros", 0),
        columns.plain("at places that repeat", "repeated", 0),
        columns.plain("on the shell", "in_shell", 0),
        columns.metres("range of the shell", lambda b: b.shell),
    ]
    note = (
        "Points that the files have for beams that came back from nothing, recognised from their "
        "ranges and left out of targets, planes, registration, comparison and clouds."
    )
    return build_table("beams", "Beams without return", note, beams, specs)


def _target_table(targets: Sequence[FoundTarget], columns: ColumnSet) -> ReportTable:
    specs: list[Spec] = [
        columns.scan("Scan", "scan"),
        columns.plain("No.", "number", 0),
        columns.word("Kind", "kind"),
        columns.word("Point", "name"),
        *(columns.metres(a, component("center", k)) for k, a in enumerate("xyz")),
        *(columns.mm(f"σ {a}", component("sigma", k)) for k, a in enumerate("xyz")),
        columns.metres("range", lambda t: t.range),
        columns.bearing("incidence", lambda t: t.incidence),
        columns.plain("points", "points", 0),
        columns.mm("rms of the fit", lambda t: t.rms),
        columns.plain("coverage", "coverage", wide=True),
        columns.word("Remark", "remark", wide=True),
    ]
    note = (
        "Centres in the scanner frame with the sigmas that enter the adjustment. The rms is the "
        "root mean square of the residuals of the surface points about the fitted shape, without "
        "those that the fit left out as beyond three robust standard deviations (discs: five times "
        "the rms of their plane): a noise of points, not an accuracy of the centre. The "
        "pictures show names, and numbers where there are none."
    )
    return build_table("targets", "Targets found", note, targets, specs)


def _rejection_table(rejections: Sequence[Rejection], columns: ColumnSet) -> ReportTable:
    specs: list[Spec] = [
        columns.scan("Scan", "scan"),
        columns.word("Kind", "kind"),
        *(columns.metres(a, component("center", k)) for k, a in enumerate("xyz")),
        columns.word("Why it is none", "reason"),
    ]
    return build_table("rejections", "Candidates rejected", "", rejections, specs)


def _cloud_table(clouds: Sequence[WrittenCloud], columns: ColumnSet) -> ReportTable:
    specs: list[Spec] = [
        columns.scan("Cloud", "name"),
        columns.word("File", "file"),
        columns.plain("points", "points", 0),
        *(columns.mm(f"σ{k + 1}", component("sigma", k), 2) for k in range(3)),
        columns.mm("median 3D σ", lambda c: c.median),
        columns.mm("95 % of points", lambda c: c.p95),
        columns.mm("largest", lambda c: c.largest),
        columns.mm("weakest σ", component("weakest", 0)),
        columns.bearing("along azimuth", component("weakest", 1)),
        columns.bearing("elevation", component("weakest", 2)),
        columns.mm("step on disk", lambda c: c.step, 3),
    ]
    note = (
        "σ1 to σ3: root mean square along the axes of the delivered frame. 3D σ is the root of the "
        "sum of the three variances of a point. Weakest: sigma of the cloud as a whole along its "
        "worst direction. All are predicted from network and instrument, not observed."
    )
    return build_table("clouds", "Clouds", note, clouds, specs)


def _class_table(clouds: Sequence[WrittenCloud], columns: ColumnSet) -> ReportTable:
    names = list(clouds[0].shares) if clouds else []
    specs: list[Spec] = [columns.scan("Cloud", "name")]
    specs += [(ColumnHead(name, "%"), _share(name)) for name in names]
    note = (
        "Share of the points whose predicted 95 % uncertainty (twice the 3D σ) is within the "
        "class: USIBD LOA 10 to 50 are 150, 50, 15, 5 and 1 mm, GSA levels 1 to 4 are 51, 13, 6 "
        "and 3 mm. A class is reached by 95 % or more."
    )
    rows = [cloud for cloud in clouds if cloud.sigma is not None]
    return build_table("classes", "Tolerance classes", note, rows, specs)


def _share(name: str) -> Callable[[WrittenCloud], Cell]:
    def cell(cloud: WrittenCloud) -> Cell:
        share = 100 * cloud.shares[name]
        return number_cell(share, f"{share:.1f}", "good" if share >= 95 else "")

    return cell


SUBJECT = Subject("scans", _chapters, ScansPart)
