"""Loops close as their covariances say; the pair that is wrong is named."""

from itertools import combinations

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.network.adjustment import adjust
from tribrach.registration.clouds.graph import CloudEdge, consistent, groups, loops, network_of

RNG = np.random.default_rng(3)
NAMES = ("A", "B", "C", "D")
TRUE = {n: Pose(exp(RNG.normal(0, 0.8, 3)), RNG.normal(0, 15, 3)) for n in NAMES}


def edge(a: str, b: str, rng: np.random.Generator, sigma: tuple[float, float]) -> CloudEdge:
    """A measured pose of b in a with a full covariance, errors drawn from it."""
    mix = rng.normal(0, 1, (6, 6)) * np.repeat(sigma, 3)[:, None]
    covariance = mix @ mix.T / 6 + np.diag(np.repeat(sigma, 3) ** 2)
    error = rng.multivariate_normal(np.zeros(6), covariance)
    true = TRUE[a].inverse @ TRUE[b]
    pose = Pose(true.rotation @ exp(error[3:]), true.translation + error[:3])
    return CloudEdge(a, b, pose, covariance)


def edges(pairs: list[tuple[str, str]], seed: int) -> list[CloudEdge]:
    rng = np.random.default_rng(seed)
    return [edge(a, b, rng, (2e-3, 1e-4)) for a, b in pairs]


@pytest.mark.parametrize(
    "pairs",
    [
        [("A", "B"), ("B", "C"), ("A", "C")],
        [("B", "A"), ("B", "C"), ("C", "A")],
        [("A", "B"), ("C", "B"), ("C", "D"), ("A", "D")],
    ],
)
def test_closures_are_as_large_as_predicted(pairs: list[tuple[str, str]]) -> None:
    """Monte Carlo: the tests of 300 loops sum up to chi-square, whatever way edges point (99 %)."""
    total = 0.0
    for seed in range(300):
        (loop,) = loops(edges(pairs, seed))
        total += loop.statistic
    low, high = chi2.ppf([0.005, 0.995], 6 * 300)
    assert low < total < high


def test_the_wrong_pair_is_named_and_left_out() -> None:
    every = edges(list(combinations(NAMES, 2)), 7)
    bad = next(e for e in every if e.ends == {"B", "D"})
    moved = Pose(bad.pose.rotation, bad.pose.translation + np.array([0.0, 0.05, 0.0]))
    wrong = CloudEdge("B", "D", moved, bad.covariance)
    found = consistent([wrong if e is bad else e for e in every])
    assert found.dropped == (wrong,)
    assert len(found.loops) == 4
    assert "B - D is not used" in found.sentences[0]


def test_of_one_open_loop_nothing_tells_which_pair_is_wrong() -> None:
    every = edges([("A", "B"), ("B", "C"), ("A", "C")], 8)
    moved = Pose(every[0].pose.rotation, every[0].pose.translation + 1.0)
    found = consistent([CloudEdge("A", "B", moved, every[0].covariance), *every[1:]])
    assert found.used == ()
    assert "are not used" in found.sentences[0]


def test_good_pairs_all_stay_and_are_adjusted() -> None:
    found = consistent(edges(list(combinations(NAMES, 2)), 9))
    assert found.dropped == ()
    adjustment = adjust(network_of(NAMES, found.used))
    assert adjustment.dof == 6 * 6 - 3 * 6
    state, layout = adjustment.state, adjustment.layout
    for name in NAMES[1:]:
        k = layout.index("pose", name)
        true = TRUE["A"].inverse @ TRUE[name]
        assert np.linalg.norm(state.pose_t[k] - true.translation) < 0.02
    assert adjustment.vtpv < chi2.ppf(0.999, adjustment.dof)


def test_stations_without_pairs_are_groups_of_their_own() -> None:
    every = edges([("A", "C"), ("C", "D")], 10)
    assert groups(NAMES, every) == [("A", "C", "D"), ("B",)]
