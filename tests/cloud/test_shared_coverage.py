"""Monte Carlo of stated intervals: how often those of five quantities hold the truth.

From observations that are drawn, through adjustment, shared part and placement, to the sigma that
is stated of a distance between walls, a mean, an area, a volume between two epochs of one spot, and
an M3C2 difference of two stations.
"""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from tests.cloud.surveyed_walls import PATCHES, Yard, patch, surveyed
from tribrach.cloud.quantities import area_of, mean_of, plane_distance, volume_between
from tribrach.cloud.shared_part import CloudPoints
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.core_points import Normals, core_points
from tribrach.comparison.m3c2 import M3C2Settings
from tribrach.comparison.m3c2_ep import m3c2_ep
from tribrach.comparison.predicted import predict, with_random
from tribrach.comparison.station_pair import StationPair

#: patches that face each other, and by which stations the two are scanned
FACING = ((0, 5, "S1", "S1"), (1, 4, "S2", "S2"), (2, 7, "S1", "S2"), (3, 6, "S2", "S1"))
#: width of cylinders, side of cells, and what moved between the epochs [m]
CYLINDER, CELL, MOVED = 0.3, 0.25, 0.05
LIMIT = 1.959964


def normalised(yard: Yard) -> dict[str, list[float]]:
    """Errors of the five quantities over their stated sigmas."""
    rng, out = yard.rng, defaultdict[str, list[float]](list)
    walls = [(np.array(middle), np.array(normal)) for middle, normal in PATCHES]

    def scanned(station: str, k: int, n: int, moved: float = 0.0) -> CloudPoints:
        middle, normal = walls[k]
        surface = patch(rng, middle + moved * normal, normal, n, 1.0)
        return yard.scanned(station, surface, normal)

    for one, two, *stations in FACING:
        truth = abs((walls[two][0] - walls[one][0]) @ walls[one][1])
        found = plane_distance(scanned(stations[0], one, 150), scanned(stations[1], two, 150))
        out["distance"].append((found.value - truth) / found.sigma)
    for k, (middle, normal) in enumerate(walls):
        station = ("S1", "S2", "S3")[k % 3]
        mean = mean_of(scanned(station, k, 200)).along(normal)
        out["mean"].append((mean.value - middle @ normal) / mean.sigma)
        across = np.linalg.svd(normal[None])[2][1:]
        places = [
            middle + a * across[0] + b * across[1] for a, b in ((0, 0), (3, 0), (3, 2), (0, 2))
        ]
        true = [patch(rng, place, normal, 10, 0.1) for place in places]
        corners = [yard.scanned(station, surface, normal) for surface in true]
        ends = np.array([surface.mean(axis=0) for surface in true])
        area = 0.5 * np.linalg.norm(np.cross(ends[2] - ends[0], ends[3] - ends[1]))
        found = area_of(corners)
        out["area"].append((found.value - area) / found.sigma)
        before, after = scanned("S1", k, 250), scanned("S3", k, 250, moved=MOVED)
        volume = volume_between(before, after, CELL, normal)
        out["volume"].append((volume.value - MOVED * volume.area) / volume.sigma)
        offset, sigma = difference(yard, k, scanned("S1", k, 400), scanned("S2", k, 400))
        out["M3C2"].append(offset / sigma)
    return out


def difference(yard: Yard, k: int, first: CloudPoints, second: CloudPoints) -> tuple[float, float]:
    """M3C2 of two stations on a wall that did not move: mean distance and its stated sigma."""
    normal = np.array(PATCHES[k][1])
    core = core_points(whole(second.xyz), CYLINDER)
    n = len(core)
    normals = Normals(
        np.tile(normal, (n, 1)), np.full(n, 1.0), np.zeros(n), np.ones(n), np.full(n, 99)
    )
    sources = [
        with_random(lambda xyz=one.xyz: iter([xyz]), one.placement, core, normals.vectors)
        for one in (first, second)
    ]
    pair = StationPair.of(yard.shared, "S1", "S2")
    settings = M3C2Settings(scales=(1.0,), diameter=CYLINDER, depth=0.1)
    found = predict(m3c2_ep(*sources, core, settings, pair, normals=normals), pair, CYLINDER)
    assert found is not None
    return found.offset, found.offset_sigma


def surveys(seeds: range, folder: Path) -> dict[str, np.ndarray]:
    """Errors over stated sigmas of each quantity, surveys by patches."""
    every = defaultdict[str, list[list[float]]](list)
    for seed in seeds:
        for name, ratios in normalised(surveyed(seed, folder)).items():
            every[name].append(ratios)
    return {name: np.array(ratios) for name, ratios in every.items()}


@pytest.mark.slow
def test_intervals_of_95_percent_hold_95_percent(tmp_path: Path) -> None:
    """200 surveys with 4 distances and 10 patches each; the patches of one survey are not free."""
    found = surveys(range(1000, 1200), tmp_path)
    assert list(found) == ["distance", "mean", "area", "volume", "M3C2"]
    for name, ratios in found.items():
        assert np.mean(np.abs(ratios) <= LIMIT) == pytest.approx(0.95, abs=0.015), name


def test_errors_are_as_large_as_stated(tmp_path: Path) -> None:
    """A few surveys; a mean that took its points as independent would be many sigmas off."""
    found = surveys(range(1000, 1004), tmp_path)
    for name, ratios in found.items():
        # mean squares of 16 and 40 ratios, of which perhaps a third are independent
        assert 0.5 < np.sqrt(np.mean(ratios**2)) < 1.6, name
    yard = surveyed(1, tmp_path)
    middle, normal = np.array(PATCHES[0])
    one = yard.scanned("S1", patch(yard.rng, middle, normal, 200, 1.0), normal)
    mean = mean_of(one).along(normal)
    assert mean.sigma > 3 * np.sqrt(mean.own)
    assert mean.floor > 0.95 * mean.sigma
