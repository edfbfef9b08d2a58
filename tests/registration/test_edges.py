"""Pairs of stations against the network: chi-square where all is well, named where it is not."""

from itertools import combinations

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from tribrach.geometry import rotation
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.planes import FittedPlanes
from tribrach.observations.poses import RelativePoses
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.unknowns import plane_basis
from tribrach.registration.edges import edges

NORMALS = np.array(
    [[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0.6, 0.0, 0.8]], dtype=float
)
OFFSETS = np.array([-1.6, -15.0, -12.0, -14.0, -11.0, -9.0])
PLACES = np.array([[0, 0, 0], [5, 1, 0.1], [-4, 3, -0.1], [2, -6, 0.0]], dtype=float)
TILT, OFFSET, TARGET = 1e-4, 4e-4, 8e-4


def survey(rng, *, wrong_plane=0.0, wrong_cloud=0.0, planes=6, targets=True, clouds=False):
    """Four stations, six planes and six targets, errors as stated; a blunder at S3 if asked."""
    out = Survey(datum=Datum("free"))
    turn = rotation.exp(np.stack([np.zeros(4), np.zeros(4), [0.1, 1.0, -2.0, 2.5]], axis=1))
    for k in range(4):
        out.station(f"S{k}", translation=PLACES[k], rotation=turn[k])
    for k in range(planes):
        out.planes[f"plane {k}"] = (NORMALS[k], OFFSETS[k])
    _planes(out, rng, turn, planes, wrong_plane)
    points = rng.uniform(-10, 10, (6, 3))
    for k in range(4 if targets else 0):
        seen = (points - PLACES[k]) @ turn[k] + rng.normal(0, TARGET, (6, 3))
        out.add(
            TargetCentres,
            values=seen,
            sigma=np.full((6, 3), TARGET),
            station=[f"S{k}"] * 6,
            target=[f"T{i}" for i in range(6)],
        )
    if clouds:
        _clouds(out, rng, turn, wrong_cloud)
    return out


def _planes(out, rng, turn, planes, wrong):
    """Every station fits every plane around the foot of its perpendicular."""
    for k in range(4):
        n = NORMALS[:planes] @ turn[k]
        d = OFFSETS[:planes] - NORMALS[:planes] @ PLACES[k]
        center = n * d[:, None]
        tilt = np.einsum("nij,nj->ni", plane_basis(n), rng.normal(0, TILT, (planes, 2)))
        away = rng.normal(0, OFFSET, planes)
        if k == 3:
            away[1] += wrong
        measured = (n + tilt) / np.linalg.norm(n + tilt, axis=1, keepdims=True)
        out.add(
            FittedPlanes,
            values=np.zeros((planes, 3)),
            sigma=np.tile([TILT, TILT, OFFSET], (planes, 1)),
            station=[f"S{k}"] * planes,
            plane=[f"plane {i}" for i in range(planes)],
            normal=measured,
            centroid=center + away[:, None] * n,
        )


def _clouds(out, rng, turn, wrong):
    for a, b in combinations(range(4), 2):
        noise = rng.normal(0, 1, 6) * [1e-3, 1e-3, 1e-3, 5e-5, 5e-5, 5e-5]
        shift = (
            turn[a].T @ (PLACES[b] - PLACES[a]) + noise[:3] + [wrong * (b == 3 and a == 1), 0, 0]
        )
        out.add(
            RelativePoses,
            values=[[*shift, 0, 0, 0]],
            sigma=[[1e-3, 1e-3, 1e-3, 5e-5, 5e-5, 5e-5]],
            start=[f"S{a}"],
            end=[f"S{b}"],
            rotation=(turn[a].T @ turn[b] @ rotation.exp(noise[3:]))[None],
        )


def test_statistics_are_chi_square():
    """Every pair and kind over simulated surveys, each with its own degrees of freedom."""
    rng = np.random.default_rng(1)
    probabilities, largest = [], 0
    for _ in range(12):
        found = edges(adjust(survey(rng, clouds=True).network()))
        assert len(found) == 18
        chosen = found[int(rng.integers(18))]
        probabilities.append(chi2.cdf(chosen.statistic, chosen.freedom))
        largest += sum(e.outlying for e in found)
    assert kstest(probabilities, "uniform").pvalue > 0.01
    assert largest <= 3


@pytest.mark.slow
def test_statistics_are_chi_square_in_all_kinds():
    rng = np.random.default_rng(2)
    drawn = {"plane": [], "target_centre": [], "relative_pose": []}
    for _ in range(300):
        for kind, values in drawn.items():
            mine = [e for e in edges(adjust(survey(rng, clouds=True).network())) if e.kind == kind]
            chosen = mine[int(rng.integers(len(mine)))]
            values.append(chi2.cdf(chosen.statistic, chosen.freedom))
    for values in drawn.values():
        assert kstest(values, "uniform").pvalue > 0.005


def test_predicted_differences_are_those_that_are_observed():
    rng = np.random.default_rng(3)
    shift = np.zeros((20, 2))
    for k in range(20):
        found = edges(adjust(survey(rng).network()))
        edge = next(e for e in found if (e.first, e.second, e.kind) == ("S0", "S1", "plane"))
        shift[k] = edge.shift, edge.shift_sigma
    assert np.sqrt(np.mean(shift[:, 0] ** 2)) == pytest.approx(shift[:, 1].mean(), rel=0.35)


def test_a_wrong_plane_is_found_at_the_pairs_of_its_station():
    found = edges(adjust(survey(np.random.default_rng(4), wrong_plane=0.02).network()))
    bad = [e for e in found if e.outlying]
    assert bad
    worst = max(bad, key=lambda e: e.ratio)
    assert "S3" in (worst.first, worst.second)


def test_a_wrong_registration_of_clouds_is_the_worst_edge():
    found = edges(adjust(survey(np.random.default_rng(5), clouds=True, wrong_cloud=0.02).network()))
    worst = max(found, key=lambda e: e.ratio)
    assert (worst.first, worst.second, worst.kind) == ("S1", "S3", "relative_pose")
    assert worst.outlying
    assert worst.shift == pytest.approx(0.02, abs=0.004)


def test_a_pair_that_leaves_directions_open_is_tested_in_the_others():
    found = edges(adjust(survey(np.random.default_rng(6), planes=2).network()))
    planes = [e for e in found if e.kind == "plane"]
    assert {e.held for e in planes} == {5}
    assert all(e.freedom <= 5 and np.isfinite(e.statistic) for e in planes)
    assert {e.held for e in found if e.kind == "target_centre"} == {6}


def test_what_nothing_controls_is_not_judged():
    two = Survey(datum=Datum("free"))
    turn = np.eye(3)
    for k in range(2):
        two.station(f"S{k}", translation=PLACES[k], rotation=turn)
    two.add(
        RelativePoses,
        values=[[5.0, 1.0, 0.1, 0, 0, 0]],
        sigma=[[1e-3] * 6],
        start=["S0"],
        end=["S1"],
        rotation=[turn],
    )
    (edge,) = edges(adjust(two.network()))
    assert edge.statistic is None
    assert edge.ratio is None
    assert not edge.outlying


@pytest.mark.parametrize("held", ["S0", "S3"])
def test_pairs_with_the_station_that_holds_the_frame_are_tested_like_others(held):
    """Of every pair the tests of 60 networks sum up to chi-square (99.9 %), held station or not."""
    sigma = np.repeat([1e-3, 5e-5], 3)
    turn = rotation.exp(np.stack([np.zeros(4), np.zeros(4), [0.1, 1.0, -2.0, 2.5]], axis=1))
    total = dict.fromkeys(combinations(range(4), 2), 0.0)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        out = Survey()
        for k in range(4):
            name, free = f"S{k}", np.full(6, f"S{k}" != held)
            out.station(name, translation=PLACES[k], rotation=turn[k], free=free)
        for a, b in total:
            off = rng.normal(0, sigma)
            shift = turn[a].T @ (PLACES[b] - PLACES[a]) + off[:3]
            out.add(
                RelativePoses,
                values=[[*shift, 0.0, 0.0, 0.0]],
                covariance=np.diag(sigma**2)[None],
                rotation=(turn[a].T @ turn[b] @ rotation.exp(off[3:]))[None],
                start=[f"S{a}"],
                end=[f"S{b}"],
            )
        found = edges(adjust(out.network()))
        assert [(e.first, e.second, e.freedom) for e in found] == [
            (f"S{a}", f"S{b}", 6) for a, b in total
        ]
        for e, key in zip(found, total, strict=True):
            total[key] += e.statistic
    low, high = chi2.ppf([0.0005, 0.9995], 6 * 60)
    assert all(low < value < high for value in total.values()), total
