import numpy as np
import pytest

from tests.comparison.planes import plane
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.m3c2 import M3C2Settings, m3c2
from tribrach.comparison.projection_cylinders import Cylinders, medians
from tribrach.errors import InputError

UTM = np.array([584_123.4, 2_326_011.7, 12.3])
NORMALS = [(0, 0, 1), (0, 1, 0), (0.3, -0.8, 0.5), (1, 1, 0)]


def settings(normal, **more) -> M3C2Settings:
    return M3C2Settings([0.3], 0.2, 0.2, direction=np.asarray(normal, float), **more)


@pytest.mark.parametrize("normal", NORMALS)
@pytest.mark.parametrize("median", [False, True])
def test_offset_of_tilted_planes(normal, median) -> None:
    rng = np.random.default_rng(1)
    a, b = (
        plane(rng, normal, 0.0, 30_000, origin=UTM),
        plane(rng, normal, 0.037, 30_000, origin=UTM),
    )
    core = a[np.linalg.norm(a - UTM, axis=1) < 0.7][:100]
    found = m3c2(whole(a, most=7000), whole(b), core, settings(normal, median=median))
    assert found.distance == pytest.approx(np.full(100, 0.037), abs=1e-8)
    assert found.warnings == []
    back = m3c2(whole(b), whole(a), core, settings(normal), normals=found.normals)
    assert back.distance == pytest.approx(-found.distance, abs=1e-8)


def test_counts_positions_and_spreads_by_brute_force() -> None:
    rng = np.random.default_rng(2)
    normal = np.array([0.2, 0.9, 0.3])
    a, b = (plane(rng, normal, o, 4000, sigma=0.01) for o in (0.0, 0.02))
    core = a[:40]
    found = m3c2(whole(a, most=999), whole(b), core, settings(normal))
    for k in range(40):
        offset, n = b - core[k], found.normals.vectors[k]
        along = offset @ n
        inside = (np.abs(along) <= 0.2) & (np.linalg.norm(np.cross(offset, n), axis=1) <= 0.1)
        assert found.second.count[k] == inside.sum()
        assert found.second.position[k] == pytest.approx(along[inside].mean(), abs=1e-12)
        assert found.second.spread[k] == pytest.approx(along[inside].std(ddof=1), abs=1e-12)


def test_medians_in_blocks_are_those_of_numpy() -> None:
    rng = np.random.default_rng(3)
    b = plane(rng, (0, 0, 1), 0.0, 5000, sigma=0.02)
    core = plane(rng, (0, 0, 1), 0.0, 30, size=1.5)
    cylinders = Cylinders.around(core, np.tile([0.0, 0, 1], (30, 1)), 0.2, 0.2)
    found = medians(whole(b, most=600), cylinders, most=100)
    for k in range(30):
        d = (b - core[k])[np.hypot(*(b - core[k])[:, :2].T) <= 0.1, 2]
        low, middle, high = np.quantile(d, [0.25, 0.5, 0.75])
        assert found.position[k] == pytest.approx(middle, abs=1e-12)
        assert found.spread[k] == pytest.approx((high - low) / 1.34898, rel=1e-5)


@pytest.mark.parametrize("median", [False, True])
def test_level_covers_95_percent_of_noise(median) -> None:
    rng = np.random.default_rng(4)
    # cylinders that share no points, flat normals: 3600 independent distances
    core = np.stack([*np.meshgrid(np.arange(60), np.arange(60)), np.zeros((60, 60))], -1) * 0.25
    core = core.reshape(-1, 3)
    up = np.array([0.0, 0, 1])
    clouds = []
    for sigma in (0.004, 0.006):
        xyz = rng.uniform(-0.2, 15, (400_000, 3))
        xyz[:, 2] = sigma * rng.normal(size=400_000)
        clouds.append(whole(xyz, most=170_000))
    from_plane = whole(rng.uniform(-1, 16, (200_000, 3)) * [1, 1, 0])
    flat = m3c2(from_plane, from_plane, core, settings(up)).normals
    found = m3c2(*clouds, core, settings(up, median=median), normals=flat)
    assert found.few == 0
    alarms = (np.abs(found.distance) > found.lod95).mean()
    assert alarms == pytest.approx(0.055, abs=0.015)


def test_fewer_than_five_points_give_no_value_and_few_a_warning() -> None:
    grid = np.stack(np.meshgrid(np.arange(-9, 10), np.arange(-9, 10)), -1).reshape(-1, 2) * 0.05
    a = np.column_stack([grid, np.zeros(len(grid))])
    b = a[np.abs(a[:, 0]) < 0.001] + [0, 0, 0.01]
    core = np.array([[0.0, 0.0, 0.0], [0.08, 0.0, 0.0], [0.5, 0.0, 0.0], [50.0, 0.0, 0.0]])
    found = m3c2(whole(a), whole(b), core, settings((0, 0, 1)))
    assert np.array_equal(found.second.count, [5, 3, 0, 0])
    assert found.distance[0] == pytest.approx(0.01)
    assert np.isnan(found.distance[1:]).all()
    assert np.isnan(found.lod95[1:]).all()
    assert found.few == 1
    assert len(found.warnings) == 3
    assert "1 core points have no normal" in found.warnings[0]


def test_overlapping_beams_widen_the_level() -> None:
    rng = np.random.default_rng(5)
    a, b = (plane(rng, (0, 0, 1), 0.0, 40_000, sigma=0.003) for _ in range(2))
    core = np.zeros((1, 3))
    plain = m3c2(whole(a), whole(b), core, settings((0, 0, 1)))
    areas = (np.array([np.pi / 4 * 0.02**2]), np.array([np.pi / 4 * 0.02**2]))
    found = m3c2(whole(a), whole(b), core, settings((0, 0, 1)), footprints=areas)
    assert plain.independent is None
    # the cylinder's area over that of the beam
    assert found.independent[0] == pytest.approx([100, 100], rel=0.06)
    ratio = found.noise_independent[0] / found.noise[0]
    assert ratio == pytest.approx(np.sqrt(found.first.count[0] / 100), rel=0.06)


def test_calls_that_make_no_sense() -> None:
    a = whole(np.zeros((10, 3)))
    with pytest.raises(InputError, match="diameter"):
        M3C2Settings([0.1], 0.0, 0.2)
    with pytest.raises(InputError, match="depth"):
        M3C2Settings([0.1], 0.1, np.inf)
    with pytest.raises(InputError, match="registration"):
        M3C2Settings([0.1], 0.1, 0.2, registration=-1)
    with pytest.raises(InputError, match="no core points"):
        m3c2(a, a, np.empty((0, 3)), settings((0, 0, 1)))
    with pytest.raises(InputError, match="not a number"):
        m3c2(a, a, np.full((1, 3), np.nan), settings((0, 0, 1)))
    with pytest.raises(InputError, match="not a number"):
        m3c2(whole(np.full((1, 3), np.nan)), a, np.zeros((1, 3)), settings((0, 0, 1)))
