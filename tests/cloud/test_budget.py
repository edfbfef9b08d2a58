"""Error budgets of points: they add up to the covariance; Monte Carlo agrees with each part."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cloud.known_setup import KnownSetup
from tests.cloud.test_covariance import placement
from tests.network.facade import facade
from tribrach.cloud.budget import POINT_PARTS, SYSTEMATIC, point_budget
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.instruments.precision import pointing_sigma
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.adjustment import adjust
from tribrach.network.contributions import by_category, contributions
from tribrach.units import SEC

NOISE = ScanNoise(1.2e-3, 10e-6, 8 * SEC, 6 * SEC, 4e-3, 0.3e-3)
ROWS, COLUMNS = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]


def unit(v: np.ndarray) -> np.ndarray:
    out: np.ndarray = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return out


@settings(deadline=None)  # the loops are compiled in the first example
@given(seed=st.integers(0, 10_000))
def test_parts_add_up_to_the_stated_covariance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    where, xyz = placement(rng), rng.normal(0, 20, (20, 3))
    normals = unit(rng.normal(size=(20, 3)))
    normals[3] = np.nan
    budget = point_budget(xyz, where, normals=normals)
    raw = np.abs(np.einsum("ni,ni->n", unit(xyz), normals))
    cosine = np.where(np.isfinite(raw), np.clip(raw, 0.1, 1), 1.0)
    whole = covariances(xyz, where, cosine)
    assert budget.total[:, ROWS, COLUMNS] == pytest.approx(whole, rel=1e-8, abs=1e-13)
    assert np.isnan(budget.along_normal[:, 3]).all()
    both = budget.along_normal + budget.tangential
    assert both[:, :3] == pytest.approx(budget.variances[:, :3], rel=1e-12)


def test_systematic_angles_are_a_part_of_their_own() -> None:
    """They belong to the covariance of a point, and not to what is new with every point."""
    rng = np.random.default_rng(5)
    xyz, where = rng.normal(0, 20, (20, 3)), placement(rng)
    biased = replace(where, noise=replace(NOISE, systematic=12 * SEC))
    budget = point_budget(xyz, biased)
    assert budget.names[-1] == SYSTEMATIC
    whole = covariances(xyz, biased)
    assert budget.total[:, ROWS, COLUMNS] == pytest.approx(whole, rel=1e-8, abs=1e-13)
    more = np.trace(budget.covariances[-1], axis1=1, axis2=2)
    flat, length = np.hypot(xyz[:, 0], xyz[:, 1]), np.linalg.norm(xyz, axis=1)
    assert more == pytest.approx((12 * SEC) ** 2 * (flat**2 + length**2))
    assert biased.noise is not None
    assert biased.noise.random == where.noise


def test_a_law_of_the_intensity_is_the_range_and_leaves_nothing_to_incidence() -> None:
    rng = np.random.default_rng(6)
    xyz, law = rng.normal(0, 20, (20, 3)), RangeLaw(0.05, -0.5, 0.0005, 20.0, 2000.0)
    where = placement(rng, replace(NOISE, law=law))
    normals, light = unit(rng.normal(size=(20, 3))), rng.uniform(10, 3000, 20)
    light[:4] = np.nan
    budget = point_budget(xyz, where, normals=normals, intensity=light)
    raw = np.abs(np.einsum("ni,ni->n", unit(xyz), normals))
    whole = covariances(xyz, where, np.clip(raw, 0.1, 1), light)
    assert budget.total[:, ROWS, COLUMNS] == pytest.approx(whole, rel=1e-8, abs=1e-13)
    along = budget.variances[budget.names.index("range")]
    assert along[4:] == pytest.approx(law.sigma(light[4:]) ** 2)
    slanted = budget.variances[budget.names.index("incidence")]
    assert (slanted[:4] > 0).all()
    assert slanted[4:] == pytest.approx(0, abs=1e-18)


def test_without_normals_incidence_adds_nothing() -> None:
    rng = np.random.default_rng(2)
    where, xyz = placement(rng), rng.normal(0, 20, (20, 3))
    budget = point_budget(xyz, where)
    assert not budget.covariances[budget.names.index("incidence")].any()
    assert budget.total[:, ROWS, COLUMNS] == pytest.approx(covariances(xyz, where), rel=1e-8)


def test_budget_of_an_adjusted_station_adds_up() -> None:
    adjustment = adjust(facade().network())
    pose = Pose(adjustment.state.pose_r[0], adjustment.state.pose_t[0])
    where = Placement("S1", pose, adjustment.covariance("S1"), NOISE)
    shares = by_category(contributions(adjustment, "S1"))
    xyz = np.random.default_rng(1).normal(0, 20, (30, 3))
    budget = point_budget(xyz, where, shares)
    assert budget.names == (*shares, *POINT_PARTS)
    whole = covariances(xyz, where)
    assert budget.total[:, ROWS, COLUMNS] == pytest.approx(whole, rel=1e-6, abs=1e-12)
    with pytest.raises(ValueError, match="do not add up"):
        point_budget(xyz, where, {"control": shares["control"]})


def test_sum_and_parts_against_monte_carlo() -> None:
    """A wall at 20 m hit at 50 degrees, errors drawn where they arise, in angles and ranges."""
    trials = 200_000
    rng = np.random.default_rng(7)
    setup = KnownSetup(np.diag([2e-3, 1e-3, 1.5e-3]) ** 2, 1.5e-3, 5e-4, 1e-3, 20 * SEC, 35.0, 1.3)
    pose = Pose(rotation.exp(np.array([0.0, 0.0, 0.7])), np.array([100.0, 200.0, 10.0]))
    where = Placement("S", pose, setup.covariance, NOISE)
    h, v, rho = 0.3, 1.35, 20.0
    x = rho * np.array([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)])
    side = unit(np.cross(x, [0, 0, 1.0]))
    incidence = np.radians(50.0)
    normal = -np.cos(incidence) * unit(x) + np.sin(incidence) * side
    budget = point_budget(x[None], where, setup.shares, normal[None])
    draws = {
        name: rng.multivariate_normal(np.zeros(6), share, trials)
        for name, share in setup.shares.items()
    }
    spread = float(NOISE.range_sigma(np.array([rho]))[0])
    spot = float(NOISE.beam_angle(np.array([rho]))[0])
    d_rho = spread * rng.normal(size=trials)
    d_tilt = spread * np.tan(incidence) * rng.normal(size=trials)
    d_h, d_v = NOISE.horizontal * rng.normal(size=trials), NOISE.vertical * rng.normal(size=trials)
    s_h, s_v = (spot * rng.normal(size=trials) for _ in range(2))

    def points(r: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        flat = np.sin(b)
        return np.stack([r * flat * np.cos(a), r * flat * np.sin(a), r * np.cos(b)], axis=1)

    o = np.zeros(trials)
    own = points(rho + d_rho + d_tilt, h + d_h + s_h / np.sin(v), v + d_v + s_v)
    moves = np.sum(list(draws.values()), axis=0)
    turned = rotation.exp(moves[:, 3:]) @ pose.rotation
    world = np.einsum("nij,nj->ni", turned, own) + pose.translation + moves[:, :3]
    sample = np.cov((world - pose @ x[None]).T)
    assert sample == pytest.approx(budget.total[0], rel=0.03, abs=5e-8)
    along = world @ budget.normals[0]
    assert along.var() == pytest.approx(budget.along_normal.sum(), rel=0.015)
    alone = {
        "range": points(rho + d_rho, h + o, v + o),
        "incidence": points(rho + d_tilt, h + o, v + o),
        "horizontal angle": points(rho + o, h + d_h, v + o),
        "vertical angle": points(rho + o, h + o, v + d_v),
        "beam width": points(rho + o, h + s_h / np.sin(v), v + s_v),
    }
    for name, cloud in alone.items():
        k = budget.names.index(name)
        assert np.trace(np.cov(cloud.T)) == pytest.approx(budget.variances[k, 0], rel=0.02), name


def test_what_a_surface_sees() -> None:
    """``cos^2 I s_rho^2 + sin^2 I rho^2 (s_ang^2 + s_b^2)`` along the normal (section 5.2)."""
    angle = 8 * SEC
    noise = ScanNoise(2e-3, 0.0, angle, angle, 4e-3, 0.3e-3)
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), noise)
    for degrees in (0.0, 30.0, 60.0):
        i = np.radians(degrees)
        normal = np.array([[-np.cos(i), np.sin(i), 0.0]])
        budget = point_budget(np.array([[20.0, 0.0, 0.0]]), where, normals=normal)
        spot = float(noise.beam_angle(np.array([20.0]))[0])
        across = 400 * (angle**2 + spot**2)
        # the range is taken as s / cos I, so that its share along the normal stays as it is
        expected = 2e-3**2 + np.sin(i) ** 2 * across
        assert budget.along_normal.sum() == pytest.approx(expected, rel=1e-9)
        tangential = np.tan(i) ** 2 * 2e-3**2 + (1 + np.cos(i) ** 2) * across
        assert budget.tangential.sum() == pytest.approx(tangential, rel=1e-9)


def test_beam_of_the_scanner_at_20_m() -> None:
    """AC-54: 1.803 mm in each direction across a beam of 4 mm and 0.3 mrad."""
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), NOISE)
    budget = point_budget(np.array([[0.0, 20.0, 0.0]]), where)
    part = budget.covariances[budget.names.index("beam width"), 0]
    assert np.sqrt(np.diag(part)) * 1e3 == pytest.approx([1.803, 0.0, 1.803], abs=1e-3)


def test_no_noise_no_budget() -> None:
    where = Placement("S", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), None)
    with pytest.raises(ValueError, match="without a scanner origin"):
        point_budget(np.ones((1, 3)), where)


def test_the_zenith_point_and_the_origin_have_finite_budgets() -> None:
    where = placement(np.random.default_rng(1))
    budget = point_budget(np.array([[0.0, 0.0, 5.0], [0.0, 0.0, 0.0]]), where)
    assert np.isfinite(budget.covariances).all()
    whole = covariances(np.array([[0.0, 0.0, 5.0]]), where)
    assert budget.total[:1, ROWS, COLUMNS] == pytest.approx(whole, rel=1e-8, abs=1e-14)


def test_pointing_and_backsight() -> None:
    """AC-05 and AC-08: 60 arc seconds over a magnification of 30, 1.5 mm at both ends of 20 m."""
    assert pointing_sigma(30) / SEC == pytest.approx(2.0)
    assert pointing_sigma(30) * 20 * 1e3 == pytest.approx(0.1939, abs=5e-5)
    assert pointing_sigma(30, 4) == pytest.approx(pointing_sigma(30) / 2)
    setup = KnownSetup(np.zeros((3, 3)), 1.5e-3, 0.0, 0.0, 0.0, 20.0)
    assert setup.heading["backsight position"] / SEC == pytest.approx(21.88, abs=5e-3)
    assert setup.heading["backsight trunnion"] == 0.0
