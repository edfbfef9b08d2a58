"""Closed-form alignments against constructed truth and Ghilani's printed example."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.alignment import group_rigid, kabsch, planar, umeyama, upright_rms


def cloud(rng: np.random.Generator, n: int = 8) -> np.ndarray:
    return rng.uniform(-20, 20, (n, 3))


def test_kabsch_returns_the_motion(rng: np.random.Generator) -> None:
    local, turn, shift = cloud(rng), rotation.exp(np.array([0.3, -2.0, 1.1])), np.array([5.0, 6, 7])
    fit = kabsch(local, local @ turn.T + shift, rng.uniform(0.5, 2, 8))
    assert np.allclose(fit.rotation, turn, atol=1e-12)
    assert np.allclose(fit.translation, shift, atol=1e-11)
    assert fit.rms < 1e-12
    assert fit.scale == 1.0
    assert np.allclose(fit(local), local @ turn.T + shift)
    assert fit.hint(upright_rms(local, fit(local))) == ""


def test_umeyama_returns_the_scale(rng: np.random.Generator) -> None:
    local, turn = cloud(rng), rotation.exp(np.array([1.0, 0.5, -0.7]))
    fit = umeyama(local, 0.73 * local @ turn.T - 4.0)
    assert fit.scale == pytest.approx(0.73, abs=1e-12)
    assert np.allclose(fit.rotation, turn, atol=1e-12)


def test_umeyama_near_the_weighted_solution_of_ghilani() -> None:
    # Ghilani, Adjustment Computations, chapter 18: scale 0.94996, translations in metres
    measured = np.array(
        [
            [1094.883, 820.085, 109.821],
            [503.891, 1598.698, 117.685],
            [2349.343, 207.658, 151.387],
            [1395.320, 1348.853, 215.261],
        ]
    )
    control = np.array(
        [
            [10037.81, 5262.09, 772.04],
            [10956.68, 5128.17, 783.00],
            [8780.08, 4840.29, 782.62],
            [10185.80, 4700.21, 851.32],
        ]
    )
    fit = umeyama(measured, control)
    assert fit.scale == pytest.approx(0.94996, abs=3e-5)
    assert np.allclose(fit.translation, [10233.858, 6549.981, 720.897], atol=0.2)


def test_planar_in_the_plane(rng: np.random.Generator) -> None:
    local, a = rng.uniform(-5, 5, (2, 2)), 0.8
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    fit = planar(local, local @ turn.T + [3, 4])
    assert np.allclose(fit.rotation, turn)
    assert fit.rms < 1e-12


def test_mirrored_triangle_keeps_a_proper_rotation() -> None:
    triangle = np.array([[0.0, 0, 0], [10, 0, 0], [0, 5, 1]])
    other = triangle[:, [1, 0, 2]]
    fit = kabsch(triangle, other)
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
    assert "columns look swapped (N/E)" in fit.hint(upright_rms(triangle, other))
    # what fits in no way is not called upside down
    assert fit.hint(4 * fit.rms) == ""


def test_swapped_columns_are_named(rng: np.random.Generator) -> None:
    local = cloud(rng) + np.array([1000.0, 2000.0, 50.0])
    fit = kabsch(local, local[:, [1, 0, 2]])
    assert fit.mirrored
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
    assert "columns look swapped (N/E)" in fit.hint(0.0)
    assert planar(local[:, :2], local[:, [1, 0]]).mirrored


def test_flat_noisy_figures_are_not_called_mirrored(rng: np.random.Generator) -> None:
    for _ in range(50):
        local = cloud(rng) * [1, 1, 0]
        other = local + rng.normal(0, 0.01, local.shape)
        assert kabsch(local, other).hint(upright_rms(local, other)) == ""


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_points_on_a_line_are_refused(n: int) -> None:
    line = np.arange(n)[:, None] * np.array([[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match="not on one line"):
        kabsch(line, line)


def test_groups_agree_with_single_alignments(rng: np.random.Generator) -> None:
    group = rng.integers(0, 5, 60)
    local, world = rng.normal(size=(60, 3)), rng.normal(size=(60, 3))
    fits = group_rigid(group, 6, local, world)
    assert fits.count[5] == 0
    for k in range(5):
        one = kabsch(local[group == k], world[group == k])
        assert np.allclose(fits.rotation[k], one.rotation)
        assert np.allclose(fits.translation[k], one.translation)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)
