"""Faces, sets and rounds: textbook figures, closed forms, Monte Carlo."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.instruments.reduction import (
    adjust_repeats,
    adjust_rounds,
    axis_errors,
    find_sets,
    fold,
    half_difference,
    reduce,
    wrapped,
)
from tribrach.units import GON, SEC

A, B, C, D = range(4)


def sets_of(*shots, series=None):
    """Sets and closings of readings given as (target, face)."""
    target, face = np.array(shots).T
    found = find_sets(target.astype(np.int64), face.astype(np.int8), series)
    return found.number.tolist(), found.closing.tolist()


def readings(target, face, direction, zenith, distance=None, setup=None, series=None):
    n = len(target)
    return (
        np.zeros(n, dtype=np.int64) if setup is None else np.asarray(setup),
        np.asarray(target, dtype=np.int64),
        np.asarray(face, dtype=np.int8),
        np.asarray(direction, dtype=float),
        np.asarray(zenith, dtype=float),
        np.full(n, 50.0) if distance is None else np.asarray(distance, dtype=float),
        np.zeros(n, dtype=np.int64) if series is None else np.asarray(series),
    )


def simulate(rng, sets, targets, *, c=0.0, i=0.0, t=0.0, noise=0.0, turns=None):
    """Readings of complete sets with axis errors: face 1 forth, face 2 back."""
    direction = rng.uniform(0, 2 * np.pi, targets)
    zenith = rng.uniform(np.radians(50), np.radians(120), targets)
    rows = []
    for s in range(sets):
        turn = 0.0 if turns is None else turns[s]
        order = [(k, 1) for k in range(targets)] + [(k, 2) for k in reversed(range(targets))]
        for k, face in order:
            sign = 1 if face == 1 else -1
            off = sign * (c / np.sin(zenith[k]) + t / np.tan(zenith[k]))
            h = direction[k] + turn + off + (np.pi if face == 2 else 0.0)
            v = zenith[k] + sign * i
            v = v if face == 1 else 2 * np.pi - v
            rows.append((k, face, h, v))
    k, face, h, v = np.array(rows).T
    h, v = h + rng.normal(0, noise, len(h)), v + rng.normal(0, noise, len(v))
    return readings(k, face, h % (2 * np.pi), v), direction, zenith


def test_the_example_of_two_faces():
    """123.4567, 323.4633, 88.1234, 311.8806 gon: V 88.1214, i 2.0 mgon, c/sin V -3.3 mgon."""
    found = reduce(
        *readings([A, A], [1, 2], np.array([123.4567, 323.4633]) * GON,
                 np.array([88.1234, 311.8806]) * GON)
    )  # fmt: skip
    circle, level, _ = found.cells
    np.testing.assert_allclose(level.value / GON, [88.1214], atol=1e-9)
    np.testing.assert_allclose(circle.value / GON, [123.46], atol=1e-9)
    np.testing.assert_allclose(found.axes.half_zenith / GON, [0.0020], atol=1e-9)
    np.testing.assert_allclose(found.axes.half_direction / GON, [-0.0033], atol=1e-9)
    assert found.directions.readings.tolist() == [2]


@given(
    st.floats(0, 2 * np.pi - 1e-9),
    st.floats(0.3, 2.8),
    st.floats(-1e-3, 1e-3),
    st.floats(-1e-3, 1e-3),
)
def test_the_mean_of_faces_has_no_axis_errors(h, v, c, i):
    off = c / np.sin(v)
    direction = np.array([h + off, h - off + np.pi]) % (2 * np.pi)
    zenith = np.array([v + i, 2 * np.pi - v + i])
    found = reduce(*readings([A, A], [1, 2], direction, zenith))
    circle, level, _ = found.cells
    assert np.cos(circle.value[0] - h) == pytest.approx(1.0, abs=1e-12)
    assert level.value[0] == pytest.approx(v, abs=1e-12)
    assert found.axes.half_direction[0] == pytest.approx(off, abs=1e-12)
    assert found.axes.half_zenith[0] == pytest.approx(i, abs=1e-12)


def test_fold_and_half_difference():
    h, v = fold(np.array([0.1, np.pi + 0.1]), np.array([1.0, 2 * np.pi - 1.0]), np.array([1, 2]))
    np.testing.assert_allclose(h, [0.1, 0.1])
    np.testing.assert_allclose(v, [1.0, 1.0])
    assert half_difference(np.array([1e-4]), np.array([2 * np.pi - 1e-4]))[0] == pytest.approx(1e-4)


def test_axis_errors_without_noise():
    rng = np.random.default_rng(1)
    found, _, _ = simulate(rng, 1, 12, c=8 * SEC, i=-5 * SEC, t=3 * SEC)
    axes = reduce(*found).axes
    assert axes.collimation == pytest.approx(8 * SEC, abs=1e-12)
    assert axes.trunnion == pytest.approx(3 * SEC, abs=1e-12)
    assert axes.index == pytest.approx(-5 * SEC, abs=1e-12)
    assert axes.pairs == 12


def test_axis_errors_state_their_scatter():
    """Over 400 jobs the errors of c, t and i are as large as their sigmas say."""
    rng = np.random.default_rng(2)
    truth = np.array([8.0, 3.0, -5.0]) * SEC
    normalised, noise = [], []
    for _ in range(400):
        found, _, _ = simulate(rng, 2, 8, c=truth[0], t=truth[1], i=truth[2], noise=2 * SEC)
        axes = reduce(*found).axes
        if np.isnan(axes.trunnion):
            continue
        estimate = np.array([axes.collimation, axes.trunnion, axes.index])
        sigma = np.array([axes.sigma_collimation, axes.sigma_trunnion, axes.sigma_index])
        normalised.append((estimate - truth) / sigma)
        noise.append([axes.sigma_direction, axes.sigma_zenith])
    normalised = np.array(normalised)
    assert len(normalised) > 300
    assert np.abs(normalised.mean(axis=0)).max() < 0.2
    # Student t with 13 to 15 degrees of freedom has a standard deviation of about 1.08
    np.testing.assert_allclose(normalised.std(axis=0), 1.08, atol=0.15)
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(noise), axis=0)), 2 * SEC, rtol=0.05)


def test_a_misread_face_is_out_of_line():
    rng = np.random.default_rng(3)
    found, direction, _ = simulate(rng, 2, 6, c=5 * SEC, noise=1 * SEC)
    found[3][3] += 0.1 * GON
    reduced = reduce(*found)
    cells, level, _ = reduced.cells
    assert [(cells.circle[i], cells.target[i]) for i in np.flatnonzero(cells.far)] == [(0, 3)]
    assert not level.far.any()
    assert reduced.axes.collimation == pytest.approx(5 * SEC, abs=2 * SEC)
    # the other set of the target stands in for it
    means = reduced.directions
    assert not means.far.any()
    assert means.readings[means.target == 3].tolist() == [2]
    # the set without it is a round of its own
    assert sorted(means.circle.tolist()) == [0] * 5 + [1] * 6
    off = means.value - means.value[0] - (direction[means.target] - direction[means.target[0]])
    assert np.abs(np.angle(np.exp(1j * off))).max() < 6 * SEC


def test_faces_to_different_targets_are_not_averaged_in():
    """With one pair only, half a degree is the limit."""
    found = reduce(*readings([A, A], [1, 2], [1.0, 1.2 + np.pi], [1.5, 2 * np.pi - 1.5]))
    assert found.cells[0].far.tolist() == [True]
    assert found.directions.far.tolist() == [True]


def test_sets_forth_and_back():
    shots = [(A, 1), (B, 1), (C, 1), (C, 2), (B, 2), (A, 2)]
    assert sets_of(*shots, *shots)[0] == [0] * 6 + [1] * 6


def test_sets_with_faces_at_each_target():
    shots = [(A, 1), (A, 2), (B, 1), (B, 2)]
    assert sets_of(*shots, *shots) == ([0] * 4 + [1] * 4, [False] * 8)


def test_repeated_pointings_stay_in_their_set():
    shots = [(A, 1), (A, 1), (B, 1), (B, 1), (B, 2), (B, 2), (A, 2)]
    assert sets_of(*shots, *shots)[0] == [0] * 7 + [1] * 7


def test_a_closed_horizon():
    first = [(A, 1), (B, 1), (C, 1), (A, 1)]
    second = [(A, 2), (C, 2), (B, 2), (A, 2)]
    number, closing = sets_of(*first, *second, *first)
    assert number == [0] * 8 + [1] * 4
    assert closing == ([False] * 3 + [True]) * 3


def test_sets_that_the_file_says():
    shots = [(A, 1), (B, 1), (C, 1), (D, 1)]
    assert sets_of(*shots, series=np.array([1, 1, 2, 2]))[0] == [0, 0, 1, 1]


def test_closure_of_the_horizon():
    target, face = [A, B, C, A], [1, 1, 1, 1]
    found = reduce(*readings(target, face, [0.0, 1.0, 2.0, 12 * SEC], [1.5] * 4))
    np.testing.assert_allclose(found.closures.difference, [12 * SEC], atol=1e-12)
    # both readings of the first target count
    means = found.directions
    assert means.value[means.target == A][0] == pytest.approx(6 * SEC, abs=1e-12)


def test_complete_rounds_are_plain_means():
    """Least squares of complete sets is the mean of the sets reduced to their first."""
    rng = np.random.default_rng(4)
    truth = rng.uniform(0, 2 * np.pi, 5)
    turns = np.array([0.0, 1.1, 2.9, 5.0])
    table = truth + turns[:, None] + rng.normal(0, 2 * SEC, (4, 5))
    found = adjust_rounds(table % (2 * np.pi))
    reduced = np.angle(np.exp(1j * (table - table[:, :1] - (truth - truth[0]))))
    expected = reduced.mean(axis=0)
    got = np.angle(np.exp(1j * (found.direction - found.direction[0] - (truth - truth[0]))))
    np.testing.assert_allclose(got, expected, atol=1e-12)
    assert found.dof == 3 * 4
    np.testing.assert_allclose(found.residual.sum(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(found.residual.sum(axis=1), 0, atol=1e-12)
    d = reduced - reduced.mean(axis=0)
    d -= d.mean(axis=1, keepdims=True)
    assert found.sigma == pytest.approx(np.sqrt((d**2).sum() / 12), rel=1e-9)
    np.testing.assert_allclose(found.sigma_mean, found.sigma / 2)


@pytest.mark.parametrize(("sets", "targets"), [(5, 6), (9, 4)])
def test_incomplete_rounds_against_a_plain_least_squares(sets, targets):
    rng = np.random.default_rng(5)
    truth, turns = rng.uniform(0, 2 * np.pi, targets), rng.uniform(0, 2 * np.pi, sets)
    noise = rng.normal(0, 2 * SEC, (sets, targets))
    table = (truth + turns[:, None] + noise) % (2 * np.pi)
    table[[0, 1, 1, 3, 4], [3, 0, 2, 3, 1]] = np.nan
    found = adjust_rounds(table)
    assert found.orientation[0] == 0
    s, t = np.nonzero(np.isfinite(table))
    design = np.zeros((len(s), sets + targets))
    design[np.arange(len(s)), t] = 1
    design[np.arange(len(s)), targets + s] = 1
    small = np.angle(np.exp(1j * (table[s, t] - truth[t] - turns[s])))
    x = np.linalg.lstsq(design, small, rcond=None)[0]
    v = small - design @ x
    np.testing.assert_allclose(found.residual[s, t], v, atol=1e-12)
    assert found.dof == len(s) - (sets + targets - 1)
    assert found.sigma == pytest.approx(np.sqrt(v @ v / found.dof), rel=1e-9)


def test_sigma_of_rounds_is_that_of_the_noise():
    rng = np.random.default_rng(6)
    sigmas, zeniths = [], []
    for _ in range(300):
        found, _, _ = simulate(rng, 3, 5, noise=2 * SEC, turns=[0.0, 1.0, 2.0])
        (setup,) = reduce(*found).setups
        sigmas.append(setup.rounds.sigma)
        zeniths.append(setup.zeniths.sigma)
    # the mean of two faces
    for found in (sigmas, zeniths):
        assert np.sqrt(np.mean(np.square(found))) == pytest.approx(2 * SEC / np.sqrt(2), rel=0.05)


def test_sets_that_share_no_target_stay_apart():
    table = np.array([[0.1, 0.2, np.nan, np.nan], [np.nan, np.nan, 2.0, 2.5]])
    found = adjust_rounds(table)
    assert found.dof == 0
    assert np.isnan(found.sigma)
    np.testing.assert_allclose(found.residual[np.isfinite(table)], 0, atol=1e-15)


def test_repeats_are_means():
    found = adjust_repeats(np.array([[1.0, 2.0], [3.0, np.nan]]))
    np.testing.assert_allclose(found.mean, [2.0, 2.0])
    assert found.dof == 1
    assert found.sigma == pytest.approx(np.sqrt(2))


@pytest.mark.parametrize("turn", [3 * SEC, 150 * SEC, 1.5])
def test_complete_sets_are_one_round_however_the_circle_stood(turn):
    rng = np.random.default_rng(7)
    found, direction, _ = simulate(rng, 2, 4, turns=[0.0, turn])
    means = reduce(*found).directions
    assert means.circle.tolist() == [0] * 4
    assert means.readings.tolist() == [4] * 4
    np.testing.assert_allclose(wrapped(means.value - direction), 0.0, atol=1e-12)


@pytest.mark.parametrize("turn", [150 * SEC, 3 * SEC, 300 * SEC, 1.5])
def test_an_incomplete_set_keeps_its_orientation(turn):
    """Targets A to D, of which the second set, turned, lacks C: no mean mixes the two circles."""
    direction = np.array([0.1, 1.2, 2.3, 3.4])
    target = [A, B, C, D, A, B, D]
    read = direction[target] + turn * (np.arange(7) > 3)
    means = reduce(*readings(target, [1] * 7, read, [1.5] * 7)).directions
    assert means.circle.tolist() == [0] * 4 + [1] * 3
    np.testing.assert_allclose(means.value, read, atol=1e-12)
    assert means.readings.tolist() == [1] * 7


def test_a_set_that_begins_with_a_target_the_last_one_lacks():
    """B D | D B, then A B D | D B A: A is no late reading of the first set."""
    first, second = [(B, 1), (D, 1), (D, 2), (B, 2)], [(A, 1), (B, 1), (D, 1)]
    back = [(t, 2) for t, _ in second[::-1]]
    number, closing = sets_of(*first, *second, *back)
    assert number == [0] * 4 + [1] * 6
    assert not any(closing)
    # once more, with two that both sets before it lack
    third = [(C, 1), (A, 1), (B, 1), (B, 2), (A, 2), (C, 2)]
    assert sets_of(*first, *second[1:], *back[:2], *third)[0] == [0] * 4 + [1] * 4 + [2] * 6
    # side shots behind the rounds, and targets in both faces one after the other, are one set
    assert sets_of(*first, (A, 1), (C, 1))[0] == [0] * 6
    pairs = [(t, f) for t, f in ((A, 1), (A, 2), (B, 2), (B, 1), (C, 1), (C, 2), (D, 2), (D, 1))]
    assert sets_of(*pairs, *pairs)[0] == [0] * 8 + [1] * 8


def test_side_shots_after_the_rounds_continue_the_last_set():
    target, series = [A, B, A, B, C, D], np.array([1, 1, 2, 2, 3, 3])
    found = reduce(*readings(target, [1] * 6, np.arange(6) / 10, [1.5] * 6, series=series))
    assert found.directions.circle.tolist() == [0, 0, 1, 1, 1, 1]


def network_of_rounds(means, truth, sigma):
    """Estimate of directions from means with one orientation for each round, and its cofactors."""
    t, rounds = len(truth), int(means.circle.max()) + 1
    design = np.zeros((len(means.value), t + rounds))
    design[np.arange(len(design)), means.target] = 1
    design[np.arange(len(design)), t + means.circle] = 1
    weight = np.sqrt(means.readings) / sigma
    inverse = np.linalg.pinv(design * weight[:, None])
    covariance = inverse @ inverse.T
    return (inverse @ (weight * wrapped(means.value - truth[means.target])))[:t], covariance[:t, :t]


def test_means_and_their_rounds_hold_all_that_incomplete_sets_tell():
    """Twisting tripod, a target missing in each set: as precise as least squares of all readings.

    The scatter of the angle between two targets is what the sigmas say.
    """
    rng = np.random.default_rng(21)
    truth, sigma, off, stated = np.arange(5) * 1.1 + 0.2, 2 * SEC, [], 0.0
    for _ in range(400):
        target, read = [], []
        for k in range(4):
            seen = [t for t in range(5) if t != (k + 1) % 5]
            twist = rng.normal(0, 10 * SEC)
            target += seen
            read += list(truth[seen] + twist + rng.normal(0, sigma, len(seen)))
        series = np.repeat(np.arange(4), 4)
        means = reduce(*readings(target, [1] * 16, read, [1.5] * 16, series=series)).directions
        x, covariance = network_of_rounds(means, truth, sigma)
        difference = np.array([1.0, -1.0, 0, 0, 0])
        off.append(difference @ x)
        stated = float(difference @ covariance @ difference)
    table = np.full((4, 5), np.nan)
    table[np.repeat(np.arange(4), 4), target] = read
    rounds = adjust_rounds(table).direction - truth
    # the last of them against the rounds of all readings
    np.testing.assert_allclose(wrapped(rounds - rounds[0] - (x - x[0])), 0.0, atol=1e-12)
    assert np.std(off) / np.sqrt(stated) == pytest.approx(1.0, abs=0.12)


def test_an_unmoved_circle_has_one_orientation():
    rng = np.random.default_rng(8)
    found, direction, zenith = simulate(rng, 3, 4, noise=2 * SEC)
    reduced = reduce(*found)
    assert set(reduced.directions.circle.tolist()) == {0}
    assert reduced.directions.readings.tolist() == [6] * 4
    assert np.abs(np.angle(np.exp(1j * (reduced.directions.value - direction)))).max() < 5 * SEC
    np.testing.assert_allclose(reduced.zeniths.value, zenith, atol=5 * SEC)
    assert reduced.distances.readings.tolist() == [6] * 4


def test_monitoring_of_many_sets_stays_small():
    """Thousands of sets of a few targets are quick."""
    n = 6000
    rng = np.random.default_rng(10)
    target = np.tile([A, B, C], n // 3)
    h = np.tile([0.0, 1.0, 2.0], n // 3) + rng.normal(0, SEC, n)
    found = reduce(*readings(target, np.ones(n), h % (2 * np.pi), np.full(n, 1.5)))
    (setup,) = found.setups
    assert len(setup.sets) == n // 3
    assert setup.rounds.sigma == pytest.approx(SEC, rel=0.05)


def test_too_many_sets_of_too_many_targets():
    n = 8000
    target = np.zeros(n, dtype=np.int64)
    target[1::2] = np.arange(1, n // 2 + 1)
    with pytest.raises(InputError, match="too many for one table"):
        reduce(*readings(target, np.ones(n), np.full(n, 1.0), np.full(n, 1.5)))


def test_nothing_to_pair():
    found = axis_errors(np.full(3, np.nan), np.full(3, np.nan), np.full(3, 1.5))
    assert found.pairs == 0
    assert np.isnan(found.collimation)
    assert not found.far_direction.any()
