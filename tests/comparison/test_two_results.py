"""Two results that were given the same control: what it is wrong by counts once."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.network.facade import CONTROL, SIGMA, STATIONS, facade
from tribrach.cloud.shared_part import SharedPart
from tribrach.comparison.station_pair import StationPair, joint_covariance
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.given_values import common_values, given_rows, through_given, with_given
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.control import Coordinates, Heights
from tribrach.observations.levelling import HeightDifferences

Array = np.ndarray
EVERYTHING = dict.fromkeys(SIGMA, 1.0)


def levelled(sigma: float, control: dict[str, float]) -> Adjustment:
    """A height P from given heights, each with a line of levelling of one sigma."""
    survey = Survey()
    for name in (*control, "P"):
        survey.point(name, (0.0, 0.0, 10.0))
    survey.add(
        Heights,
        values=[10.0] * len(control),
        sigma=list(control.values()),
        position=list(control),
        group="control",
    )
    lines = {"start": list(control), "end": ["P"] * len(control)}
    survey.add(HeightDifferences, values=[0.0] * len(control), sigma=sigma, **lines)
    return adjust(observed_part(survey).network())


def through(one: Adjustment, two: Adjustment) -> float:
    """Covariance of P in both."""
    sides = []
    for found in (one, two):
        given = given_rows(found)
        rows = np.array(list(given.values()))
        number = found.layout.index("point", "P")
        columns = found.layout.columns("point", [number]).ravel()[2:]
        sides.append((list(given), *with_given(found, rows, columns)))
    (a, cross_a, cov_a), (b, cross_b, cov_b) = sides
    i, j = common_values(a, cov_a, b, cov_b)
    return through_given(cross_a[:, i], cross_b[:, j], cov_a[np.ix_(i, i)]).item()


def test_a_height_from_two_benchmarks_in_closed_form() -> None:
    """P is the weighted mean of both ways; each epoch has weights of its own."""
    heights = {"A": 0.002, "B": 0.003}
    shares = []
    for sigma in (0.001, 0.004):
        weight = np.array([1 / (s**2 + sigma**2) for s in heights.values()])
        shares.append(weight / weight.sum())
    expected = sum(s**2 * shares[0][k] * shares[1][k] for k, s in enumerate(heights.values()))
    one, two = levelled(0.001, heights), levelled(0.004, heights)
    assert through(one, two) == pytest.approx(expected, rel=1e-9)
    # a benchmark that only one epoch uses is nothing that they share
    assert through(levelled(0.001, heights), levelled(0.004, {"A": 0.002})) == pytest.approx(
        0.002**2 * shares[0][0], rel=1e-9
    )
    # the same height with another sigma is other information
    assert through(one, levelled(0.004, {"A": 0.005, "B": 0.003})) == pytest.approx(
        0.003**2 * shares[0][1] * (1 / (0.003**2 + 0.004**2))
        / (1 / (0.005**2 + 0.004**2) + 1 / (0.003**2 + 0.004**2)),
        rel=1e-9,
    )  # fmt: skip


def test_given_values_with_correlations_keep_the_joint_covariance_one() -> None:
    """Given values of one result alone reach the other through what they share with it."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(5, 5))
    covariance = root @ root.T
    gains = rng.normal(size=(2, 3, 4))
    # the first result was given values 0 to 3, the second 1 to 4
    parts = [covariance[:4, :4], covariance[1:, 1:]]
    crosses = [g @ c for g, c in zip(gains, parts, strict=True)]
    i, j = common_values("abcd", parts[0], "bcde", parts[1])
    assert (list(i), list(j)) == ([1, 2, 3], [0, 1, 2])
    mixed = through_given(crosses[0][:, i], crosses[1][:, j], parts[0][np.ix_(i, i)])
    whole = [g @ c @ g.T for g, c in zip(gains, parts, strict=True)]
    joint = np.block([[whole[0], mixed], [mixed.T, whole[1]]])
    assert np.linalg.eigvalsh(joint)[0] > 0
    # what is exactly known of both is their difference through the shared values alone
    known = gains[0] @ covariance[:4, 1:4] @ np.linalg.solve(
        covariance[1:4, 1:4], covariance[1:4, 1:]
    ) @ gains[1].T  # fmt: skip
    assert mixed == pytest.approx(known, rel=1e-9)
    assert common_values("ab", np.eye(2), "ab", np.array([[1, 0.5], [0.5, 1]]))[0].size == 0


def campaign(control: Array, seed: int) -> tuple[Adjustment, SharedPart]:
    """A survey of the facade from given control with these errors (3, 3)."""
    network = facade(EVERYTHING | {"control": 0.0}, seed).network()
    for o in network.observations:
        if isinstance(o, Coordinates):
            o.values += control
    found = adjust(network)
    return found, SharedPart.of_adjustment(found)


#: middles of patches of the facade, and their normal
PATCHES = np.array([[4.0, 31, 6], [20, 31, 12], [42, 31, 8]])
NORMAL = np.array([0.0, -1.0, 0.0])


def placed(found: Adjustment, name: str) -> Array:
    """The patches (3, 3) where a station puts them that measured them without any error."""
    place, heading = STATIONS[name]
    truth = Pose(exp(np.array([0.0, 0.0, heading])), np.array(place))
    k = found.state.layout.index("pose", name)
    return Pose(found.state.pose_r[k], found.state.pose_t[k]) @ (truth.inverse @ PATCHES)


def test_differences_of_campaigns_scatter_as_stated() -> None:
    """Distances of three patches between two campaigns, against chi-square; 1 in 1,000 fails."""
    rng = np.random.default_rng(11)
    pairs, rows, sums = 60, np.tile(NORMAL, (3, 1)), {"once": 0.0, "twice": 0.0}
    for k in range(pairs):
        control = SIGMA["control"] * rng.normal(size=(3, 3))
        one, two = (campaign(control, 1000 * j + k) for j in (1, 2))
        off = (placed(two[0], "S2") - placed(one[0], "S1")) @ NORMAL
        pair = StationPair.of_results(one[1], "S1", two[1], "S2")
        assert len(pair.alike) == 9
        apart = StationPair.of_results(replace(one[1], given=None), "S1", two[1], "S2")
        assert apart.alike == ()
        for name, stations in (("once", pair), ("twice", apart)):
            by = np.einsum("mi,mij->mj", rows, stations.displacements(PATCHES))
            sums[name] += float(off @ np.linalg.solve(by @ stations.covariance @ by.T, off))
    assert stats.chi2.ppf(0.0005, 3 * pairs) < sums["once"] < stats.chi2.ppf(0.9995, 3 * pairs)
    # taken as independent, control counts twice: differences would be much smaller than stated
    assert sums["twice"] < stats.chi2.ppf(0.0005, 3 * pairs)


def test_control_that_is_another_is_not_shared() -> None:
    errors = np.zeros((2, 3, 3))
    errors[1, 0] = 0.001
    one, two = (campaign(errors[k], 5 + k)[1] for k in (0, 1))
    joint, alike = joint_covariance(one, two)
    # two points of three are the same
    assert len(alike) == 6
    assert not any(f":{next(iter(CONTROL))}:" in key for key in alike)
    assert np.abs(joint[:12, 12:]).max() > 0
    values = np.linalg.eigvalsh(joint)
    assert values[0] > -1e-9 * values[-1]
