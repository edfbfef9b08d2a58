"""Edges, feet of walls and sunken planes are called neither bodies that moved nor sampling."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.comparison.c2c import SAMPLING
from tribrach.comparison.common_effect import common_effect
from tribrach.comparison.rigid_motion import PlaceDistances
from tribrach.comparison.surface_patches import Patches, edges_of
from tribrach.job.cloud_file import CloudFile, one_run, open_cloud, station_pair
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


def room(folder: Path, name: str, seed: int, risen: float = 0.0, shift: float = 0.0) -> CloudFile:
    """Floor and two walls of a room, 2 mm of noise; a slab of the floor rose, all is shifted."""
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform(0, 6, (3, 8_000)) * [[1], [1], [0.5]]
    flat = rng.normal(0, 0.002, (3, 8_000))
    slab = (abs(x - 3) < 1.3) & (abs(y - 2.5) < 1.0)
    faces = ((x, y, flat[0] + risen * slab), (x, 6 + flat[1], z), (flat[2], y, z))
    np.savetxt(folder / name, np.concatenate([np.stack(f, axis=1) for f in faces]) + shift, "%.5f")
    return open_cloud(folder / name)


def test_what_moved_in_clouds_of_others(tmp_path: Path) -> None:
    """Nothing but a sigma of the registration is known: a slab is found, a shift is none."""
    earlier = room(tmp_path, "e.xyz", 1)
    later = room(tmp_path, "l.xyz", 2, risen=0.02, shift=0.004)
    known = Registration(0.005, 70 * SEC)
    collector = MotionCollector(known)
    found = compare_clouds(
        later, earlier, method="m3c2", registration=known, distances=collector
    )  # fmt: skip
    motions = collector.motions(earlier, found, [])
    assert motions.stable is not None
    assert motions.stable.agrees
    (body,) = (part for part in motions.parts if part.differs)
    assert body.against_stable is not None
    assert body.against_stable.values[0] == pytest.approx(0.02, abs=0.001)


def box(effect: str, size: float) -> PlaceDistances:
    """Distances of the faces of a box from a scanner in it, whose ranges or whose wall differ."""
    rng = np.random.default_rng(3)
    core = rng.uniform([-3, -2, -1.5], [5, 4, 1.5], (6, 1500, 3))
    normals = np.zeros_like(core)
    for k, (axis, at) in enumerate([(0, -3), (0, 5), (1, -2), (1, 4), (2, -1.5), (2, 1.5)]):
        core[k, :, axis] = at
        normals[k, :, axis] = -np.sign(at)
    core, normals = core.reshape(-1, 3), normals.reshape(-1, 3)
    length = np.linalg.norm(core, axis=1)
    along = (normals * core).sum(axis=1)
    values = {"scale": along, "zero": along / length, "wall": -1.0 * (core[:, 0] == 5)}[effect]
    sigma = np.full(len(core), 0.0004)
    noise = rng.normal(0, sigma) + 0.003 * normals[:, 0]
    pair = Registration(0.002).pair(core)
    return PlaceDistances(
        core, normals, size * values + noise, sigma, np.zeros(len(core), dtype=np.int64), pair
    )


@pytest.mark.parametrize(("kind", "size"), [("scale", 1e-3), ("zero", 0.004), ("wall", 0.01)])
def test_what_a_campaign_measured_otherwise_is_not_called_moved(kind: str, size: float) -> None:
    given = box(kind, size)
    rest, effect = common_effect(given, 0.2, [np.zeros(3)])
    if kind == "wall":
        assert effect is None
        assert rest is given
        return
    # of walls of one direction nothing is told
    assert common_effect(given.some(given.normals[:, 0] != 0), 0.2, [np.zeros(3)])[1] is None
    assert effect is not None
    assert effect.kind == kind
    assert abs(effect.value - size) < 4 * effect.sigma
    assert effect.sigma < 0.02 * size
    assert effect.share > 0.9


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
