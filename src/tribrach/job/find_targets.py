"""The targets of every scan, found once and remembered.

Two scans of one station share its frame; what both saw is one detection, the more precise one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tribrach._types import Progress
from tribrach.job.each import Item, each
from tribrach.job.panorama import Panorama, close_up, panorama
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered
from tribrach.job.visits import Wish
from tribrach.project.edits import Edits
from tribrach.project.sections import TargetSection
from tribrach.scan.loading import Loaded, laid_out
from tribrach.scan.no_return import screened
from tribrach.scan.range_image import RangeImage
from tribrach.targets.checkerboards.search import find_checkerboards
from tribrach.targets.detection import Detection, Rejected, with_floor
from tribrach.targets.discs.search import find_discs
from tribrach.targets.picks import NaturalPoint, find_pick
from tribrach.targets.sampling import Sampling
from tribrach.targets.spheres.cloud_search import find_spheres_in_cloud
from tribrach.targets.spheres.grid_search import find_spheres
from tribrach.units import MM

#: two detections of a station this near to each other are one target, however small it is [m]
_SAME = 0.02
#: decisions that nobody made
NOTHING = Edits()
#: rejected candidates of a scan that are shown
_SHOWN = 50


@dataclass(frozen=True)
class Findings:
    """Targets and rejected candidates of one scan.

    detections, rejected : targets and what only looked like one; points : valid points of the scan;
    panorama : intensity over directions with the places of the targets, None without one;
    sentences : what could not be looked for, and why; sampling : angular steps and ranges, None
    where the scanner is unknown; pictures : the scan around targets, numbered from 1, and around
    rejected candidates, from -1 downwards, as small WebP files.
    """

    scan: str
    station: str
    detections: tuple[Detection, ...]
    rejected: tuple[Rejected, ...]
    points: int
    panorama: Panorama | None = None
    sentences: tuple[str, ...] = ()
    sampling: Sampling | None = None
    pictures: Mapping[int, bytes] = field(default_factory=dict)

    def moved(self, by: Sequence[float]) -> Findings:
        """The same with all centres moved by (3,) [m]."""
        shift = np.array(by)
        return replace(
            self,
            detections=tuple(replace(d, center=d.center + shift) for d in self.detections),
            rejected=tuple(replace(r, center=r.center + shift) for r in self.rejected),
        )


def extract(
    scans: Sequence[StationScan],
    wanted: TargetSection,
    state: Remembered,
    progress: Progress,
    edits: Edits = NOTHING,
) -> list[Findings]:
    """Targets and picks of every scan; those of unchanged scans come from the last run."""
    items = [target_wish(scan, wanted, edits).item for scan in scans]
    return each(_found, items, state=state, progress=progress)


def target_wish(scan: StationScan, wanted: TargetSection, edits: Edits = NOTHING) -> Wish:
    """The targets and picks of a scan as a product."""
    picks = tuple(pick.pick for pick in edits.pick if pick.scan == scan.name)
    item = Item(
        f"targets-{scan.name}",
        f"targets of {scan.name}",
        (scan.measured, wanted, picks) if picks else (scan.measured, wanted),
        scan.scan.path,
        scan.scan.records or 0,
    )
    return Wish(_found, item)


def _found(
    scan: MeasuredScan,
    wanted: TargetSection,
    picks: tuple[NaturalPoint, ...] = (),
    *,
    progress: Progress,
) -> Findings:
    """Findings in a scan, without progress messages."""
    return find_targets(scan, wanted, picks)


def found_alone(
    scan: StationScan, wanted: TargetSection, *, progress: Progress
) -> tuple[StationScan, Findings]:
    """Find the targets of a scan that belongs to no project."""
    seen = replace(scan, scan=screened(scan.scan))
    return seen, find_targets(seen, wanted)


def find_targets(
    scan: MeasuredScan, wanted: TargetSection, picks: Sequence[NaturalPoint] = ()
) -> Findings:
    """Load a scan and look for every kind of target that is wanted, and possible; fit its picks.

    Prints are measured along lines of sight: without the place of the scanner only spheres can be
    found.
    """
    unseen = blind(scan, wanted)
    cloud, image = laid_out(scan.scan)
    noise, floor = scan.fit_sigmas, wanted.print_floor_mm * MM
    stated = (wanted.floor_mm or 0.0) * MM
    results: list[tuple[Sequence[Detection], Sequence[Rejected]]] = []
    if wanted.sphere_radius_m and not scan.origin_known:
        good, bad = find_spheres_in_cloud(cloud.xyz, wanted.sphere_radius_m, scan=scan.name)
        raised = [replace(d, covariance=with_floor(d.covariance, stated)) for d in good]
        results.append((raised, bad))
    elif wanted.sphere_radius_m:
        tolerance = wanted.sphere_tolerance_mm * MM
        known: dict[str, Any] = {"floor": stated, "tolerance": tolerance, "scan": scan.name}
        if scan.noise is not None:
            known["footprint"] = scan.noise.beam
            known["sigma_range"] = noise.get("sigma_range")
            known["sigma_angle"] = scan.noise.vertical
            known["shared"] = scan.noise.estimated_shared
        results.append(find_spheres(cloud.xyz, image, wanted.sphere_radius_m, **known))
    if cloud.intensity is not None and not unseen:
        seen = cloud.xyz, cloud.intensity, image
        more: dict[str, Any] = {"floor": floor, "scan": scan.name, **noise}
        if scan.noise is not None:
            more["footprint"] = scan.noise.beam
            # light is the mean over the footprint, so only the encoders move it
            more["sigma_angle"] = scan.noise.vertical
            more["shared"] = scan.noise.estimated_shared
        if wanted.checkerboard_side_m:
            # boards tell the noise of their ranges themselves
            own = {name: value for name, value in more.items() if name != "sigma_range"}
            results.append(find_checkerboards(*seen, wanted.checkerboard_side_m, **own))
        if wanted.disc_radius_m:
            results.append(find_discs(*seen, wanted.disc_radius_m, **more))
    shared = None if scan.noise is None else scan.noise.estimated_shared
    for pick in picks:
        one = find_pick(cloud.xyz, pick, shared=shared, floor=stated, scan=scan.name)
        results.append(([one], []) if isinstance(one, Detection) else ([], [one]))
    detections = tuple(d for good, _ in results for d in good)
    rejected = tuple(r for _, bad in results for r in bad)
    view = panorama(image, cloud.intensity, detections)
    sentences = (unseen,) if unseen else ()
    return Findings(
        scan.name,
        scan.station,
        detections,
        rejected,
        len(cloud.xyz),
        view,
        sentences,
        Sampling.of(image) if scan.origin_known else None,
        _pictures(cloud, image, detections, rejected),
    )


def _pictures(
    cloud: Loaded,
    image: RangeImage,
    detections: Sequence[Detection],
    rejected: Sequence[Rejected],
) -> dict[int, bytes]:
    """The scan around each target and each candidate that was none."""
    places = {k: (d.center, d.radius) for k, d in enumerate(detections, start=1)}
    # thousands of candidates are noise that nobody looks through
    places |= {-k: (r.center, np.nan) for k, r in enumerate(rejected[:_SHOWN], start=1)}
    views = {k: close_up(image, cloud.intensity, *place) for k, place in places.items()}
    return {k: view for k, view in views.items() if view is not None}


def blind(scan: MeasuredScan, wanted: TargetSection) -> str:
    """Which wanted targets cannot be looked for in a scan, in a sentence without the stop; "" none.

    Checkerboards and discs take the place of the scanner among the points.
    """
    sizes = {"checkerboards": wanted.checkerboard_side_m, "discs": wanted.disc_radius_m}
    kinds = [kind for kind, given in sizes.items() if given]
    if scan.origin_known or not kinds:
        return ""
    return (
        f"{scan.scan.source}: {' and '.join(kinds)} are not looked for, because where the scanner "
        'stood among the points is not known (say origin = "scanner" in its [[scans]] if at '
        "0, 0, 0, or origin = [x, y, z] in the coordinates of the file)"
    )


def merged(findings: Sequence[Findings]) -> dict[str, list[Detection]]:
    """Detections by station, each target once, the most precise of several scans."""
    out: dict[str, list[Detection]] = {}
    for finding in findings:
        out.setdefault(finding.station, [])
        out[finding.station] += finding.detections
    return {station: _without_doubles(detections) for station, detections in out.items()}


def _without_doubles(detections: list[Detection]) -> list[Detection]:
    """The detections without those that would overlap a more precise one.

    A scan much coarser than another puts a centre off by more than any fixed distance; but two
    bodies are not in one place.
    """
    kept: list[Detection] = []
    for detection in sorted(detections, key=lambda d: float(np.trace(d.covariance))):
        if all(
            np.linalg.norm(detection.center - k.center) > max(_SAME, detection.radius, k.radius)
            for k in kept
        ):
            kept.append(detection)
    return kept
