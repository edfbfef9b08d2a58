"""Shares of observation groups: they add up exactly, and each is what its errors alone do."""

import numpy as np
import pytest

from tests.network.facade import facade
from tests.network.networks import constrained_network, scanner_network
from tribrach.geometry import rotation
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.contributions import CATEGORIES, by_category, contributions
from tribrach.network.network import Datum
from tribrach.network.survey import Survey

NETWORKS = {
    "weighted control": lambda: facade().network(),
    "free": lambda: facade().network().with_datum(Datum("free")),
    "held": lambda: facade().network().with_datum(Datum("fixed", ("A", "B"))),
    "targets only": lambda: scanner_network(np.random.default_rng(3))[0].network(),
    "hard constraints": lambda: constrained_network().network(),
}


@pytest.mark.parametrize("name", NETWORKS)
def test_shares_add_up(name: str) -> None:
    adjustment = adjust(NETWORKS[name]())
    for station in adjustment.layout.names["pose"]:
        whole = adjustment.covariance(station)
        size = np.sqrt(np.maximum(np.diag(whole), 1e-30))
        parts = contributions(adjustment, station)
        total = np.sum([part.covariance for part in parts], axis=0)
        assert np.abs((total - whole) / size[:, None] / size).max() < 1e-7
        sums = by_category(parts)
        assert np.sum(list(sums.values()), axis=0) == pytest.approx(total, rel=1e-12, abs=1e-20)
        assert set(sums) <= set(CATEGORIES)
        for part in parts:
            assert np.linalg.eigvalsh(part.covariance).min() > -1e-12 * np.trace(whole)


def test_held_control_has_no_share() -> None:
    adjustment = adjust(NETWORKS["held"]())
    assert "control" not in by_category(contributions(adjustment, "S1"))
    weighted = by_category(contributions(adjust(facade().network()), "S1"))
    assert np.trace(weighted["control"][:3, :3]) > (0.001) ** 2


def test_control_alone_would_move_the_station_as_a_whole() -> None:
    """One control error common to all points is a shift: the share of a mean of three points."""
    adjustment = adjust(facade().network())
    share = by_category(contributions(adjustment, "S1"))["control"]
    # no arrangement of weights does better than the mean of all three control points
    assert (np.sqrt(np.diag(share)[:3]) > 0.002 / np.sqrt(3) * 0.999).all()


def errors(adjustment: Adjustment, truth: Survey, station: str) -> np.ndarray:
    """Error (6,) of a station: translation and left rotation increments."""
    state = adjustment.state
    k = state.layout.index("pose", station)
    true = truth.stations[station]
    turn = rotation.log((state.pose_r[k] @ true.rotation.T)[None])[0]
    return np.concatenate([state.pose_t[k] - true.translation, turn])


@pytest.mark.parametrize(
    ("part", "category"),
    [("control", "control"), ("level", "levelling"), ("distance", "total station")],
)
def test_errors_of_one_group_alone(part: str, category: str) -> None:
    """Adjusted anew with errors in one group only, the station scatters by its share."""
    trials = 80
    truth = facade()
    found = np.array(
        [errors(adjust(facade({part: 1.0}, seed).network()), truth, "S1") for seed in range(trials)]
    )
    parts = contributions(adjust(facade().network()), "S1")
    if part == "distance":
        share = next(p.covariance for p in parts if p.kind == "slope_distance")
        assert next(p for p in parts if p.kind == "slope_distance").category == category
    elif part == "level":
        share = np.sum([p.covariance for p in parts if p.kind == "inclination"], axis=0)
    else:
        share = by_category(parts)[category]
    sigma = np.sqrt(np.diag(share))
    ratio = np.sqrt((found**2).mean(axis=0)) / np.where(sigma > 0, sigma, 1.0)
    # components that the group hardly moves scatter with it all the same
    assert (np.abs(ratio - 1) < 4.5 / np.sqrt(2 * trials)).all(), ratio
