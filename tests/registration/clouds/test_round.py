"""Round bodies: curvature against closed forms, and a base among trees against the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.clouds.scenes import GROVE_PLACES, grove, scanned
from tests.registration.clouds.test_covariance import NO_FLOOR, START, off
from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.registration.clouds.curvature import formed
from tribrach.registration.clouds.fine import Indexed, align, matched
from tribrach.registration.clouds.pair import register_pair
from tribrach.registration.clouds.surfels import (
    FLAT,
    ROUND,
    UNKNOWN,
    CellSum,
    Surfels,
    surfels_of,
)

#: axis of the trunk of the tests, and its radius [m]
AXIS, RADIUS = np.array([5.0, 1.0]), 0.17


def surfels(xyz: Array, size: float = 0.1) -> Surfels:
    """Surfels of points (n, 3) with their forms, cubes askew."""
    askew = Pose(exp(np.array([0.37, 0.53, 0.29])), np.zeros(3))
    cubes = CellSum(size)
    cubes.add(askew @ xyz)
    return formed(surfels_of(cubes.cells).placed(askew.inverse), 100_000)


def trunk(rng: np.random.Generator, noise: float = 0.001) -> Array:
    """Points (n, 3) of an upright trunk as the origin sees them: less and less to the sides."""
    turn = rng.uniform(-np.pi / 2, np.pi / 2, 60_000)
    turn = turn[rng.random(len(turn)) < np.cos(turn)] + np.pi + np.arctan2(*AXIS[::-1])
    radius = RADIUS + rng.normal(0, noise, len(turn))
    plan = AXIS + radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.column_stack([plan, rng.uniform(-1.5, 1.5, len(turn))])


def outwards(s: Surfels) -> tuple[Array, Array]:
    """Directions (n, 3) of surfels from the axis, and their distances (n,) [m]."""
    way = s.center[:, :2] - AXIS
    far = np.linalg.norm(way, axis=1)
    return np.column_stack([way / far[:, None], np.zeros(len(s))]), far


def test_a_trunk_bends_as_its_radius_says() -> None:
    """The surface through a cube has the trunk's axis and radius, at its sides as in its middle."""
    s = surfels(trunk(np.random.default_rng(1)))
    way, far = outwards(s)
    round_ = (s.form == ROUND) & (np.abs(s.center[:, 2]) < 1.3)
    assert round_.sum() > 0.9 * (np.abs(s.center[:, 2]) < 1.3).sum()
    s, way, far = s.subset(round_), way[round_], far[round_]
    # f = (rho^2 - r^2) / (2 rho) has a gradient of length one at the mean, which is at rho
    curvature = np.trace(s.bend, axis1=1, axis2=2) / 2
    assert np.median(curvature * far) == pytest.approx(1.0, abs=0.003)
    assert np.quantile(np.abs(curvature * far - 1), 0.9) < 0.05
    across = s.gradient @ [0, 0, 1]
    side = np.einsum("ni,ni->n", s.gradient, np.cross([0, 0, 1], way))
    view = np.sign(np.einsum("ni,ni->n", -s.center, np.cross([0, 0, 1], way)))
    assert abs((side * view).mean()) < 4 * side.std() / np.sqrt(len(s)) + 1e-4
    assert np.quantile(np.abs(side), 0.9) < np.radians(1.0)
    assert np.quantile(np.abs(across), 0.9) < np.radians(1.0)
    # points lie behind the surface by what spread and bend say
    sagitta = 0.5 * np.einsum("nij,nij->n", s.bend, s.spread)
    behind = RADIUS - far
    assert np.median(sagitta) > 0.001
    assert np.mean(sagitta - behind) == pytest.approx(0.0, abs=5e-5)


def test_means_of_one_side_agree_with_the_surface_of_the_other() -> None:
    """Two stations at right angles: residuals without bias where each sees its own side."""
    rng = np.random.default_rng(2)
    turned = Pose(exp(np.array([0, 0, np.pi / 2])), np.zeros(3))
    here = Pose(np.eye(3), np.array([*AXIS, 0.0]))
    # the same trunk as another station sees it
    moved = here @ turned @ here.inverse
    a = surfels(trunk(rng))
    b = surfels(trunk(rng)).placed(moved)
    both = Indexed.of(a), Indexed.of(b)
    m = matched(*both, Pose.identity(), 0.05)
    assert len(m) > 100
    assert (np.where(m.forward, a.form[m.first], b.form[m.second]) == ROUND).all()
    assert abs(m.residual[m.forward].mean()) < 2e-4
    assert abs(m.residual[~m.forward].mean()) < 2e-4
    # the planes of the cubes are off by a millimetre or more, away from each other; along the mean
    # of both normals that cancels
    flat = [
        Indexed.of(replace(s, form=np.zeros_like(s.form), bend=np.zeros_like(s.bend)))
        for s in (a, b)
    ]
    m = matched(*flat, Pose.identity(), 0.05)
    own = np.where(
        m.forward[:, None], flat[0].surfels.normal[m.first], flat[1].surfels.normal[m.second]
    )
    apart = flat[1].surfels.center[m.second] - flat[0].surfels.center[m.first]
    off = np.einsum("ni,ni->n", own, apart)
    assert off[m.forward].mean() < -8e-4
    assert off[~m.forward].mean() > 8e-4
    assert abs(m.residual.mean()) < 2e-4


def test_walls_are_flat() -> None:
    """A corner of two walls: hardly a surfel on them is taken for round."""
    rng = np.random.default_rng(3)
    u, z = rng.uniform(0, 3, (2, 60_000)), rng.uniform(-1.5, 1.5, (2, 60_000))
    off = rng.normal(0, 0.001, (2, 60_000))
    walls = [np.column_stack([4 + u[0], 2 + off[0], z[0]])]
    walls += [np.column_stack([4 + off[1], 2 + u[1], z[1]])]
    s = surfels(np.concatenate(walls))
    inside = (np.hypot(s.center[:, 0] - 4, s.center[:, 1] - 2) > 0.2) & (s.size < 0.15)
    assert (s.form[inside] == FLAT).mean() > 0.999


def of_base(seed: int, points: int) -> tuple[float, float, float]:
    """Error of the base, its sigma [m], and the squared error of the pose over its covariance."""
    scans, poses = scanned(grove(seed), GROVE_PLACES, points=points, seed=seed)
    true = poses[0].inverse @ poses[1]
    found = register_pair(*scans, START @ true, floor=NO_FLOOR)
    assert found.fit is not None, found.sentences
    precision = found.fit.precision
    assert precision.rank == 6
    error = off(found.fit.pose, true, precision.middle)
    base = np.linalg.norm(true.translation)
    along = true.translation / base
    sigma = np.sqrt(along @ precision.covariance[:3, :3] @ along)
    square = error @ np.linalg.solve(precision.local, error)
    return float(np.linalg.norm(found.fit.pose.translation) - base), float(sigma), float(square)


def test_a_base_among_trees_is_not_too_long() -> None:
    """Two groves; planes on the trunks make this base 1 to 3 mm too long, and the square 80."""
    found = np.array([of_base(seed, 250_000) for seed in (31, 32)])
    assert (np.abs(found[:, 0]) < 3 * found[:, 1]).all()
    assert (found[:, 1] < 5e-4).all()
    low, high = chi2.ppf([0.0005, 0.9995], 12)
    assert low < found[:, 2].sum() < high


@pytest.mark.slow
def test_bases_in_thirty_groves() -> None:
    """Mean error of the base within two sigmas of this mean, poses chi-square (99 %)."""
    found = np.array([of_base(seed, 400_000) for seed in range(1, 31)])
    sigma_of_mean = np.sqrt((found[:, 1] ** 2).sum()) / len(found)
    assert abs(found[:, 0].mean()) < 2 * sigma_of_mean
    low, high = chi2.ppf([0.005, 0.995], len(found))
    assert low < ((found[:, 0] / found[:, 1]) ** 2).sum() < high
    low, high = chi2.ppf([0.005, 0.995], 6 * len(found))
    assert low < found[:, 2].sum() < high


def test_unknown_forms_take_no_part() -> None:
    """Surfels of unknown form take no part: no match has one as its surface."""
    scans, poses = scanned(grove(33), GROVE_PLACES, points=250_000, seed=33)
    a, b = (s.fine for s in scans)
    m = align(a, b, START @ (poses[0].inverse @ poses[1])).matches
    surface = np.where(m.forward, a.surfels.form[m.first], b.surfels.form[m.second])
    point = np.where(m.forward, b.surfels.form[m.second], a.surfels.form[m.first])
    assert (a.surfels.form == UNKNOWN).any()
    assert not (surface == UNKNOWN).any()
    assert (point[surface == FLAT] == FLAT).all()
