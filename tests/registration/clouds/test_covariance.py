"""The covariance of a fit against the scatter of fits, and what the clouds show of it."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.clouds.scenes import scanned, yard
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, log
from tribrach.observations.poses import RelativePoses
from tribrach.observations.unknowns import Layout, State
from tribrach.registration.clouds.fine import Matches, align
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.relative_covariance import Shared, relative_covariance
from tribrach.registration.clouds.together import differences
from tribrach.simulate.twins import sphere_courtyard

NO_FLOOR = (0.0, 0.0)
START = Pose(exp(np.array([1e-3, -5e-4, 2e-3])), np.array([0.03, -0.02, 0.01]))


def off(found: Pose, true: Pose, middle: np.ndarray) -> np.ndarray:
    """Error (6,): shift of the middle and turn about it, frame of a."""
    moved = found @ (true.inverse @ middle) - middle
    return np.concatenate([moved, log(found.rotation @ true.rotation.T)])


def normalised(a: PreparedScan, b: PreparedScan, true: Pose) -> float:
    """Squared error over its covariance; six on the average."""
    found = align(a.fine, b.fine, START @ true)
    precision = relative_covariance(a.fine, b.fine, found, NO_FLOOR)
    assert precision.rank == 6
    error = off(found.pose, true, precision.middle)
    return float(error @ np.linalg.solve(precision.local, error))


def test_errors_are_as_large_as_their_covariance_says() -> None:
    """Three draws of noise and attitude: chi-square with 18 degrees of freedom (99 %)."""
    total = 0.0
    for seed in range(1, 4):
        places = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5))
        scans, poses = scanned(yard(), places, points=100_000, seed=seed)
        total += normalised(scans[0], scans[1], poses[0].inverse @ poses[1])
    low, high = chi2.ppf([0.005, 0.995], 18)
    assert low < total < high


def test_a_poor_fit_has_a_covariance_all_the_same() -> None:
    """Residuals that fill the gate, of a pose that is far from the right one."""
    scans, poses = scanned(yard(), ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5)))
    a, b = (s.fine for s in scans)
    true = poses[0].inverse @ poses[1]
    wrong = Pose(true.rotation, true.translation + np.array([0.0, 0.6, 0.3]))
    found = align(a, b, wrong, (0.2,), steps=0)
    precision = relative_covariance(a, b, found, NO_FLOOR)
    assert (np.linalg.eigvalsh(precision.local) >= 0).all()
    assert np.isfinite(precision.covariance).all()


def test_the_floor_is_added() -> None:
    scans, poses = scanned(yard(), ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5)))
    a, b = (s.fine for s in scans)
    found = align(a, b, poses[0].inverse @ poses[1])
    bare = relative_covariance(a, b, found, NO_FLOOR)
    full = relative_covariance(a, b, found, (2e-3, 1e-4))
    added = np.diag(np.repeat([4e-6, 1e-8], 3))
    assert np.allclose(full.local - bare.local, added, atol=1e-15)
    assert bare.effective <= 0.5 * bare.observations


def test_covariance_is_in_the_order_of_the_observation() -> None:
    """Errors drawn from the local covariance, as residuals of the observation they become."""
    scans, poses = scanned(yard(), ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5)))
    a, b = (s.fine for s in scans)
    found = align(a, b, poses[0].inverse @ poses[1])
    p = relative_covariance(a, b, found, (1e-3, 1e-3))
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(6), p.local, 4000)
    pose, turns = found.pose, exp(draws[:, 3:])
    moved = np.einsum("nij,j->ni", turns, pose.translation - p.middle) + p.middle + draws[:, :3]
    n = len(draws)
    layout = Layout(poses=[f"P{k}" for k in range(n + 1)])
    state = State(
        layout,
        np.zeros((0, 3)),
        np.concatenate([np.zeros((1, 3)), moved]),
        np.concatenate([np.eye(3)[None], turns @ pose.rotation]),
        np.zeros((0, 3)),
        np.zeros(0),
        np.zeros((0, 3)),
        np.zeros(0),
    )
    observed = RelativePoses(
        values=np.tile([*pose.translation, 0, 0, 0], (n, 1)),
        covariance=np.tile(p.covariance, (n, 1, 1)),
        start=np.zeros(n, dtype=np.int64),
        end=np.arange(1, n + 1),
        rotation=np.tile(pose.rotation, (n, 1, 1)),
    )
    residual = observed.predict(state) - observed.values
    square = np.einsum("ni,ij,nj->n", residual, np.linalg.inv(p.covariance), residual)
    low, high = chi2.ppf([0.005, 0.995], 6 * n)
    assert low < square.sum() < high


def test_clouds_differ_as_predicted() -> None:
    """Observed differences of placed clouds against noise and registration, within 10 %."""
    scans, poses = scanned(yard(), ((-4.0, 3.0, 0.3), (1.0, -2.0, 2.5)), points=400_000)
    found = align(scans[0].fine, scans[1].fine, poses[0].inverse @ poses[1])
    precision = relative_covariance(scans[0].fine, scans[1].fine, found, NO_FLOOR)
    turn = np.eye(6)
    turn[3:, 3:] = found.pose.rotation
    one = differences(*scans, found.pose, turn @ precision.covariance @ turn.T)
    assert one is not None
    assert one.places > 100
    assert one.ratio == pytest.approx(1.0, abs=0.1)


def test_trunks_share_errors_over_their_height() -> None:
    # 40 trunks of 12 pieces hold the plan, a floor the height; each trunk has an error of its own
    rng = np.random.default_rng(5)
    ways = rng.uniform(0, 2 * np.pi, 40)
    foot = np.column_stack([rng.permuted(np.arange(40) * 2.0), rng.uniform(-20, 20, 40)])
    trunk = np.repeat(np.arange(40), 12)
    point = np.column_stack([foot[trunk], np.tile(np.arange(12) * 0.7, 40)])
    normal = np.column_stack([np.cos(ways), np.sin(ways), np.zeros(40)])[trunk]
    floor = np.column_stack([rng.uniform(-30, 30, (400, 2)), np.zeros(400)])
    point = np.concatenate([point, floor])
    normal = np.concatenate([normal, np.tile([0.0, 0.0, 1.0], (400, 1))])
    n, one = len(point), np.ones(len(point))
    count = np.arange(n)
    inverse = np.linalg.inv(normal.T @ normal)
    ratio, squares = [], []
    for _ in range(150):
        residual = rng.normal(0, 1.0, n)
        residual[:480] += rng.normal(0, 1.0, 40)[trunk]
        error = inverse @ normal.T @ residual
        left = residual - normal @ error
        m = Matches(count, count, one > 0, point, normal, left, one)
        stated = Shared.of(normal, one, left, normal.T @ normal, m).covariance
        ratio.append(np.diag(stated))
        squares.append(error @ np.linalg.solve(stated, error))
    held = (normal[:480].T @ normal[:480])[:2, :2]
    true = np.linalg.inv(held) * (1 + 12)
    mean = np.mean(ratio, axis=0)
    # the floor shares nothing: a factor for all would give it that of the trunks or them less
    assert mean[:2] == pytest.approx(np.diag(true), rel=0.35)
    assert 2 / 400 <= mean[2] < 13 / 400
    assert np.mean(squares) < 3 * chi2.ppf(0.999, 450) / 450


@pytest.mark.slow
def test_courtyard_by_clouds() -> None:
    """Five seeds of the twin, six whole stations each: errors chi-square, differences as said."""
    total, freedom, ratios = 0.0, 0, []
    for seed in range(1, 6):
        twin = sphere_courtyard.build(300_000, seed)
        scans, poses = [], []
        for k, one in enumerate(twin.scans):
            if one.name == one.station and one.station != "S6":
                scans.append(prepare(one.station, (block.xyz for block in twin.measure(k))))
                poses.append(twin.station(one.station).pose)
        for k in range(len(scans) - 1):
            true = poses[k].inverse @ poses[k + 1]
            total += normalised(scans[k], scans[k + 1], true)
            freedom += 6
            found = align(scans[k].fine, scans[k + 1].fine, true)
            p = relative_covariance(scans[k].fine, scans[k + 1].fine, found, NO_FLOOR)
            turn = np.eye(6)
            turn[3:, 3:] = found.pose.rotation
            one = differences(scans[k], scans[k + 1], found.pose, turn @ p.covariance @ turn.T)
            ratios.append(one.ratio if one is not None else np.nan)
    low, high = chi2.ppf([0.005, 0.995], freedom)
    assert low < total < high
    assert np.nanmean(ratios) == pytest.approx(1.0, abs=0.1)
