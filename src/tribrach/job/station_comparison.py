"""Two stations of a run against each other, site by site, through the adjusted poses.

A comparison is remembered and made again only where scans, poses or what the project asks for have
changed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array, Progress
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import SharedPart
from tribrach.comparison.compared import CloudComparison
from tribrach.comparison.predicted import OffsetTest
from tribrach.comparison.regression import Regression, regress
from tribrach.comparison.results import SiteResult
from tribrach.comparison.sites import ComparisonSite, choose_sites
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.io.site_table import read_sites
from tribrach.job.cloud_file import CloudFile
from tribrach.job.compare import Method, compare_clouds, offset_test
from tribrach.job.each import Item, each
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered
from tribrach.scan.normals import normals
from tribrach.scan.scan import Scan
from tribrach.units import MM

if TYPE_CHECKING:
    from collections.abc import Callable

    from tribrach.project import Project
    from tribrach.project.sections import ComparisonSection

#: points of a cloud among which flat sites are looked for, at most
_SAMPLE = 200_000


@dataclass(frozen=True)
class RequestedComparison:
    """A comparison that the project asks for; sites None where they are to be chosen."""

    section: ComparisonSection
    a: tuple[StationScan, ...]
    b: tuple[StationScan, ...]
    sites: tuple[ComparisonSite, ...] | None

    def of(self, scans: Mapping[str, StationScan]) -> RequestedComparison:
        """The same with the scans of these names, corrected for instance."""
        a, b = (tuple(scans[scan.name] for scan in side) for side in (self.a, self.b))
        return replace(self, a=a, b=b)


def requested_comparisons(
    project: Project, scans: Sequence[StationScan]
) -> list[RequestedComparison]:
    """The comparisons of a project with their scans and sites, before anything is computed."""
    comparisons = []
    for k, section in enumerate(project.comparison):
        a, b = (
            _named(project, scans, k, key, name)
            for key, name in (("a", section.a), ("b", section.b))
        )
        if a[0].station == b[0].station:
            raise project.error(
                ("comparison", k),
                f"{section.a} and {section.b} are scans of one station, {a[0].station}",
                "name scans of two stations",
            )
        sites = None
        if section.sites is not None:
            sites = tuple(read_sites(project.folder / section.sites))
        comparisons.append(RequestedComparison(section, a, b, sites))
    return comparisons


def _named(
    project: Project, scans: Sequence[StationScan], k: int, key: str, name: str
) -> tuple[StationScan, ...]:
    """The scan of a name, else all scans of the station of that name."""
    chosen = tuple(scan for scan in scans if scan.name == name)
    chosen = chosen or tuple(scan for scan in scans if scan.station == name)
    if not chosen:
        known = ", ".join(dict.fromkeys(scan.name for scan in scans))
        raise project.error(
            ("comparison", k, key), f"there is no scan or station {name}", f"the scans are {known}"
        )
    return chosen


#: columns of the regression with their units
REGRESSION_UNITS = {"range": "m", "incidence": "deg", "mean": "mm", "std": "mm"}


@dataclass(frozen=True)
class StationComparison(CloudComparison, without=("values", "remarks")):
    """A comparison between stations of a job."""

    regression: Regression | None = None  #: of nearest-neighbour distances on range and incidence
    #: columns (n,) of the regression by name, in the units of :data:`REGRESSION_UNITS`
    values: Mapping[str, Array] = field(default_factory=dict, repr=False)
    remarks: tuple[str, ...] = ()  #: how sites were chosen, and why there is no regression

    @classmethod
    def of(
        cls,
        a: str,
        b: str,
        limit: float,
        sites: Sequence[SiteResult],
        offsets: OffsetTest | None = None,
        remarks: Sequence[str] = (),
    ) -> StationComparison:
        """A comparison with the regression where the sites carry one."""
        values = _regression_values(sites)
        regression, words = None, list(remarks)
        if len(values["range"]) > 1:
            try:
                causes, quantities = ["range", "incidence"], ["mean", "std"]
                regression = regress(values, causes, quantities, REGRESSION_UNITS)
            except InputError as error:
                words.append(f"No regression on range and incidence: {error.what}.")
        return cls(a, b, limit, tuple(sites), offsets, regression, values, tuple(words))


def _regression_values(sites: Sequence[SiteResult]) -> dict[str, Array]:
    """Columns over the sites that have all of them."""
    rows = [
        (s.range, np.degrees(s.incidence), 1e3 * s.c2c.mean, 1e3 * s.c2c.std)
        for s in sites
        if s.range is not None
        and s.incidence is not None
        and s.c2c is not None
        and s.c2c.mean is not None
        and s.c2c.std is not None
    ]
    columns = np.array(rows, dtype=float).reshape(-1, 4).T
    return dict(zip(REGRESSION_UNITS, columns, strict=True))


def compare_stations(
    requests: Sequence[RequestedComparison],
    shared: SharedPart,
    delivered: SharedPart,
    frame: OutputFrame,
    state: Remembered,
    progress: Callable[[str, int, int | None], None],
) -> list[StationComparison]:
    """Every comparison that is asked for; those of unchanged clouds come from the last run.

    shared, delivered : where the scans stand and what their points share, in the work frame and in
    that of the clouds, which is ``frame``.
    """
    items = []
    for number, request in enumerate(requests, start=1):
        a, b = request.section.a, request.section.b
        task = _Task(
            _placed(request.a, shared),
            _placed(request.b, shared),
            frame,
            StationPair.of(delivered, request.b[0].name, request.a[0].name),
            request.sites,
            request.section.method,
            request.section.limit_mm * MM,
        )
        items.append(
            Item(
                f"comparison-{number}-{a}-{b}",
                f"{a} against {b}",
                (task, a, b),
                source=request.a[0].scan.path,
                cost=sum(scan.scan.records or 0 for scan in (*request.a, *request.b)),
            )
        )
    return each(_compared, items, state=state, progress=progress)


@dataclass(frozen=True)
class _PlacedScans:
    """The scans of one station, and where it stands."""

    scans: tuple[MeasuredScan, ...]
    placement: Placement


@dataclass(frozen=True)
class _Task:
    """All that a comparison depends on."""

    #: scans of two stations; b is the reference
    a: _PlacedScans
    b: _PlacedScans
    frame: OutputFrame  #: the frame of the clouds, in which they are compared
    pair: StationPair  #: both stations with their joint covariance, that of the reference first
    sites: tuple[ComparisonSite, ...] | None  #: where to compare, None if sites are to be chosen
    #: how, and the longest distance [m]
    method: Method
    limit: float


def _placed(scans: Sequence[StationScan], shared: SharedPart) -> _PlacedScans:
    """Scans of one station at its adjusted place."""
    return _PlacedScans(tuple(scan.measured for scan in scans), shared.scans[scans[0].name])


def _compared(task: _Task, a: str, b: str, *, progress: Progress) -> StationComparison:
    """One comparison; a, b : names of the stations."""
    clouds = _cloud(task.a, task.frame), _cloud(task.b, task.frame)
    remarks: list[str] = []
    sites = task.sites
    if sites is None:
        sites, remarks = _chosen(clouds)
    results = compare_clouds(
        *clouds,
        sites,
        method=task.method,
        limit=task.limit,
        stations=task.pair,
        progress=partial(_tell, progress, f"{a} against {b}"),
    )
    offsets = offset_test(results, task.pair)
    return StationComparison.of(a, b, task.limit, results, offsets, remarks)


def _tell(
    progress: Callable[[str, int, int | None], None],
    which: str,
    what: str,
    done: int,
    total: int | None,
) -> None:
    """Progress with the stations before what is done."""
    progress(f"{which}: {what}", done, total)


def _cloud(side: _PlacedScans, frame: OutputFrame) -> CloudFile:
    """Scans of one station as they are delivered, point by point in the frame of the clouds."""
    where = side.placement
    placed = tuple(_as_measured(scan.scan, where) for scan in side.scans)
    there = where.delivered(frame)
    return CloudFile(
        side.scans[0].scan.path,
        placed,
        there.pose.translation,
        None if there.noise is None else there,
        frame=frame,
    )


def _as_measured(scan: Scan, where: Placement) -> Scan:
    """A scan at its place, with intensities as it has them, which the law of its noise is of.

    A file that was written by this program may say from what its own were stretched; nothing here
    is in those units.
    """
    facts = {name: said for name, said in scan.facts.items() if name != "intensity"}
    return replace(scan, pose=where.pose, facts=facts)


def _chosen(clouds: Sequence[CloudFile]) -> tuple[tuple[ComparisonSite, ...], list[str]]:
    """Sites on surfaces that both stations saw; without any the whole clouds are compared."""
    scanners = [cloud.scanner for cloud in clouds if cloud.scanner is not None]
    sites = choose_sites([_sample(cloud) for cloud in clouds], scanners)
    if not sites:
        return (), ["No flat surface is in both clouds: they are compared as a whole."]
    return tuple(sites), [
        f"The {len(sites)} sites were chosen on flat surfaces that both stations saw."
    ]


def _sample(cloud: CloudFile) -> tuple[Array, Array]:
    """Points (n, 3) spread evenly over the records of a cloud, and normals (n, 3) among them."""
    kept, step, seen = [np.zeros((0, 3))], 1, 0
    for chunk in cloud.stream():
        kept.append(chunk[-seen % step :: step])
        seen += len(chunk)
        while sum(map(len, kept)) > _SAMPLE:
            kept, step = [np.concatenate(kept)[::2]], 2 * step
    points = np.concatenate(kept)
    return points, normals(points - points.mean(axis=0) if len(points) else points)
