"""What the report says of the scans of a run: detections, pictures, clouds, precision budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tribrach.cloud.budget import Weakest, weakest_direction
from tribrach.cloud.placement import Placement
from tribrach.cloud.summary import EDGES, CloudSummary
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import grid_scale
from tribrach.job.clouds import Product
from tribrach.job.find_targets import Findings
from tribrach.job.name_targets import Named
from tribrach.report.figures import new_figure
from tribrach.report.page import picture
from tribrach.report.scan_content import FoundTarget, Picture, Rejection, ScanChapter, WrittenCloud
from tribrach.targets.detection import Detection

__all__ = ["scan_chapter"]

_CONVERTED = "; every point was converted by itself, so that nothing of it is lost."


#: radius of the Earth for the size of its curvature [m]
_EARTH = 6371000.0


def scan_chapter(
    findings: Sequence[Findings],
    named: Named | None,
    products: Sequence[Product],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
) -> ScanChapter:
    """Everything about scans; placements by scan name."""
    return ScanChapter(
        targets=tuple(
            _target(f.scan, number, d, _name(named, f.station, d))
            for f in findings
            for number, d in enumerate(f.detections, start=1)
        ),
        rejections=tuple(
            Rejection(f.scan, r.kind, _triple(r.center), r.reason)
            for f in findings
            for r in f.rejected
        ),
        pictures=(*_panoramas(findings), *_maps(products, frame)),
        clouds=tuple(_cloud(product, placements, frame) for product in products),
        placement=() if named is None else named.identification.sentences,
        budget=tuple(_budget(products, frame)),
        warnings=tuple(
            f"{sentence}."
            for made in (findings, products)
            for one in made
            for sentence in one.sentences
        ),
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
        remark="; ".join(d.sentences),
    )


def _known(value: float) -> float | None:
    """None for what is not known without the place of the scanner."""
    return float(value) if np.isfinite(value) else None


def _triple(
    x: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]],
) -> tuple[float, float, float]:
    return float(x[0]), float(x[1]), float(x[2])


def _cloud(
    product: Product, placements: Mapping[str, Placement], frame: OutputFrame
) -> WrittenCloud:
    """One line of the table of clouds."""
    summary, known = product.summary, len(product.summary.sample) > 0
    weakest = None
    if known and len(product.scans) == 1:
        found = _weakest(summary, placements[product.scans[0]], frame)
        weakest = found.sigma, found.azimuth, found.elevation
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
        shares=tuple(summary.shares.items()),
    )


def _weakest(summary: CloudSummary, where: Placement, frame: OutputFrame) -> Weakest:
    """Of a single scan, along the axes of the work frame."""
    at = where.pose.translation
    turn = frame.rotation(at)
    around = (summary.sample[:, :3] - frame.from_work(at[None])[0]) @ turn
    return weakest_direction(around, where.covariance)


def _panoramas(findings: Sequence[Findings]) -> list[Picture]:
    return [
        Picture(
            f"panorama-{f.scan}",
            f"Scan {f.scan}",
            f.picture,
            f"{f.points:,} points; {len(f.detections)} targets found, "
            f"{len(f.rejected)} candidates rejected.",
        )
        for f in findings
        if f.picture
    ]


def _maps(products: Sequence[Product], frame: OutputFrame) -> list[Picture]:
    """Plan and histogram of the sigma of points over all clouds."""
    sample = np.concatenate([np.zeros((0, 4)), *(p.summary.sample for p in products)])
    if len(sample) == 0:
        return []
    figure = new_figure(figsize=(9, 4.2), dpi=100, layout="constrained")
    plan, bars = figure.subplots(1, 2)
    order = np.argsort(sample[:, 3])
    shown = plan.scatter(
        *(sample[order, :2] - np.round(sample[:, :2].mean(0), -1)).T,
        c=1e3 * sample[order, 3],
        s=2,
        cmap="viridis",
        vmax=1e3 * np.quantile(sample[:, 3], 0.98),
    )
    east, north = np.round(sample[:, :2].mean(0), -1)
    plan.set(aspect="equal", xlabel=f"{frame.axes[0]} - {east:.0f} m")
    plan.set_ylabel(f"{frame.axes[1]} - {north:.0f} m")
    figure.colorbar(shown, ax=plan, label="3D sigma [mm]")
    counts = np.sum([p.summary.counts for p in products], axis=0)[1:-1]
    bars.bar(1e3 * EDGES[:-1], counts, 1e3 * np.diff(EDGES), align="edge", color="#4878a8")
    used = np.flatnonzero(counts)
    bars.set_xscale("log")
    if len(used):
        bars.set_xlim(1e3 * EDGES[used[0]] / 1.3, 1e3 * EDGES[used[-1] + 1] * 1.3)
    bars.set(xlabel="3D sigma [mm]", ylabel="points")
    total = sum(p.summary.points for p in products)
    caption = (
        f"Predicted uncertainty of {total:,} points: a sample of {len(sample):,} in plan, all of "
        "them in the histogram."
    )
    return [picture("point-sigma", "Uncertainty of points", figure, caption)]


def _budget(products: Sequence[Product], frame: OutputFrame) -> list[str]:
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
        stored = (
            f"coordinates are stored in steps of {1e3 * coarsest:g} mm or finer "
            f"(rounding {1e3 * coarsest / np.sqrt(12):.2g} mm)"
        )
    left = f"{1e3 * single:.0f}" if single > 0.01 else f"{1e3 * single:.2g}"
    said = [
        f"Precision budget: {stored}; a program that reads them as 32-bit "
        f"floats without a shift would leave {left} mm."
    ]
    extent = float(np.linalg.norm((high - low)[:2]))
    rigid = any(p.path.suffix == ".e57" for p in products)
    if frame.kind == "projected" and frame.crs is not None:
        middle = (low + high) / 2
        scale = grid_scale(frame.crs, middle)
        said.append(
            f"In {frame.crs} lengths differ from those on the ground by {1e6 * scale:+.1f} ppm, "
            f"{1e3 * scale * extent:+.1f} mm over the {extent:.0f} m of the clouds"
            + ("." if rigid else _CONVERTED)
        )
    elif frame.kind == "work":
        sag = (extent / 2) ** 2 / (2 * _EARTH)
        said.append(
            f"Heights are along the vertical of the work frame; the Earth falls away by "
            f"{1e3 * sag:.2g} mm at the edge of the clouds."
        )
    return said
