"""The stated covariance of points: equation, Monte Carlo, rounding."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from tribrach.cloud.covariance import covariances, place_with_sigmas, rounded
from tribrach.cloud.placement import Placement
from tribrach.geometry import rotation
from tribrach.geometry.polar import polar_from_xyz, xyz_by_polar, xyz_from_polar
from tribrach.geometry.pose import Pose
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.units import SEC

NOISE = ScanNoise(1.2e-3, 10e-6, 8 * SEC, 6 * SEC, 4e-3, 0.3e-3)


def placement(rng: np.random.Generator, noise: ScanNoise = NOISE) -> Placement:
    a = rng.normal(size=(6, 6)) * np.array([1e-3] * 3 + [5e-5] * 3)[:, None]
    pose = Pose(rotation.exp(rng.normal(size=3)), rng.normal(0, 30, 3))
    return Placement("S1", pose, a @ a.T, noise)


def equation(x: np.ndarray, where: Placement) -> np.ndarray:
    """Section 5.1, written out with matrices."""
    noise = where.noise
    assert noise is not None
    r, _, v = polar_from_xyz(x[None])[0]
    beam = noise.beam_angle(np.array([r]))[0]
    own = [
        noise.range_sigma(r),
        np.hypot(noise.horizontal, beam / np.sin(v)),
        np.hypot(noise.vertical, beam),
    ]
    geo = np.hstack([np.eye(3), -rotation.skew(where.pose.rotation @ x)])
    rho = where.pose.rotation @ xyz_by_polar(polar_from_xyz(x[None]))[0]
    return geo @ where.covariance @ geo.T + rho @ np.diag(np.square(own)) @ rho.T


def test_the_loops_are_the_equation() -> None:
    rng = np.random.default_rng(1)
    where, xyz = placement(rng), rng.normal(0, 20, (50, 3))
    world, sigma = place_with_sigmas(xyz, where)
    whole = covariances(xyz, where)
    expected = np.array([equation(x, where) for x in xyz])
    assert world == pytest.approx(where.pose @ xyz, abs=1e-12)
    assert sigma**2 == pytest.approx(np.einsum("nii->ni", expected), rel=1e-5)
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    assert whole == pytest.approx(expected[:, rows, columns], rel=1e-9, abs=1e-14)


def test_points_with_an_intensity_have_the_sigma_of_the_law() -> None:
    """As many scanners as points, each with the law's figure as its plain noise, say the same."""
    rng = np.random.default_rng(21)
    law = RangeLaw(0.05, -0.5, 0.0005, 20.0, 2000.0)
    where, xyz = placement(rng, replace(NOISE, law=law)), rng.normal(0, 20, (40, 3))
    light, cosine = rng.uniform(1, 4000, 40), rng.uniform(0.1, 1, 40)
    light[:5] = np.nan
    whole = covariances(xyz, where, cosine, light)
    world, sigma = place_with_sigmas(xyz, where, cosine, light)
    assert world == pytest.approx(where.pose @ xyz, abs=1e-12)
    assert sigma**2 == pytest.approx(whole[:, :3], rel=1e-5)
    for k in range(40):
        own = NOISE if k < 5 else replace(NOISE, range=law.sigma(light[[k]])[0], range_scale=0.0)
        alone, slant = replace(where, noise=own), cosine[[k]] if k < 5 else None
        assert whole[k] == pytest.approx(covariances(xyz[[k]], alone, slant)[0], rel=1e-9)
    plain = replace(where, noise=NOISE)
    assert (covariances(xyz, plain, cosine, light) == covariances(xyz, plain, cosine)).all()


def test_turned_axes_turn_the_covariance() -> None:
    rng = np.random.default_rng(2)
    where, xyz = placement(rng), rng.normal(0, 20, (5, 3))
    turn = rotation.exp(np.array([0.4, -1.0, 2.0]))
    before = np.array([equation(x, where) for x in xyz])
    after = np.array([equation(x, where.turned(turn)) for x in xyz])
    assert after == pytest.approx(turn @ before @ turn.T, abs=1e-12)


@pytest.mark.parametrize("incidence", [0.0, 60.0])
def test_monte_carlo_agrees_with_the_stated_covariance(incidence: float) -> None:
    """Mean squared normalised error of 20,000 draws within its 99.9 % bounds."""
    rng = np.random.default_rng(3)
    where, n = placement(rng), 20_000
    x, cosine = np.array([12.0, -9.0, 5.0]), np.cos(np.radians(incidence))
    polar = polar_from_xyz(x[None])
    length = polar[:, 0]
    z = rng.standard_normal((n, 3))
    across = NOISE.beam_angle(length)[0]
    sigma = np.array(
        [
            NOISE.range_sigma(length, cosine)[0],
            np.hypot(NOISE.horizontal, across / np.sin(polar[0, 2])),
            np.hypot(NOISE.vertical, across),
        ]
    )
    local = xyz_from_polar(polar + z * sigma)
    steps = rng.multivariate_normal(np.zeros(6), where.covariance, n, method="cholesky")
    turned = rotation.exp(steps[:, 3:]) @ where.pose.rotation
    world = np.einsum("nij,nj->ni", turned, local) + where.pose.translation + steps[:, :3]
    c = covariances(x[None], where, np.array([cosine]))[0]
    matrix = c[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)
    error = world - (where.pose @ x)
    square = np.einsum("ni,ij,nj->n", error, np.linalg.inv(matrix), error).sum()
    assert chi2.ppf(0.0005, 3 * n) < square < chi2.ppf(0.9995, 3 * n)


def test_beam_of_seven_millimetres_at_twenty_metres() -> None:
    """AC-54: 4 mm and 0.3 mrad give 7.2 mm, 74 arcsec, 18.6 arcsec, 1.80 mm at 20 m."""
    length = np.array([20.0])
    assert NOISE.beam_diameter(length)[0] == pytest.approx(7.2e-3, abs=5e-5)
    assert NOISE.beam_diameter(length)[0] / 20 / SEC == pytest.approx(74, abs=0.5)
    assert NOISE.beam_angle(length)[0] / SEC == pytest.approx(18.6, abs=0.05)
    assert NOISE.beam_angle(length)[0] * 20 == pytest.approx(1.80e-3, abs=5e-6)


@given(st.floats(1e-6, 1.0))
def test_rounding_keeps_half_a_per_mille(value: float) -> None:
    exact = np.array([value], dtype=np.float32)
    assert rounded(exact)[0] == pytest.approx(exact[0], rel=2**-11)
    assert rounded(exact).view(np.uint32)[0] % 2**13 == 0


def test_no_origin_no_covariance() -> None:
    where = Placement("S", Pose.identity(), np.zeros((6, 6)), None)
    with pytest.raises(ValueError, match="without a scanner origin"):
        place_with_sigmas(np.ones((1, 3)), where)
