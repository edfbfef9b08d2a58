"""Normals of a plane and a sphere, cosines of the incidence on a wall."""

import numpy as np
import pytest

from tribrach.scan.normals import FLATTEST, incidence_cosines, normals


def test_incidence_on_a_wall_is_the_angle_of_the_beam() -> None:
    rng = np.random.default_rng(1)
    y, z = rng.uniform(-20, 20, (2, 20_000))
    wall = np.stack([np.full_like(y, 5.0), y, z], axis=1)
    expected = np.maximum(5.0 / np.linalg.norm(wall, axis=1), FLATTEST)
    assert incidence_cosines(wall) == pytest.approx(expected, abs=1e-6)
    assert normals(wall)[:, 0] == pytest.approx(-1.0, abs=1e-9)


def test_normals_of_a_sphere_are_its_radii() -> None:
    rng = np.random.default_rng(2)
    unit = rng.normal(size=(40_000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    centre = np.array([10.0, 0.0, 0.0])
    found = normals(centre + unit)
    assert np.abs(np.einsum("ni,ni->n", found, unit)).min() > 0.99


def test_too_few_points_have_no_incidence() -> None:
    assert incidence_cosines(np.ones((5, 3))) == pytest.approx(1.0)


def test_some_of_the_points_have_the_normals_that_they_have_among_all() -> None:
    xyz = np.random.default_rng(4).normal(size=(500, 3)) * [1.0, 1.0, 0.1] + [5.0, 0.0, 1.0]
    rows = np.array([3, 77, 78, 499])
    assert (normals(xyz, rows=rows) == normals(xyz)[rows]).all()
    assert (incidence_cosines(xyz, rows=rows) == incidence_cosines(xyz)[rows]).all()
    assert np.isnan(normals(xyz[:5], rows=rows[:1])).all()
    assert normals(xyz, rows=rows[:0]).shape == (0, 3)
