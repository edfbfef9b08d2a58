"""What points share: closed forms, sums of all pairs, and the wall whose mean has a floor."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tribrach as tb
from tests.cloud.test_calibration_share import joint as joint_with_calibration
from tests.cloud.test_calibration_share import placement as calibrated
from tests.network.facade import facade
from tribrach.cloud.covariance import covariances
from tribrach.cloud.quantities import (
    area_of,
    mean_of,
    plane_distance,
    propagate,
    relative,
    volume_between,
)
from tribrach.cloud.shared_part import SharedPart, angle_slopes, slopes
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.adjustment import adjust
from tribrach.units import SEC

NOISE = ScanNoise(1.5e-3, 1e-5, 8 * SEC, 6 * SEC)
BIASED = replace(NOISE, systematic=12 * SEC)
SYMMETRIC = [[0, 3, 4], [3, 1, 5], [4, 5, 2]]


def two_stations(noise: ScanNoise | None = NOISE, seed: int = 1) -> SharedPart:
    """Two stations with any joint covariance, of a millimetre and ten seconds."""
    rng = np.random.default_rng(seed)
    size = np.tile([1e-3] * 3 + [5e-5] * 3, 2)
    root = size[:, None] * rng.normal(size=(12, 12)) / 3
    scans = {
        name: (name, Pose(exp(np.array([0.02, -0.01, turn])), np.array(at)), noise, None)
        for name, turn, at in (("A", 0.4, (2.0, 1.0, 0.5)), ("B", 2.0, (30.0, -4.0, 1.0)))
    }
    columns = {"A": np.arange(6), "B": np.arange(6, 12)}
    return SharedPart.assembled(scans, columns, root @ root.T, ("A", "B"))


def wall(shared: SharedPart, scan: str, n: int, seed: int = 0, y: float = 20.0):
    rng = np.random.default_rng(seed)
    xyz = np.stack([rng.uniform(5, 9, n), np.full(n, y), rng.uniform(0, 3, n)], axis=1)
    return shared.points(xyz, scan)


def full_matrix(sets) -> np.ndarray:
    """All n^2 numbers: the covariance (3n, 3n) of the points of one result."""
    shared = sets[0].shared
    rows = []
    for one in sets:
        j = np.zeros((len(one), 3, len(shared.covariance)))
        j[:, :, shared.columns[one.scan]] = slopes(one.xyz, one.placement)
        rows.append(j.reshape(-1, len(shared.covariance)))
    j = np.concatenate(rows)
    whole = j @ shared.covariance @ j.T
    at = 0
    for one in sets:
        for own in one.own():
            whole[at : at + 3, at : at + 3] += own
            at += 3
    return whole


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_columns_say_what_all_pairs_of_points_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shared = two_stations(seed=seed)
    sets = [shared.points(rng.normal(0, 20, (n, 3)), s) for n, s in ((7, "A"), (4, "B"), (3, "A"))]
    gradients = [rng.normal(size=one.xyz.shape) for one in sets]
    found = propagate(sets, gradients, 1.0)
    flat = np.concatenate([g.ravel() for g in gradients])
    assert found.variance == pytest.approx(flat @ full_matrix(sets) @ flat, rel=1e-8)
    assert found.systematic == 0.0
    total = sum(map(len, sets))
    average = np.tile(np.eye(3) / total, (1, total))
    assert mean_of(sets).covariance == pytest.approx(average @ full_matrix(sets) @ average.T,
                                                     rel=1e-8, abs=1e-16)  # fmt: skip


def test_a_single_point_has_the_covariance_of_its_cloud() -> None:
    where = calibrated(joint_with_calibration())
    c = joint_with_calibration()
    scans = {"S": (where.station, where.pose, where.noise, where.calibration.correction)}
    shared = SharedPart.assembled(scans, {"S": np.arange(10)}, c, ("S",), ("x10", "x2", "x4", "x6"))
    local = np.array([[4.0, 3.0, 1.0]])
    found = mean_of(shared.points(where.pose @ local, "S")).covariance
    expected = covariances(local, where)[0][SYMMETRIC]
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-16)


def test_the_mean_of_a_wall_never_falls_below_the_shared_part() -> None:
    shared = two_stations()
    normal = np.array([0.0, 1.0, 0.0])
    last = np.inf
    for n in (1, 10, 100, 1000, 10_000, 100_000):
        found = mean_of(wall(shared, "A", n)).along(normal)
        assert found.sigma > found.floor > 2e-4
        assert found.own < last
        last = found.own
    # a point at the middle of the wall, without noise of its own
    middle = two_stations(None).points([7.0, 20.0, 1.5], "A")
    assert found.floor == pytest.approx(mean_of(middle).along(normal).sigma, rel=0.01)
    assert found.sigma == pytest.approx(found.floor, rel=1e-3)
    assert np.sqrt(found.own) == pytest.approx(1.7e-3 / np.sqrt(n), rel=0.2)


def test_within_one_station_its_place_cancels_and_its_turn_moves_no_distance() -> None:
    """A rigid motion changes no distance, no area, and no distance between planes."""
    shared = two_stations(None)
    one, two = wall(shared, "A", 50), wall(shared, "A", 50, 1, 26.0)
    for found in (relative(one, two).length, plane_distance(one, two)):
        assert found.value == pytest.approx(6.0, rel=0.02)
        assert found.sigma < 1e-12
    corners = shared.points([[5, 20, 0], [9, 20, 0], [9, 20, 3], [5, 20, 3]], "A")
    assert area_of(corners).value == pytest.approx(12.0)
    assert area_of(corners).sigma < 1e-12
    # the difference of the places turns with the station, and has no part of its translation
    found = relative(one, two)
    turn = shared.covariance[3:6, 3:6]
    d = found.value
    skewed = np.array([[0, -d[2], d[1]], [d[2], 0, -d[0]], [-d[1], d[0], 0]])
    assert found.covariance == pytest.approx(skewed @ turn @ skewed.T, rel=1e-9, abs=1e-18)


def test_two_stations_share_what_their_joint_covariance_says() -> None:
    shared = two_stations(None)
    p, q = shared.points([7.0, 20.0, 1.0], "A"), shared.points([7.0, 20.0, 1.0], "B")
    found = relative(p, q)
    j = np.concatenate([-slopes(p.xyz, p.placement)[0], slopes(q.xyz, q.placement)[0]], axis=1)
    assert found.covariance == pytest.approx(j @ shared.covariance @ j.T, rel=1e-9, abs=1e-18)
    # a result that is read twice is one result
    again = two_stations(None).points([7.0, 20.0, 1.0], "B")
    assert relative(p, again).covariance == pytest.approx(found.covariance)
    # two results know nothing of each other
    other = replace(shared, stations=("A", "C"))
    apart = relative(p, other.points([7.0, 20.0, 1.0], "B"))
    own = np.kron(np.eye(2), np.ones((6, 6))) * shared.covariance
    assert apart.covariance == pytest.approx(j @ own @ j.T, rel=1e-9, abs=1e-18)
    with pytest.raises(InputError, match="no direction"):
        _ = found.length


def moved(points, rng, scale=1e-6):
    """The same points moved a little, and by what (n, 3)."""
    step = scale * rng.normal(size=points.xyz.shape)
    return replace(points, xyz=points.xyz + step), step


@pytest.mark.parametrize("what", ["plane", "area", "corners", "volume", "distance"])
def test_gradients_are_those_of_differences(what: str) -> None:
    """A variance with B_i = I is the squared gradient: against central differences of the value."""
    rng = np.random.default_rng(8)
    noise = ScanNoise(1e-3, 0.0, 0.0, 0.0)
    shared = two_stations(noise)
    shared = replace(shared, covariance=np.zeros((12, 12)))
    one, two = wall(shared, "A", 12), wall(shared, "B", 9, 3, 24.0)
    one = replace(one, xyz=one.xyz + 0.05 * rng.normal(size=one.xyz.shape))
    sets = [one, two]
    if what == "area":
        sets = [shared.points([[5, 20, 0], [9, 20.1, 0], [9, 20, 3], [5, 20.2, 3]], "A")]
    if what == "corners":
        sets = [shared.points(rng.normal(c, 0.01, (3, 3)), "A")
                for c in ([5, 20, 0], [9, 20, 0], [9, 20, 3])]  # fmt: skip

    def compute(these):
        if what in ("area", "corners"):
            return area_of(these if what == "corners" else these[0])
        if what == "volume":
            return volume_between(*these, 2.0, (0.0, 1.0, 0.0))
        return plane_distance(*these) if what == "plane" else relative(*these).length

    expected = 0.0
    for k, one_set in enumerate(sets):
        for i in range(len(one_set)):
            beam = one_set.xyz[i] - one_set.placement.pose.translation
            step = np.zeros_like(one_set.xyz)
            step[i] = 1e-5 * beam / np.linalg.norm(beam)
            ends = [
                compute([replace(s, xyz=s.xyz + sign * step) if n == k else s
                         for n, s in enumerate(sets)]).value
                for sign in (-1, 1)
            ]  # fmt: skip
            expected += ((ends[1] - ends[0]) / 2e-5 * 1e-3) ** 2
    found = compute(sets)
    own = found.own - (found.sampling if what == "volume" else 0.0)
    assert own == pytest.approx(expected, rel=1e-5)
    assert found.shared == pytest.approx(0.0, abs=1e-20)


def test_a_volume_says_what_it_covers() -> None:
    shared = two_stations()
    grid = np.stack(np.meshgrid(np.arange(0.5, 8), np.arange(0.5, 8)), axis=-1).reshape(-1, 2)
    low = shared.points(np.column_stack([grid, np.zeros(64)]), "A")
    high = shared.points(np.column_stack([grid[:48], np.full(48, 0.25)]), "B")
    found = volume_between(low, high, 1.0)
    assert (found.cells, found.left_out, found.area) == (48, 16, 48.0)
    assert found.value == pytest.approx(12.0)
    assert found.unit == "m3"
    assert volume_between(low, high, 1.0, (0, 0, -1)).value == pytest.approx(-12.0)
    with pytest.raises(InputError, match="no cell"):
        volume_between(low, shared.points([100.0, 0.0, 0.0], "A"), 1.0)
    with pytest.raises(InputError, match="larger cells"):
        volume_between(low, high, 1e-5)


def test_systematic_angles_make_neither_mean_nor_distance_too_small() -> None:
    """Whatever the correlation of neighbours from 0 to 1, no variance is above what is stated."""
    rng = np.random.default_rng(4)
    shared = replace(two_stations(BIASED), covariance=np.zeros((12, 12)))
    one, two = wall(shared, "A", 30), wall(shared, "A", 30, 1, 26.0)
    every = np.concatenate([one.xyz, two.xyz])
    a = np.concatenate([angle_slopes(p.xyz, p.placement) for p in (one, two)])
    local = (every - one.placement.pose.translation) @ one.placement.pose.rotation
    unit = local / np.linalg.norm(local, axis=1)[:, None]
    apart = np.arccos(np.clip(unit @ unit.T, -1, 1))
    weights = np.repeat([-1 / 30, 1 / 30], 30)
    for reach in (1e-6, 0.01, 0.05, 0.3, 1.0, 1e6):
        r = np.exp(-((apart / reach) ** 2))
        for w, found in (
            (np.where(weights > 0, 0.0, -weights), mean_of(one)),
            (weights, relative(one, two)),
        ):
            true = sum(
                (w[:, None] * a[:, :, k]).T @ r @ (w[:, None] * a[:, :, k]) for k in range(2)
            )
            rest = found.systematic - true
            assert np.linalg.eigvalsh(rest)[0] > -1e-12 * np.trace(found.systematic)
        g = rng.normal(size=(60, 3))
        scalar = np.einsum("ni,nik->nk", g, a)
        stated = propagate([one, two], [g[:30], g[30:]], 0.0).systematic
        assert sum(scalar[:, k] @ r @ scalar[:, k] for k in range(2)) <= stated * (1 + 1e-9)
    # of a small patch that is the whole error, of a point all that its sigma has of it
    point = shared.points(one.xyz[:1], "A")
    exact = np.einsum("ik,jk->ij", a[0], a[0])
    assert mean_of(point).systematic == pytest.approx(exact, rel=1e-9, abs=1e-18)
    many = shared.points(np.tile(one.xyz[:1], (500, 1)), "A")
    assert mean_of(many).systematic == pytest.approx(exact, rel=1e-9, abs=1e-18)


def test_fewer_independent_points_know_less() -> None:
    shared = two_stations()
    free = wall(shared, "A", 100)
    crowded = replace(free, effective=25.0)
    assert mean_of(replace(free, effective=100.0)).own == pytest.approx(mean_of(free).own)
    assert mean_of(crowded).own == pytest.approx(4 * mean_of(free).own)
    assert mean_of(crowded).shared == pytest.approx(mean_of(free).shared)


def test_points_in_one_beam_count_as_one() -> None:
    """Ranges share what the footprints do: of coincident points all, of distant ones nothing."""
    wide = replace(NOISE, horizontal=0.0, vertical=0.0, beam_exit=4e-3, beam_divergence=0.3e-3)
    shared = two_stations(wide)
    one = shared.points([7.0, 20.0, 1.0], "A")
    beam = one.xyz[0] - one.placement.pose.translation
    alone = mean_of(one).along(beam).own
    close = one.xyz + np.linspace(0, 1e-7, 40)[:, None] * np.array([1.0, 0.0, 0.0])
    assert mean_of(shared.points(close, "A")).along(beam).own == pytest.approx(alone, rel=1e-3)
    apart = one.xyz + np.linspace(0, 4, 40)[:, None] * np.array([1.0, 0.0, 0.0])
    assert mean_of(shared.points(apart, "A")).along(beam).own < 0.05 * alone
    known = two_stations(replace(wide, shared_share=0.25))
    quarter = mean_of(known.points(close, "A")).along(beam).own
    assert quarter == pytest.approx((0.25 + 0.75 / 40) * alone, rel=1e-3)


def test_stations_of_an_adjustment() -> None:
    adjustment = adjust(facade().network())
    shared = SharedPart.of_adjustment(adjustment, NOISE)
    assert shared.stations == tuple(adjustment.stations)
    name = shared.stations[0]
    station = adjustment.stations[name]
    xyz, covariance = tb.place([[5.0, 3.0, 1.0]], station, NOISE)
    assert mean_of(shared.points(xyz, name)).covariance == pytest.approx(covariance[0], rel=1e-9)
    posterior = SharedPart.of_adjustment(adjustment, NOISE, posterior=True)
    factor = adjustment.posterior_factor
    assert posterior.covariance == pytest.approx(factor * shared.covariance)


def test_what_is_no_patch_is_refused() -> None:
    shared = two_stations()
    with pytest.raises(KeyError, match="C"):
        shared.points([0.0, 0.0, 0.0], "C")
    with pytest.raises(InputError, match="array \\(n, 3\\)"):
        shared.points([[1.0, 2.0]], "A")
    with pytest.raises(InputError, match="no number"):
        shared.points([[1.0, 2.0, np.nan]], "A")
    with pytest.raises(InputError, match="said to be independent"):
        shared.points([[1.0, 2.0, 3.0]], "A", effective=3)
    with pytest.raises(InputError, match="one for each"):
        shared.points([[1.0, 2.0, 3.0]], "A", cosine=[1.0, 1.0])
    with pytest.raises(InputError, match="there are no points"):
        mean_of([])
    with pytest.raises(InputError, match="gradients"):
        propagate(wall(shared, "A", 3), np.ones((2, 3)), 0.0)
    line = shared.points([[0, 0, 1], [0, 0, 2], [0, 0, 3.0]], "A")
    with pytest.raises(InputError, match="on a line"):
        plane_distance(line, line)
    with pytest.raises(InputError, match="12 rows"):
        SharedPart({}, {}, np.eye(6), ("A", "B"))
    with pytest.raises(InputError, match="direction"):
        mean_of(line).along([0, 0, 0])
    with pytest.raises(InputError, match="confidence"):
        mean_of(line).along([0, 0, 1]).interval(2.0)


def same(found, expected) -> None:
    """Two vectors have one value and one covariance, part by part."""
    assert found.value == pytest.approx(expected.value, abs=1e-12)
    for part in ("own", "shared", "systematic"):
        assert getattr(found, part) == pytest.approx(getattr(expected, part), rel=1e-9, abs=1e-20)


@pytest.mark.parametrize("effective", [None, 40.0])
@pytest.mark.parametrize("share", [None, 0.3])
def test_a_point_in_two_sets_is_one_observation(
    effective: float | None, share: float | None
) -> None:
    shared = two_stations(replace(BIASED, shared_share=share))
    a = replace(wall(shared, "A", 200), effective=effective)
    b = replace(wall(shared, "A", 100, 7), effective=effective)
    again = replace(a, xyz=a.xyz[::-1].copy(), shared=two_stations(a.placement.noise))
    twice = replace(a, xyz=np.concatenate([a.xyz, again.xyz]))
    for sets in ([a, a], [a, again], twice, [a, a, a]):
        same(mean_of(sets), mean_of(a))
    nothing = relative(a, a)
    assert not nothing.value.any()
    assert not nothing.covariance.any()
    assert np.abs(relative(a, [again, a]).covariance).max() < 1e-30
    surface = volume_between(a, a, 1.0, (0.0, 1.0, 0.0))
    assert (surface.value, surface.sigma, surface.cells > 4) == (0.0, 0.0, True)
    # what is not the same is not joined: other points, the same place seen from elsewhere
    other = replace(a, scan="B")
    for pair in ([a, b], [a, other]):
        apart = [mean_of(one).own * len(one) ** 2 for one in pair]
        assert mean_of(pair).own == pytest.approx(sum(apart) / sum(map(len, pair)) ** 2)


def test_of_a_patch_inside_of_another_each_point_counts_once() -> None:
    """Against the weights that are summed by hand: 1/m - 1/n inside, -1/n outside."""
    shared = two_stations(BIASED)
    a = wall(shared, "A", 60)
    inside = replace(a, xyz=a.xyz[:20])
    weights = np.where(np.arange(60) < 20, 1 / 20 - 1 / 60, -1 / 60)
    found = relative(a, inside)
    own = np.einsum("n,nij->ij", weights**2, a.own())
    assert found.own == pytest.approx(own, rel=1e-9)
    assert found.own[1, 1] < 0.7 * (mean_of(a).own + mean_of(inside).own)[1, 1]
    for direction in np.eye(3):
        by_hand = propagate(a, weights[:, None] * direction, 0.0)
        along = found.along(direction)
        assert (along.own, along.shared) == pytest.approx((by_hand.own, by_hand.shared))
        assert along.systematic >= by_hand.systematic * (1 - 1e-9)


@pytest.mark.parametrize("wrong", [np.zeros((4, 3)), "S1.laz", [np.zeros((4, 3))] * 3, 5.0, None])
def test_what_are_no_points_of_a_scan_is_said(wrong: object) -> None:
    some = two_stations().points([7.0, 20.0, 1.0], "A")
    with pytest.raises(InputError, match="does not say of which scan"):
        mean_of(wrong)
    with pytest.raises(InputError, match="does not say of which scan"):
        relative(some, wrong)
    with pytest.raises(InputError, match="does not say of which scan"):
        area_of(wrong)
    with pytest.raises(InputError, match="does not say of which scan"):
        propagate(wrong, np.zeros((4, 3)), 0.0)


def hillside(rng, shared, degrees: float, *, noise: bool, rough: float = 0.0):
    """A random sample of one slope, 50 points a square metre on 4 by 4 m, each with its noise."""
    xy = rng.uniform(0, 4, (800, 2)) + 20
    z = np.tan(np.radians(degrees)) * xy[:, 0] + rough * rng.normal(size=len(xy))
    points = shared.points(np.column_stack([xy, z]), "A")
    if not noise:
        return points
    step = np.linalg.cholesky(points.own()) @ rng.normal(size=(len(xy), 3, 1))
    return replace(points, xyz=points.xyz + step[:, :, 0])


@pytest.mark.parametrize("degrees", [0.0, 20.0, 35.0, 40.0])
def test_a_slope_costs_a_volume_nothing_but_its_noise(degrees: float) -> None:
    """Two samples of one plane have no volume between them, whatever the plane leans by."""
    rng, shared = np.random.default_rng(5), two_stations()
    clean = [hillside(rng, shared, degrees, noise=False) for _ in range(2)]
    assert abs(volume_between(*clean, 0.5).value) < 1e-9
    ratio = []
    for _ in range(30):
        found = volume_between(*(hillside(rng, shared, degrees, noise=True) for _ in range(2)), 0.5)
        ratio.append(found.value / np.sqrt(found.own))
    # chi-square of 30 values at 0.999
    assert 0.62 < np.sqrt(np.mean(np.square(ratio))) < 1.41


def test_rough_ground_is_sampled_by_its_points() -> None:
    """Boulders of 5 cm on a slope: the scatter about the planes is in the sigma, and is told."""
    rng, shared = np.random.default_rng(6), two_stations(None)
    ratio = []
    for _ in range(30):
        found = volume_between(
            *(hillside(rng, shared, 30, noise=False, rough=0.05) for _ in range(2)), 0.5
        )
        assert found.sampling == pytest.approx(found.own)
        ratio.append(found.value / np.sqrt(found.own))
    # chi-square of 30 values at 0.999
    assert 0.62 < np.sqrt(np.mean(np.square(ratio))) < 1.41


def test_cells_of_few_points_take_the_slope_around_them() -> None:
    """Two points a square metre in cells of half a metre: most cells have none or one."""
    rng, shared = np.random.default_rng(7), two_stations(None)
    sets = []
    for lift in (0.0, 0.3):
        xy = rng.uniform(0, 10, (400, 2)) + 20
        z = np.tan(np.radians(35)) * xy[:, 0] + lift
        sets.append(shared.points(np.column_stack([xy, z]), "A"))
    found = volume_between(*sets, 0.5)
    assert found.value == pytest.approx(0.3 * found.area, abs=1e-9)
    assert found.border > 0
