import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.comparison.planes import plane
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.core_points import core_normals, core_points
from tribrach.errors import InputError

UTM = np.array([584_123.4, 2_326_011.7, 12.3])


def test_one_point_per_cell_and_it_is_the_nearest_to_the_middle() -> None:
    xyz = np.random.default_rng(1).uniform(0, 3, (30_000, 3))
    core = core_points(whole(xyz), 1.0)
    cells = np.floor(xyz - xyz[0])
    inner = np.array([len(core_in(cell, core - xyz[0])) for cell in np.unique(cells, axis=0)])
    assert inner.max() == 1
    for point in core:
        mine = xyz[(cells == np.floor(point - xyz[0])).all(axis=1)] - xyz[0]
        miss = np.linalg.norm(mine - np.floor(mine) - 0.5, axis=1)
        kept = point - xyz[0]
        assert np.linalg.norm(kept - np.floor(kept) - 0.5) == pytest.approx(miss.min())


def core_in(cell: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points[(np.floor(points) == cell).all(axis=1)]


@pytest.mark.parametrize("place", [0.0, 0.01, 0.98, 0.25, 0.5])
def test_a_wall_has_its_core_points_once_wherever_the_grid_cuts_it(place: float) -> None:
    """A wall of 40 m^2 with 2 mm of noise: a face of the grid through it would double them."""
    rng = np.random.default_rng(4)
    n, spacing = 200_000, 0.05
    wall = np.stack([rng.uniform(0, 10, n), rng.normal(0, 2e-3, n), rng.uniform(0, 4, n)], axis=1)
    wall[:, 1] += (100 + place) * spacing
    core = core_points(whole(wall), spacing, origin=np.zeros(3))
    cells = 40 / spacing**2
    assert 0.98 * cells < len(core) < 1.15 * cells
    apart, _ = cKDTree(core).query(core, k=2)
    assert apart[:, 1].min() >= spacing / 2


def test_parts_and_large_coordinates_change_nothing() -> None:
    xyz = np.random.default_rng(2).uniform(0, 5, (20_000, 3)) + UTM
    one = core_points(whole(xyz), 0.5)
    assert np.array_equal(one, core_points(whole(xyz, most=777), 0.5))


def test_wishes_that_cannot_be_met() -> None:
    xyz = np.random.default_rng(3).uniform(0, 5, (1000, 3))
    with pytest.raises(InputError, match="positive"):
        core_points(whole(xyz), 0.0)
    with pytest.raises(InputError, match="wider"):
        core_points(whole(np.array([[0.0, 0, 0], [1e9, 0, 0]])), 0.1)
    with pytest.raises(InputError, match="more than 10"):
        core_points(whole(xyz), 0.1, most=10)
    with pytest.raises(InputError, match="no points"):
        core_points(whole(np.empty((0, 3))), 0.1)


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0), (0.3, -0.8, 0.5)])
def test_normals_of_a_tilted_plane(normal) -> None:
    rng = np.random.default_rng(4)
    xyz = plane(rng, normal, 0.3, 20_000, origin=UTM)
    core = xyz[:50]
    unit = np.asarray(normal) / np.linalg.norm(normal)
    scanner = UTM - 5 * unit
    found = core_normals(whole(xyz, most=3000), core, [0.2], scanner=scanner)
    assert found.vectors == pytest.approx(np.tile(-unit, (50, 1)), abs=1e-7)
    assert (found.roughness < 1e-7).all()
    assert (found.planarity > 0.3).all()
    turned = core_normals(whole(xyz), core, [0.2], direction=unit)
    assert turned.vectors == pytest.approx(-found.vectors, abs=1e-9)


def test_roughness_is_the_noise() -> None:
    xyz = plane(np.random.default_rng(5), (0, 0, 1), 0.0, 200_000, sigma=0.004)
    core = np.random.default_rng(6).uniform(-0.7, 0.7, (200, 3)) * [1, 1, 0]
    found = core_normals(whole(xyz), core, [0.3])
    assert np.sqrt((found.roughness**2).mean()) == pytest.approx(0.004, rel=0.01)
    assert found.count.mean() == pytest.approx(50_000 * np.pi * 0.15**2, rel=0.01)


def test_the_most_planar_scale_is_taken() -> None:
    rng = np.random.default_rng(7)
    # a plane with noise: small neighbourhoods see a ball of noise, large ones the edge of a roof
    xyz = plane(rng, (0, 0, 1), 0.0, 200_000, size=2.0, sigma=0.01)
    xyz[:, 2] -= np.maximum(np.abs(xyz[:, 0]) - 0.4, 0.0) * 3
    found = core_normals(whole(xyz), np.zeros((1, 3)), [0.04, 0.7, 1.6])
    assert found.scale[0] == 0.7
    for scale in (0.04, 0.7, 1.6):
        alone = core_normals(whole(xyz), np.zeros((1, 3)), [scale])
        assert alone.planarity[0] <= found.planarity[0] + 1e-12


def test_normals_and_scales_by_brute_force() -> None:
    rng = np.random.default_rng(9)
    cloud = plane(rng, (0.2, -0.9, 0.3), 0.0, 20_000, sigma=0.004, origin=UTM)
    core, scales = cloud[:40], (0.2, 0.5)
    found = core_normals(whole(cloud, most=7000), core, scales, direction=np.array([0, -1.0, 0]))
    for k in range(40):
        best = {}
        for scale in scales:
            near = cloud[np.linalg.norm(cloud - core[k], axis=1) <= scale / 2] - core[k]
            values, axes = np.linalg.eigh(np.cov(near.T))
            best[(values[1] - values[0]) / values[2]] = (scale, axes[:, 0], values[0], len(near))
        scale, normal, least, count = best[max(best)]
        assert (found.scale[k], found.count[k]) == (scale, count)
        assert found.planarity[k] == pytest.approx(max(best))
        assert found.roughness[k] == pytest.approx(np.sqrt(least))
        assert found.vectors[k] == pytest.approx(-normal * np.sign(normal[1]), abs=1e-9)


def test_no_normal_from_few_points_or_a_line() -> None:
    line = np.linspace(0, 1, 50)[:, None] * [1.0, 2.0, 0.5]
    assert np.isnan(core_normals(whole(line), line[:2], [3.0]).vectors).all()
    few = np.random.default_rng(8).uniform(size=(4, 3))
    found = core_normals(whole(few), few, [5.0])
    assert np.isnan(found.vectors).all()
    assert np.array_equal(found.count, [4, 4, 4, 4])
    with pytest.raises(InputError, match="scales"):
        core_normals(whole(line), line, [])
