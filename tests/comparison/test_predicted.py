"""Predicted against observed: Monte Carlo with two stations, and sixteen sites of a twin."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tests.comparison import two_stations
from tests.comparison.hanoi_sites import NAMES, adjusted, compared, placed, sites, with_step
from tests.comparison.two_stations import NOISE, ORIGIN, PLACES, joint_covariance, patch
from tests.network.hanoi import twin
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.core_points import Normals, core_points
from tribrach.comparison.m3c2 import M3C2Settings
from tribrach.comparison.m3c2_ep import m3c2_ep
from tribrach.comparison.predicted import BAND, Prediction, compare_offsets, predict, with_random
from tribrach.comparison.station_pair import StationPair
from tribrach.instruments.range_law import RangeLaw
from tribrach.job.compare import compare_clouds, offset_test
from tribrach.report.comparison import offsets_finding

#: middles and normals of walls about the origin
WALLS = (((0.0, 8.0, 2.0), (0.0, -1.0, 0.0)), ((10.0, 4.0, 1.0), (-1.0, 0.0, 0.0)),
         ((2.0, 6.0, -1.0), (0.0, 0.0, 1.0)), ((-6.0, 7.0, 3.0), (0.7, -0.7, 0.14)))  # fmt: skip
CYLINDER = 0.12


def predicted(rng: np.random.Generator, errors: np.ndarray) -> list[Prediction]:
    """Predictions on the walls, scanned from both stations that are wrong by errors (12,)."""
    out = []
    pair = two_stations.pair()
    for middle, normal in WALLS:
        where = [two_stations.placement(k, errors[6 * k : 6 * k + 6]) for k in (0, 1)]
        clouds = []
        for k in (0, 1):
            surface = patch(rng, middle, normal, 1500, 0.8)
            clouds.append(where[k].pose @ two_stations.observed(rng, k, surface))
        unit = np.asarray(normal) / np.linalg.norm(normal)
        core = core_points(whole(clouds[1]), CYLINDER)
        n = len(core)
        fixed = Normals(np.tile(unit, (n, 1)), np.full(n, 0.3), np.zeros(n), np.ones(n),
                        np.full(n, 99))  # fmt: skip
        sources = [
            with_random(lambda x=x: iter([x]), w, core, fixed.vectors, incidence=False)
            for x, w in zip(clouds, where, strict=True)
        ]
        settings = M3C2Settings(scales=(0.3,), diameter=CYLINDER, depth=0.2)
        found = m3c2_ep(*sources, core, settings, pair, normals=fixed)
        one = predict(found, pair, CYLINDER)
        assert one is not None
        out.append(one)
    return out


def test_offsets_and_scatter_are_as_predicted() -> None:
    """50 draws of both poses: offsets jointly chi-square, one by one, and the noise of points."""
    rng, trials = np.random.default_rng(11), 50
    pair = two_stations.pair()
    statistics, single, ratios = [], [], []
    for _ in range(trials):
        errors = rng.multivariate_normal(np.zeros(12), joint_covariance())
        found = predicted(rng, errors)
        tested = compare_offsets(found, pair)
        assert tested is not None
        statistics.append(tested.statistic)
        single += [(p.offset / p.offset_sigma) ** 2 for p in found]
        ratios += [p.noise_ratio for p in found]
        assert all(p.enough for p in found)
    k = len(WALLS)
    low, high = chi2.ppf([0.0005, 0.9995], trials * k)
    assert low < sum(statistics) < high
    # the same poses are in all walls of a trial, so that the sum of the single ones varies more
    assert 0.6 < np.mean(single) < 1.5
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.006)
    expected = np.mean([p.noise_ratio_error for p in found])
    assert np.std(ratios) == pytest.approx(expected, rel=0.3)


def test_independent_stations_would_predict_too_much() -> None:
    """What control both share cancels; left in, the offsets are far smaller than predicted."""
    rng = np.random.default_rng(12)
    joint = joint_covariance()
    apart = StationPair(*PLACES, joint * np.kron(np.eye(2), np.ones((6, 6))))
    ratio = []
    for _ in range(12):
        found = predicted(rng, rng.multivariate_normal(np.zeros(12), joint))
        one = compare_offsets(found, apart)
        assert one is not None
        ratio.append(one.statistic / one.count)
    assert np.mean(ratio) < 0.8


def test_a_bound_of_angles_makes_no_offset_too_small() -> None:
    rng = np.random.default_rng(13)
    pair = two_stations.pair()
    found = predicted(rng, rng.multivariate_normal(np.zeros(12), joint_covariance()))
    plain = compare_offsets(found, pair)
    wide = compare_offsets([replace(one, angles=0.1) for one in found], pair)
    assert plain is not None
    assert wide is not None
    assert wide.statistic < 1e-2 < plain.least
    assert wide.least == 0
    assert wide.agrees


def test_random_part_takes_the_nearest_normal() -> None:
    """Range noise over the cosine of the incidence; without it the straight one."""
    core = ORIGIN + np.array([[0.0, 8.0, 2.0], [5.0, 8.0, 2.0]])
    normals = np.array([[0.0, -1.0, 0.0], [np.nan] * 3])
    where = two_stations.placement(0, np.zeros(6))
    alone = Placement(where.station, where.pose, np.zeros((6, 6)), NOISE)
    points = core + np.array([0.1, 0.0, 0.1])
    beam = points - PLACES[0]
    cosine = np.abs(beam[:, 1]) / np.linalg.norm(beam, axis=1)
    for wish, given in ((True, cosine), (False, None)):
        (chunk,) = with_random(lambda: iter([points]), where, core, normals, incidence=wish)()
        expected = covariances(where.pose.inverse @ points, alone, given)
        assert chunk.random == pytest.approx(expected, rel=1e-9)


def test_random_part_takes_the_intensity_of_each_point() -> None:
    law = RangeLaw(0.06, -0.6, 0.0003, 20.0, 200.0)
    where = two_stations.placement(0, np.zeros(6))
    where = replace(where, noise=replace(NOISE, law=law))
    points = ORIGIN + np.array([[0.1, 8.0, 2.1], [0.1, 8.0, 2.1], [0.1, 8.0, 2.1]])
    lit = np.column_stack([points, [30.0, 150.0, np.nan]])
    (chunk,) = with_random(lambda: iter([lit]), where, points, np.full((3, 3), np.nan))()
    alone = replace(where, covariance=np.zeros((6, 6)))
    expected = covariances(where.pose.inverse @ points, alone, None, lit[:, 3])
    assert chunk.xyz == pytest.approx(points)
    assert chunk.random == pytest.approx(expected, rel=1e-9)
    sizes = np.sqrt(expected[:, :3].sum(axis=1))
    assert sizes[0] > 2 * sizes[1]


def prediction(**more: object) -> Prediction:
    given: dict[str, object] = {
        "noise": (0.002, 0.002), "scatter": (0.002, 0.002), "dof": (2000, 2000),
        "registration": 0.001, "offset": 0.001, "offset_noise": 0.0001,
        "row": (*[0.0] * 7, 1.0, *[0.0] * 4), "lod95": 0.002, "lod95_additive": 0.003,
        "lod95_spatial": None, "changed": 0.0,
    }  # fmt: skip
    return Prediction(**(given | more))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({}, "as predicted"),
        ({"scatter": (0.0026, 0.0026)}, "scatter more than predicted"),
        ({"scatter": (0.0016, 0.0016)}, "scatter less than predicted"),
        ({"offset": 0.0031}, "farther apart than predicted"),
        ({"offset": -0.0029}, "as predicted"),
        ({"dof": (100, 100), "scatter": (0.004, 0.004)}, "too few points to tell 10 %"),
    ],
)
def test_verdicts(change: dict[str, object], verdict: str) -> None:
    one = prediction(**change)
    assert one.verdict == verdict
    assert one.sigma == pytest.approx(0.003)
    assert one.observed == pytest.approx(np.sqrt(sum(s**2 for s in one.scatter) + one.offset**2))


def test_offsets_in_words() -> None:
    pair = StationPair(np.zeros(3), np.ones(3), np.diag([5e-7] * 12))
    for size, words in ((1e-6, "smaller than"), (0.001, "as large as"), (0.02, "larger than")):
        found = compare_offsets([prediction(offset=s * size) for s in (1, 1, 1)], pair)
        assert found is not None
        said = offsets_finding(found).values
        assert (said["t.count"], said["how"]) == (3, words)
    assert compare_offsets([], pair) is None


#: sites of the thin test: near and straight, far and slanted
SOME = (0, 3, 6, 9, 15)


def test_sites_of_the_twin(tmp_path: Path) -> None:
    """Five of the sites, a twelfth of the points: as predicted, and without incidence not."""
    made = twin(5)
    adjustment = adjusted(made, tmp_path)
    clouds, pair = placed(with_step(made, 0.0012, SOME), adjustment)
    chosen = [sites()[k] for k in SOME]
    found = compared(clouds, pair, chosen=chosen)
    _as_predicted(found, pair, made, adjustment)
    without = [s.prediction for s in compared(clouds, pair, False, chosen)]
    assert any(p is not None and p.noise_ratio > 1.07 for p in without)


def _as_predicted(found, pair, made, adjustment) -> None:  # type: ignore[no-untyped-def]
    """Stations within 3 mm as stated and as true; every site with enough points within 10 %."""
    state = adjustment.state
    for station in made.stations:
        sigma = np.sqrt(np.diag(adjustment.covariance(station.name))[:3])
        k = state.layout.index("pose", station.name)
        assert (sigma < 0.003).all()
        assert (np.abs(state.pose_t[k] - station.pose.translation) < 0.003).all()
    for site in found:
        one = site.prediction
        assert one is not None
        assert one.enough, site.name
        assert BAND[0] < one.ratio < BAND[1], (site.name, one.ratio)
        assert BAND[0] < one.noise_ratio < BAND[1], (site.name, one.noise_ratio)
        assert site.predicted_sigma == one.sigma
    tested = offset_test(found, pair)
    assert tested is not None
    assert tested.statistic < chi2.ppf(0.999, tested.count)


@pytest.mark.slow
def test_offsets_of_many_draws_are_as_large_as_predicted(tmp_path: Path) -> None:
    """Twenty draws of the whole survey: all offsets together, and what points alone leave.

    One draw in twenty is beyond its limits of 95 %; the first of the demonstration is, by chance.
    """
    statistics, alone = [], []
    for seed in range(1, 21):
        made = twin(seed)
        folder = tmp_path / str(seed)
        folder.mkdir()
        adjustment = adjusted(made, folder, seed)
        clouds, pair = placed(with_step(made, 0.0012), adjustment)
        found = compare_clouds(*clouds, sites(), method="m3c2", stations=pair)  # type: ignore[arg-type]
        tested = offset_test(found, pair)
        assert tested is not None
        statistics.append(tested.statistic)
        errors = []
        for name in reversed(NAMES):
            k = adjustment.state.layout.index("pose", name)
            true = made.station(name).pose
            turned = adjustment.state.pose_r[k] @ true.rotation.T
            errors += [*(adjustment.state.pose_t[k] - true.translation)]
            errors += [*Rotation.from_matrix(turned).as_rotvec()]
        for site in found:
            one = site.prediction
            assert one is not None
            left = one.offset - np.array(one.row)[:12] @ errors
            alone.append((left / np.hypot(one.offset_noise, one.angles)) ** 2)
    count = 16 * len(statistics)
    low, high = chi2.ppf([0.0005, 0.9995], count)
    assert low < sum(statistics) < high
    assert low < sum(alone) < high


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_all_sites_of_the_twin(tmp_path: Path, seed: int) -> None:
    """Sixteen sites as the twin scans them, along normals and after the floor of nearest points."""
    made = twin(seed)
    adjustment = adjusted(made, tmp_path, seed)
    clouds, pair = placed(made, adjustment)
    found = compared(clouds, pair)
    assert len(found) == 16
    _as_predicted(found, pair, made, adjustment)
    for site in found:
        assert site.c2c is not None
        assert site.c2c.debiased_rms is not None
        assert BAND[0] < site.c2c.debiased_rms / site.predicted_sigma < BAND[1], site.name
    without = [s.prediction for s in compared(clouds, pair, incidence=False)]
    outside = [p for p in without if p is not None and not BAND[0] < p.ratio < BAND[1]]
    assert len(outside) >= 2
