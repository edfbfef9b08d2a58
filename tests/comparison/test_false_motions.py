"""Edges, feet of walls and sunken planes are called neither bodies that moved nor sampling."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.comparison.c2c import SAMPLING
from tribrach.comparison.surface_patches import Patches, edges_of
from tribrach.job.cloud_file import one_run, open_cloud, station_pair
from tribrach.job.compare import Registration, compare_clouds
from tribrach.questions.compare.motions import MotionCollector
from tribrach.units import SEC


def patches_at(cells: np.ndarray) -> Patches:
    """Patches at some cells, whose distances do not matter."""
    p = len(cells)
    return Patches(
        np.arange(p), cells, np.zeros((p, 6, 6)), np.zeros((p, 6)), np.zeros(p),
        np.full(p, 9), np.zeros((p, 5)), 1.0,
    )  # fmt: skip


def test_a_ring_around_a_part_is_its_edge_and_a_body_beside_it_is_none() -> None:
    grid = np.array([(x, y, 0) for x in range(12) for y in range(6)])
    x, y = grid[:, 0], grid[:, 1]
    block = np.flatnonzero((x >= 1) & (x <= 3) & (y >= 1) & (y <= 3))
    ring = np.flatnonzero((x <= 4) & (y <= 4) & ~np.isin(np.arange(len(grid)), block))
    other = np.flatnonzero((x >= 5) & (x <= 8) & (y <= 1))
    assert edges_of(patches_at(grid), [block, ring[:6]]) == [False, True]
    # two patches deep, a part is a body of its own
    assert edges_of(patches_at(grid), [block, other]) == [False, False]
    assert edges_of(patches_at(grid), []) == []


def test_the_foot_of_a_wall_did_not_move(shared_data: Path) -> None:
    """Core points on the ground whose normals are mixed of ground and wall."""
    case = shared_data / "faults" / "worlds" / "06-wall-foot-moved-upwards"
    later, earlier = open_cloud(case / "e2" / "S1.laz"), open_cloud(case / "e1" / "S1.laz")
    pair = station_pair(earlier, later)
    assert pair is not None
    collector = MotionCollector(pair)
    found = compare_clouds(
        later, earlier, method="m3c2", stations=pair, distances=collector
    )  # fmt: skip
    motions = collector.motions(earlier, found, [], one_result=one_run(later, earlier))
    assert motions.stable is not None
    assert motions.stable.agrees
    assert not [part for part in motions.parts if part.differs]


@pytest.mark.parametrize("method", ["c2c", "both"])
def test_a_plane_that_sank_is_not_called_sampling(shared_data: Path, method: str) -> None:
    case = shared_data / "faults" / "scans2" / "13-plain-words"
    a, b = open_cloud(case / "later.ply"), open_cloud(case / "earlier.ply")
    (site,) = compare_clouds(a, b, method=method)  # type: ignore[arg-type]
    assert site.c2c is not None
    assert site.c2c.debiased_rms is None
    assert SAMPLING not in site.c2c.notes
    (same,) = compare_clouds(b, b, method=method)  # type: ignore[arg-type]
    assert same.c2c is not None
    assert SAMPLING in same.c2c.notes


def test_levels_hold_the_registration_of_clouds_of_others(shared_data: Path) -> None:
    """Nothing moved; the clouds lie 6 mm and 0.02 degrees beside each other."""
    case = shared_data / "faults" / "scans2" / "14-moved-for-others"
    a, b = open_cloud(case / "2.ply"), open_cloud(case / "1.ply")
    (blind,) = compare_clouds(a, b, method="m3c2")
    (told,) = compare_clouds(a, b, method="m3c2", registration=Registration(0.006, 72 * SEC))
    assert blind.m3c2 is not None
    assert told.m3c2 is not None
    assert blind.m3c2.changed is not None
    assert told.m3c2.changed is not None
    assert any("not in the levels" in note for note in blind.m3c2.notes)
    assert not any("not in the levels" in note for note in told.m3c2.notes)
    assert blind.m3c2.changed > 0.5
    assert told.m3c2.changed < 0.1
