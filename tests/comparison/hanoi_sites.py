"""Sixteen sites of the twin hanoi-facade, scanned from two stations that a survey has placed."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.network.hanoi import survey
from tribrach.cloud.placement import Placement
from tribrach.comparison.results import SiteResult
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.station_pair import StationPair
from tribrach.geometry.pose import Pose
from tribrach.job.compare import compare_clouds
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.simulate.aiming import fine_scan
from tribrach.simulate.twin import Twin, TwinTarget
from tribrach.simulate.twins import hanoi_facade

NAMES = hanoi_facade.COMPARED


def with_step(made: Twin, step: float, sites: tuple[int, ...] = tuple(range(16))) -> Twin:
    """The twin with its site scans at another step [rad], of some of the sites."""
    windows = [
        TwinTarget(str(k), "sphere", np.array([hanoi_facade.EAST, *hanoi_facade.SITES[k]]), 0.8)
        for k in sites
    ]
    scans = [
        fine_scan(name, made.station(name).pose, windows, step, f"{name}-sites") for name in NAMES
    ]
    return replace(made, scans=scans)


@dataclass
class Placed:
    """A simulated scan through the adjusted pose, as a file would give it."""

    path: Path
    xyz: np.ndarray
    placement: Placement
    crs: None = None
    columns: int = 3

    @property
    def scanner(self) -> np.ndarray:
        return self.placement.pose.translation

    @property
    def records(self) -> int:
        return len(self.xyz)

    def stream(self) -> Iterator[np.ndarray]:
        yield self.placement.pose @ self.xyz

    lit = stream


def sites() -> list[ComparisonSite]:
    return [
        ComparisonSite.ball(str(k), (hanoi_facade.EAST, y, z), hanoi_facade.SITE_RADIUS)
        for k, (y, z) in enumerate(hanoi_facade.SITES, start=1)
    ]


def placed(made: Twin, adjustment: Adjustment) -> tuple[list[Placed], StationPair]:
    """Both scans of the sites, and the pair of stations, the second first."""
    out, state = [], adjustment.state
    for name in NAMES:
        number = [one.name for one in made.scans].index(f"{name}-sites")
        xyz = np.concatenate([block.xyz for block in made.measure(number)])
        k = state.layout.index("pose", name)
        pose = Pose(state.pose_r[k], state.pose_t[k])
        where = Placement(name, pose, adjustment.covariance(name), hanoi_facade.NOISE)
        out.append(Placed(Path(f"{name}.laz"), xyz, where))
    return out, StationPair.from_adjustment(adjustment, NAMES[1], NAMES[0])


def adjusted(made: Twin, folder: Path, seed: int = 0) -> Adjustment:
    return adjust(survey(made, folder, seed=seed).network())


def compared(
    clouds: list[Placed],
    pair: StationPair,
    incidence: bool = True,
    chosen: list[ComparisonSite] | None = None,
) -> list[SiteResult]:
    a, b = clouds
    return compare_clouds(a, b, chosen or sites(), stations=pair, incidence=incidence)  # type: ignore[arg-type]
