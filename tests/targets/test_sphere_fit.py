import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.errors import InputError
from tribrach.geometry.polar import xyz_from_polar
from tribrach.targets.spheres.fit import GATES, fit_sphere, fit_sphere_orthogonal

R = 0.115
ARCSECOND = np.pi / 648000


def cap(center, radius, pitch, psi=np.pi / 2):
    """Exact points on the near side of a sphere, on a grid of directions, and their H, V."""
    center = np.asarray(center, dtype=float)
    c = np.linalg.norm(center)
    h0, v0 = np.arctan2(center[1], center[0]), np.arccos(center[2] / c)
    grid = np.arange(-1.1 * radius / c, 1.1 * radius / c, pitch)
    h, v = (g.ravel() for g in np.meshgrid(h0 + grid / np.sin(v0) + 0.3 * pitch, v0 + grid))
    d = xyz_from_polar(np.stack([np.ones_like(h), h, v], axis=1))
    b = d @ center
    square = radius**2 - c**2 + b**2
    hit = square > (radius * np.cos(psi)) ** 2
    return np.stack([b[hit] - np.sqrt(square[hit]), h[hit], v[hit]], axis=1)


def measured(polar, rng, sigma_range, sigma_angle=0.0):
    """Points (n, 3) with noise along and across the line of sight."""
    noise = rng.normal(size=polar.shape) * [sigma_range, sigma_angle, sigma_angle]
    noise[:, 1] /= np.sin(polar[:, 2])
    return xyz_from_polar(polar + noise)


def test_exact_points_give_the_exact_sphere():
    center = np.array([7.0, -4.0, 2.0])
    xyz = xyz_from_polar(cap(center, R, 1e-3))
    for free in (False, True):
        fit = fit_sphere(
            xyz,
            center + 0.03,
            R * (1.2 if free else 1),
            sigma_range=1e-3,
            sigma_angle=0,
            free_radius=free,
        )
        np.testing.assert_allclose(fit.center, center, atol=1e-8)
        assert fit.radius == pytest.approx(R, abs=1e-8)
        assert fit.rms < 1e-8


@pytest.mark.parametrize("free", [False, True])
def test_stated_covariance_is_that_of_the_errors(free):
    """Chi-square of 300 simulated spheres with noise in range and angles."""
    rng = np.random.default_rng(5)
    center, sigma_range, sigma_angle = np.array([5.0, 8.0, -1.5]), 1.5e-3, 15 * ARCSECOND
    polar = cap(center, R, 8e-4)
    distances = []
    for _ in range(300):
        fit = fit_sphere(
            measured(polar, rng, sigma_range, sigma_angle),
            center + rng.normal(0, 0.01, 3),
            R,
            sigma_range=sigma_range,
            sigma_angle=sigma_angle,
            free_radius=free,
        )
        e = fit.center - center
        distances.append(e @ np.linalg.solve(fit.formal, e))
    low, high = chi2.ppf([0.001, 0.999], 900)
    assert low < np.sum(distances) < high


def test_depth_bias_under_range_noise():
    """AC-44: 4 mm and 2 mm noise, R = 115 mm at 10 m, radius unknown."""
    rng = np.random.default_rng(4)
    center = np.array([10.0, 0.0, 0.0])
    polar = cap(center, R, 6.3e-4, GATES.mask_rad)
    los, orthogonal, formal = [], [], []
    for _ in range(400):
        xyz = measured(polar, rng, 2e-3)
        fit = fit_sphere(
            xyz, center, R, sigma_range=2e-3, sigma_angle=0, free_radius=True, mask=GATES.mask_rad
        )
        los.append(fit.center[0] - 10)
        formal.append(fit.formal[0, 0])
        orthogonal.append(
            fit_sphere_orthogonal(xyz, center, R, sigma=2e-3, free_radius=True).center[0] - 10
        )
    assert abs(np.mean(los)) < 1e-4
    assert np.mean(orthogonal) == pytest.approx(-0.43e-3, abs=0.12e-3)
    assert np.std(los) == pytest.approx(np.sqrt(np.mean(formal)), rel=0.12)


def test_known_radius_has_no_depth_bias():
    rng = np.random.default_rng(6)
    center = np.array([10.0, 0.0, 0.0])
    polar = cap(center, R, 6.3e-4)
    depths = [
        fit_sphere(measured(polar, rng, 4e-3), center, R, sigma_range=4e-3, sigma_angle=0).center[0]
        for _ in range(200)
    ]
    assert abs(np.mean(depths) - 10) < 1e-4


@pytest.mark.parametrize("psi", [np.pi / 2 - 1e-3, np.radians(60), np.radians(45)])
@pytest.mark.parametrize("free", [False, True])
def test_closed_form_of_a_uniform_cap(psi, free):
    """AC-43: lateral, depth and radius sigma of a cap, isotropic noise, Monte Carlo."""
    rng = np.random.default_rng(7)
    n, s, q = 2000, 1e-5, np.sin(psi)
    e1, e2 = 2 * (1 - (1 - q**2) ** 1.5) / (3 * q**2), 1 - q**2 / 2
    vr = e2 - e1**2
    errors = []
    for _ in range(200):
        rho, phi = q * np.sqrt(rng.uniform(size=n)), rng.uniform(0, 2 * np.pi, n)
        normal = np.stack([-np.sqrt(1 - rho**2), rho * np.cos(phi), rho * np.sin(phi)], axis=1)
        xyz = R * normal + rng.normal(0, s, (n, 3)) + [10, 0, 0]
        fit = fit_sphere_orthogonal(xyz, np.array([10.0, 0, 0]), R, sigma=s, free_radius=free)
        errors.append([*(fit.center - [10, 0, 0]), fit.radius - R])
    sd = np.std(errors, axis=0)
    root = s / np.sqrt(n)
    depth = root / np.sqrt(vr if free else e2)
    np.testing.assert_allclose(sd[:3], [depth, 2 * root / q, 2 * root / q], rtol=0.2)
    if free:
        assert sd[3] == pytest.approx(root * np.sqrt(e2 / vr), rel=0.2)


def test_closed_form_numbers():
    """AC-43: 2, sqrt 2, sqrt 18, 3 for the full half sphere."""
    e1, e2 = 2 / 3, 1 / 2
    vr = e2 - e1**2
    np.testing.assert_allclose(
        [2, 1 / np.sqrt(e2), 1 / np.sqrt(vr), np.sqrt(e2 / vr)], [2, np.sqrt(2), np.sqrt(18), 3]
    )


def test_mount_and_mixed_pixels_are_trimmed():
    rng = np.random.default_rng(8)
    center = np.array([6.0, 3.0, 0.5])
    polar = cap(center, R, 8e-4)
    edge = polar.copy()[::3]
    edge[:, 0] += rng.uniform(0.02, 0.15, len(edge))
    xyz = measured(np.concatenate([polar, edge]), rng, 1e-3)
    fit = fit_sphere(xyz, center + 0.02, R, sigma_range=1e-3, sigma_angle=0)
    assert np.linalg.norm(fit.center - center) < 4e-4
    assert not fit.inliers[len(polar) :].any()


def test_bad_input_is_refused():
    xyz = xyz_from_polar(cap([10, 0, 0], R, 4e-3))
    with pytest.raises(InputError, match="30 are needed"):
        fit_sphere(xyz[:20], np.array([10.0, 0, 0]), R, sigma_range=1e-3, sigma_angle=0)
    with pytest.raises(InputError, match="inside"):
        fit_sphere(xyz, np.zeros(3), R, sigma_range=1e-3, sigma_angle=0)
    fit = fit_sphere(
        xyz_from_polar(cap([10, 0, 0], R, 2.2e-3)),
        np.array([10.0, 0, 0]),
        R,
        sigma_range=1e-3,
        sigma_angle=0,
    )
    assert any("points determine" in s for s in fit.sentences)


@pytest.mark.parametrize("seed", range(40))
def test_clutter_ends_in_a_fit_or_a_sentence(seed):
    rng = np.random.default_rng(seed)
    start = np.array([6.0, 1.0, 0.3])
    spread = rng.uniform(0.02, 0.3, 3)
    xyz = start + rng.normal(size=(int(rng.integers(30, 300)), 3)) * spread
    try:
        fit = fit_sphere(
            xyz, start, R, sigma_range=6e-3, sigma_angle=2e-5, free_radius=seed % 2 == 0
        )
    except InputError:
        return
    assert np.isfinite(fit.center).all()
    assert fit.inliers.sum() >= 30
