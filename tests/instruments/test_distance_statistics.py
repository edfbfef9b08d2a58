"""Distance statistics: the formulas of the standard term by term, and the rates of its limits."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm

from tests.instruments.field_surveys import STATIONS, TARGETS, readings
from tribrach.calibration.distance_statistics import DistanceStatistics, distance_statistics
from tribrach.calibration.field_series import check_series
from tribrach.calibration.known_lengths import KnownLengths, compare_lengths
from tribrach.calibration.scanner_readings import ScannerReadings, face_means, face_pairs
from tribrach.calibration.target_distances import compare_distances
from tribrach.calibration.two_face import two_face_test
from tribrach.geometry.polar import xyz_from_polar
from tribrach.units import SEC

THREE = ("1", "2", "3")
#: the yard of the other tests, and one with targets 36 to 60 m from the station between them
YARDS = {1: "short", 3: "long"}
#: half of what a collimation of 40" does to a horizontal reading at the horizon is x6
COLLIMATION = {"x6": 20 * SEC}


def yard(rng, factor=1, **options) -> ScannerReadings:
    """Readings of a full check of a yard, larger by a factor."""
    places = {name: factor * place for name, place in STATIONS.items()}
    given = {"series": THREE, "targets": factor * TARGETS, "stations": places, **options}
    return readings(rng, **given)


def known(factor=1, sigma=3e-4, rng=None) -> KnownLengths:
    """All distances between the targets with their sigma, and with errors if there is a rng."""
    pairs = tuple(combinations(range(4), 2))
    lengths = [factor * np.linalg.norm(TARGETS[i] - TARGETS[j]) for i, j in pairs]
    names = tuple((f"T{i}", f"T{j}") for i, j in pairs)
    error = 0.0 if rng is None else sigma * rng.normal(size=6)
    return KnownLengths(names, np.array(lengths) + error, sigma**2 * np.eye(6))


def statistics(given: ScannerReadings, alpha=0.05) -> DistanceStatistics:
    return distance_statistics(face_means(given), "inside", "outside", alpha)


def in_binomial_bounds(count: int, runs: int, rate: float, level=0.95) -> bool:
    low, high = binom.interval(level, runs, rate)
    return bool(low <= count <= high)


def test_the_full_procedure_term_by_term():
    """Differences, u and their limits as sums over targets, stations and series."""
    given = yard(np.random.default_rng(3), faces=(1.0,))
    found = statistics(given)
    xyz = xyz_from_polar(given.polar)
    place = {
        (station, one, target): xyz[k]
        for k, (station, one, target) in enumerate(
            zip(given.station, given.series, given.target, strict=True)
        )
    }
    omega = 0.0
    for k, (a, b) in enumerate(zip(found.differences.from_, found.differences.to, strict=True)):
        length = {
            station: [
                np.linalg.norm(place[station, one, b] - place[station, one, a]) for one in THREE
            ]
            for station in STATIONS
        }
        means = {station: np.mean(values) for station, values in length.items()}
        assert found.differences.difference[k] == pytest.approx(
            means["inside"] - means["outside"], abs=1e-12
        )
        middle = (means["inside"] + means["outside"]) / 2
        omega += sum((d - middle) ** 2 for values in length.values() for d in values)
    shown = found.repeated
    assert shown.dof == 30
    assert shown.u == pytest.approx(np.sqrt(omega / 30 / 2), rel=1e-10)
    assert shown.standard_limit == pytest.approx(found.u_stated * np.sqrt(chi2.ppf(0.95, 30) / 30))
    assert found.difference_limit == pytest.approx(norm.ppf(0.975) * 2 * found.u_stated / 3**0.5)
    assert (found.procedure, found.departures) == ("full", ())
    # weights of a sum of squares add up to what it is on average
    assert shown.dof_equivalent < 30


def test_the_simplified_procedure():
    found = statistics(yard(np.random.default_rng(3), series=("",)))
    assert found.procedure == "simplified"
    assert found.repeated is None
    assert found.difference_limit == pytest.approx(norm.ppf(0.975) * 2 * found.u_stated)


def test_other_numbers_are_no_procedure_of_the_standard():
    rng = np.random.default_rng(3)
    five = np.vstack([TARGETS, [[8.0, 8.0, -1.0]]])
    found = statistics(yard(rng, targets=five))
    assert found.procedure == ""
    assert found.departures == ("which has four targets; here there are 5",)
    assert statistics(yard(rng, series=("1", "2"))).departures == (
        "it has one series from either station or three, here are 2",
    )
    third = {**STATIONS, "third": np.array([0.0, 20.0, 0.0])}
    given = face_means(readings(rng, stations=third, series=THREE))
    found = distance_statistics(given, "inside", "third")
    assert found.departures == ("it has two stations, here are 3, taken in pairs",)
    # one series fewer from one of the stations
    fewer = given.take((given.station != "third") | (given.series != "3"))
    found = distance_statistics(fewer.take(fewer.station != "outside"), "inside", "third")
    assert found.scans == (3, 2)
    assert found.departures == ("it has one series from either station or three, here are 3 and 2",)
    assert found.repeated.dof == 6 * 4


def test_equal_and_independent_coordinates_are_as_precise_as_stated():
    """Centres with one sigma in all directions: u_T is that sigma, and u on average too."""
    rng = np.random.default_rng(8)
    total, dof = 0.0, 0.0
    for _ in range(40):
        given = face_means(yard(rng, faces=(1.0,)))
        # the same standard deviation across the beam as along it
        r, _, v = given.polar.T
        sigma = np.stack([np.ones(len(r)), 1 / (r * np.sin(v)), 1 / r], axis=1) * 8e-4
        truth = face_means(yard(np.random.default_rng(8), faces=(1.0,), noise=0.0))
        given = replace(
            given,
            polar=truth.polar + sigma * rng.normal(size=sigma.shape),
            covariance=sigma[:, :, None] * sigma[:, None, :] * np.eye(3),
        )
        found = distance_statistics(given, "inside", "outside")
        assert found.u_stated == pytest.approx(8e-4, rel=1e-3)
        total += (found.repeated.u / 8e-4) ** 2 * found.repeated.dof_equivalent
        dof += found.repeated.dof_equivalent
    low, high = chi2.ppf([1e-3, 1 - 1e-3], dof)
    assert low < total < high


def test_the_number_beyond_the_limit_has_its_rate():
    """How often so many or more are beyond it, of one scanner that was drawn again and again."""
    truth = face_means(yard(np.random.default_rng(8), series=("",), faces=(1.0,), noise=0.0))
    rng, many, said = np.random.default_rng(9), [], {}
    root = np.linalg.cholesky(truth.covariance)
    for _ in range(800):
        noise = np.einsum("nij,nj->ni", root, rng.normal(size=truth.polar.shape))
        found = distance_statistics(replace(truth, polar=truth.polar + noise), "inside", "outside")
        many.append(found.beyond)
        said[found.beyond] = found.beyond_rate
    for least in (0, 1, 2):
        share = np.mean(np.array(many) >= least)
        assert said[least] == pytest.approx(share, abs=4 * np.sqrt(0.25 / 800)), least
    # of independent differences the number would be that of coins
    assert np.var(many) > 1.2 * 6 * 0.05 * 0.95


def rates(runs: int, first: int, *, coordinates: bool, **options) -> dict[str, int]:
    """How often each statistic alarms at 5 %, one seed for each run."""
    count = dict.fromkeys(("differences", "u", "standard", "beyond", "lengths", "faces"), 0.0)
    count |= dict.fromkeys(("expected", "rare", "rate", "squares", "stations"), 0.0)
    factor = options.pop("factor", 1)
    for seed in range(first, first + runs):
        rng = np.random.default_rng(seed)
        given = yard(rng, factor, **options)
        means, pairs = face_means(given), face_pairs(given)
        found = distance_statistics(means, "inside", "outside")
        count["differences"] += not compare_distances(means, "inside", "outside").passed
        count["beyond"] += found.beyond
        count["expected"] += found.expected_beyond
        count["rare"] += found.beyond_rate <= 0.05
        if found.repeated is not None:
            count["u"] += not found.repeated.passed
            count["standard"] += found.repeated.u > found.repeated.standard_limit
            count["rate"] += found.repeated.standard_rate
        count["lengths"] += not compare_lengths(means, known(factor, rng=rng)).passed
        count["faces"] += bool(len(pairs)) and not two_face_test(pairs).passed
        if coordinates:
            series = check_series(means)
            count["squares"] += not series.passed
            count["stations"] += not series.stations.passed
    return count


def test_statistics_of_a_scanner_in_order_alarm_as_stated():
    runs = 40
    count = rates(runs, 0, coordinates=False)
    for name in ("differences", "u", "lengths", "faces"):
        assert in_binomial_bounds(count[name], runs, 0.05, 0.999), (name, count)
    assert in_binomial_bounds(count["standard"], runs, count["rate"] / runs, 0.999)
    assert count["beyond"] < 2.5 * count["expected"]
    assert count["rare"] <= binom.ppf(0.999, runs, 0.05)


@pytest.mark.slow
def test_two_hundred_scanners_in_order():
    """Every statistic within the bounds of 95 % of a binomial variable, at 5 %."""
    runs = 200
    count = rates(runs, 1000, coordinates=True)
    print(count)
    for name in ("differences", "u", "lengths", "squares", "stations"):
        assert in_binomial_bounds(count[name], runs, 0.05), (name, count)
    # signatures of the faces are tested at less than their share
    assert count["faces"] <= binom.ppf(0.975, runs, 0.05)
    assert in_binomial_bounds(count["standard"], runs, count["rate"] / runs)
    assert count["rare"] <= binom.ppf(0.975, runs, 0.05)
    # differences of one survey are correlated: the spread of their number is that of surveys
    assert count["beyond"] == pytest.approx(count["expected"], rel=0.45)


def test_errors_are_caught():
    """A scale by known lengths, an offset by the stations, a collimation by the faces."""
    for options, by in (
        ({"scale": 30e-6, "factor": 3}, "lengths"),
        ({"parameters": {"x10": 3e-3}}, "differences"),
        ({"parameters": COLLIMATION}, "faces"),
        ({"parameters": COLLIMATION, "swept": True, "faces": (1.0,), "factor": 3}, "u"),
    ):
        assert rates(6, 0, coordinates=False, **options)[by] >= 5, (options, by)


@pytest.mark.slow
@pytest.mark.parametrize("factor", YARDS)
@pytest.mark.parametrize(
    ("options", "by"),
    [
        ({"scale": 30e-6}, "lengths"),
        ({"parameters": {"x10": 3e-3}}, "differences"),
        ({"parameters": COLLIMATION}, "faces"),
        ({"parameters": COLLIMATION, "swept": True, "faces": (1.0,)}, "u"),
    ],
    ids=["scale", "offset", "collimation", "collimation of a sweep"],
)
def test_two_hundred_scanners_with_an_error(options, by, factor):
    """The rates of docs/field_check.md: 95 % or more, but for the scale in the short yard."""
    count = rates(200, 2000, coordinates=by in ("differences", "u"), factor=factor, **options)
    print(YARDS[factor], options, count)
    assert count[by] >= (50 if by == "lengths" and factor == 1 else 190)
