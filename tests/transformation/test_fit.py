"""Fitted transformations against Ghilani's printed examples, the network and Monte Carlo."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from tribrach.errors import AdjustmentError, InputError
from tribrach.geometry import euler, rotation
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.transformation.fit import fit_transformation
from tribrach.transformation.models import MODELS, Transformation, find_model

#: Ghilani, Adjustment Computations, chapter 18: measured [m] with sigmas [mm], control [m] and [cm]
GHILANI = np.array(
    [
        [1094.883, 820.085, 109.821, 7, 8, 5, 10037.81, 5262.09, 772.04, 5, 6, 5],
        [503.891, 1598.698, 117.685, 11, 8, 9, 10956.68, 5128.17, 783.00, 4, 6, 9],
        [2349.343, 207.658, 151.387, 6, 5, 7, 8780.08, 4840.29, 782.62, 2, 4, 2],
        [1395.320, 1348.853, 215.261, 5, 8, 9, 10185.80, 4700.21, 851.32, 3, 5, 3],
    ]
)
A, B = GHILANI[:, :3], GHILANI[:, 6:9]


def diagonal(sigma: np.ndarray) -> np.ndarray:
    return sigma[:, :, None] ** 2 * np.eye(sigma.shape[1])


C_A, C_B = diagonal(GHILANI[:, 3:6] / 1000), diagonal(GHILANI[:, 9:] / 100)


def made(rng: np.random.Generator, count: int, d: int, n: int = 7, scale: float = 0.0):
    """Points of A, and the true transformation by a model."""
    model = find_model(count, d)
    a = rng.uniform(-40, 40, (n, d)) * ([1, 1, 0.4] if d == 3 else [1, 1])
    true = Transformation(model, a.mean(axis=0), rng.uniform(-9, 9, d), np.eye(d), np.ones(d))
    if model.turn == "affine":
        true = Transformation(
            model,
            true.centre,
            true.shift,
            np.eye(d),
            np.ones(d),
            np.eye(d) + 0.1 * rng.normal(size=(d, d)),
        )
    elif model.turn != "none":
        turn = np.zeros(3)
        turn[2] = 2.1
        if model.turn == "free":
            turn[:2] = 0.4, -0.3
        factors = np.ones(d)
        if model.scales == "one":
            factors[:] = 1.0 + scale
        elif model.scales == "axes":
            factors = 1 + scale * np.arange(1.0, d + 1)
        true = Transformation(model, true.centre, true.shift, rotation.exp(turn)[:d, :d], factors)
    return a, true


def test_conformal_transformation_weighted_on_both_sides() -> None:
    """AC-36, proper weights of both systems."""
    fit = fit_transformation(A, B, 7, covariance_a=C_A, covariance_b=C_B)
    assert fit.transformation.factors[0] == pytest.approx(0.949955, abs=5e-7)
    assert fit.transformation.at_origin == pytest.approx(
        (10233.8542, 6549.9641, 720.8663), abs=1e-4
    )
    assert fit.dof == 5
    assert fit.sigma0 == pytest.approx(1.288, abs=5e-4)


def test_conformal_transformation_as_printed() -> None:
    """AC-36, the weights of the book: the sigmas of the measured system alone."""
    fit = fit_transformation(A, B, 7, covariance_b=C_A)
    assert fit.transformation.factors[0] == pytest.approx(0.94996, abs=5e-6)
    assert fit.transformation.at_origin == pytest.approx((10233.858, 6549.981, 720.897), abs=6e-4)
    assert fit.sigma0 == pytest.approx(8.663, abs=5e-4)
    angles = np.degrees(euler.opk_from_world_from_scanner(fit.transformation.rotation))
    expected = (
        2 + 17 / 60 + 5.3 / 3600,
        -(33 / 60 + 2.8 / 3600),
        224 + 32 / 60 + 10.9 / 3600 - 360,
    )
    assert angles == pytest.approx(expected, abs=0.06 / 3600)


def test_two_dimensional_conformal_example() -> None:
    """Ghilani, example 18.1: a -4.51249, b -0.25371, scale 4.51962, rotation 183-13-05.0."""
    plane = np.array([[121.622, -128.066], [141.228, 187.718], [175.802, 135.728]])
    control = np.array([[1049422.40, 51089.20], [1049413.95, 49659.30], [1049244.95, 49884.95]])
    fit = fit_transformation(plane, control, 4)
    m = fit.transformation.matrix
    assert m[0, 0] == pytest.approx(-4.51249, abs=1e-5)
    assert m[1, 0] == pytest.approx(-0.25371, abs=1e-5)
    assert fit.transformation.factors[0] == pytest.approx(4.51962, abs=1e-5)
    assert fit.transformation.at_origin == pytest.approx((1050003.715, 50542.131), abs=2e-3)
    angle = np.degrees(fit.transformation.values[2]) % 360
    assert angle == pytest.approx(183 + 13 / 60 + 5.0 / 3600, abs=0.1 / 3600)


def test_the_network_gives_the_same() -> None:
    """The points as unknowns of a network: same estimates, covariances and sum of squares."""
    survey = Survey()
    names = ["1", "2", "3", "4"]
    for name, x, c in zip(names, B, C_B, strict=True):
        survey.point(name, x, covariance=c)
    survey.station("model")
    survey.add(TargetCentres, values=A, covariance=C_A, station=["model"] * 4, target=names)
    adjustment = adjust(survey.network())
    fit = fit_transformation(A, B, 6, covariance_a=C_A, covariance_b=C_B)
    assert fit.vtpv == pytest.approx(adjustment.vtpv, rel=1e-6)
    assert fit.transformation.at_origin == pytest.approx(adjustment.state.pose_t[0], abs=1e-4)
    # a pose turns about its own origin
    at = adjustment.covariance("model")
    assert fit.origin_covariance == pytest.approx(at[:3, :3], rel=2e-3)
    assert fit.covariance[3:, 3:] == pytest.approx(at[3:, 3:], rel=2e-3)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: f"{m.count} in {m.dimension}D")
def test_exact_points_return_the_transformation(model) -> None:
    rng = np.random.default_rng(3)
    a, true = made(rng, model.count, model.dimension, scale=0.3)
    fit = fit_transformation(a, true(a), model)
    assert fit.transformation.matrix == pytest.approx(true.matrix, abs=1e-11)
    assert fit.transformation(a) == pytest.approx(true(a), abs=1e-11)
    assert fit.transformation.back(true(a)) == pytest.approx(a, abs=1e-11)
    assert len(model.parameters) == model.count == len(fit.transformation.values)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: f"{m.count} in {m.dimension}D")
def test_derivatives_are_those_of_the_steps(model) -> None:
    rng = np.random.default_rng(4)
    a, true = made(rng, model.count, model.dimension, scale=0.2)
    lever = true.jacobian(a)
    for k in range(model.count):
        step = np.zeros(model.count)
        step[k] = 1e-6
        numeric = (true.moved(step)(a) - true.moved(-step)(a)) / 2e-6
        assert lever[:, :, k] == pytest.approx(numeric, abs=1e-7)


@pytest.mark.parametrize(
    ("count", "d"), [(4, 3), (6, 3), (7, 3), (9, 3), (12, 3), (3, 2), (4, 2), (6, 2)]
)
def test_covariance_is_that_of_the_sample(count: int, d: int) -> None:
    """Monte Carlo with full covariances on both sides, at the 99.9 % limits of chi-square."""
    rng = np.random.default_rng(10 * count + d)
    a, true = made(rng, count, d, n=8, scale=0.1)
    n, runs = len(a), 400
    roots = rng.normal(0, 0.003, (2, n, d, d)) + 0.002 * np.eye(d)
    c_a, c_b = (r @ r.transpose(0, 2, 1) for r in roots)
    errors = []
    costs = []
    fit = None
    for _ in range(runs):
        noise = np.einsum("snij,snj->sni", roots, rng.normal(size=(2, n, d)))
        fit = fit_transformation(
            a + noise[0], true(a) + noise[1], count, covariance_a=c_a, covariance_b=c_b
        )
        # the same unknowns: all shifts at the true centre
        t = fit.transformation
        here = np.concatenate([t(true.centre[None])[0], t.matrix.ravel()])
        errors.append(here - np.concatenate([true.shift, true.matrix.ravel()]))
        costs.append(fit.vtpv)
    assert fit is not None
    exact = fit_transformation(a, true(a), count, covariance_a=c_a, covariance_b=c_b)
    jac = _matrix_jacobian(exact.transformation)
    predicted = jac @ exact.covariance @ jac.T
    values, vectors = np.linalg.eigh(predicted)
    good = values > 1e-9 * values.max()
    along = np.array(errors) @ vectors[:, good] / np.sqrt(values[good])
    assert good.sum() == count
    low, high = chi2.ppf([0.0005, 0.9995], runs * count)
    assert low < (along**2).sum() < high
    low, high = chi2.ppf([0.0005, 0.9995], runs * exact.dof)
    assert low < sum(costs) < high


def _matrix_jacobian(t: Transformation) -> np.ndarray:
    """Derivative of the shift at the centre and the matrix by the parameters, by differences."""
    k = t.model.count
    out = []
    for column in range(k):
        step = np.zeros(k)
        step[column] = 1e-7
        ends = [
            np.concatenate([e.shift, e.matrix.ravel()]) for e in (t.moved(step), t.moved(-step))
        ]
        out.append((ends[0] - ends[1]) / 2e-7)
    return np.stack(out, axis=1)


def test_joint_covariances_agree_with_blocks() -> None:
    whole = [np.zeros((12, 12)) for _ in range(2)]
    for k in range(4):
        for joint, blocks in zip(whole, (C_A, C_B), strict=True):
            joint[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = blocks[k]
    one = fit_transformation(A, B, 7, covariance_a=C_A, covariance_b=C_B)
    two = fit_transformation(A, B, 7, covariance_a=whole[0], covariance_b=whole[1])
    assert two.transformation.values == pytest.approx(one.transformation.values, rel=1e-9)
    assert two.covariance == pytest.approx(one.covariance, rel=1e-6, abs=1e-18)
    assert two.vtpv == pytest.approx(one.vtpv, rel=1e-9)


def test_what_all_points_share_moves_the_shift_alone() -> None:
    """A common error of B is no misfit: it adds to the shift and to nothing else."""
    plain = np.kron(np.eye(4), 0.01**2 * np.eye(3))
    shared = plain + np.kron(np.ones((4, 4)), 0.05**2 * np.eye(3))
    one = fit_transformation(A, B, 7, covariance_b=plain)
    two = fit_transformation(A, B, 7, covariance_b=shared)
    assert two.vtpv == pytest.approx(one.vtpv, rel=1e-6)
    more = two.covariance - one.covariance
    assert more[:3, :3] == pytest.approx(0.05**2 * np.eye(3), abs=1e-8)
    assert np.abs(more[3:, 3:]).max() < 1e-6 * np.abs(one.covariance[3:, 3:]).max()


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(*[st.floats(-6e6, 6e6)] * 3),
    st.tuples(*[st.floats(-6e6, 6e6)] * 3),
    st.tuples(*[st.floats(-1.7, 1.7)] * 3),
    st.floats(0.5, 2),
)
def test_large_coordinates_lose_nothing(far_a, far_b, turn, scale) -> None:
    """The same points anywhere on Earth: same residuals, angles, scale, shift at the centre."""
    rng = np.random.default_rng(5)
    a = rng.uniform(-50, 50, (6, 3))
    b = scale * a @ rotation.exp(np.array(turn)).T + rng.normal(0, 0.002, (6, 3))
    near = fit_transformation(a, b, 7)
    far = fit_transformation(a + far_a, b + far_b, 7)
    assert far.difference == pytest.approx(near.difference, abs=2e-8)
    assert far.transformation.factors == pytest.approx(near.transformation.factors, abs=1e-10)
    assert far.transformation.shift - far_b == pytest.approx(near.transformation.shift, abs=1e-8)
    assert far.covariance == pytest.approx(near.covariance, rel=1e-4, abs=1e-16)


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3), st.integers(0, 2**31))
def test_backwards_is_the_inverse(turn, seed) -> None:
    """B to A with the weights exchanged is the inverse transformation with the same cost."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(-30, 30, (6, 3))
    c_a, c_b = diagonal(rng.uniform(1e-3, 5e-3, (6, 3))), diagonal(rng.uniform(1e-3, 5e-3, (6, 3)))
    b = a @ rotation.exp(np.array(turn)).T + rng.normal(0, 0.004, (6, 3)) + 7
    there = fit_transformation(a, b, 7, covariance_a=c_a, covariance_b=c_b)
    back = fit_transformation(b, a, 7, covariance_a=c_b, covariance_b=c_a)
    assert back.vtpv == pytest.approx(there.vtpv, rel=1e-7)
    product = back.transformation.matrix @ there.transformation.matrix
    assert product == pytest.approx(np.eye(3), abs=1e-9)


def test_translation_at_the_origin_carries_rotation_and_scale() -> None:
    """sigma of the shift 1 km away: shift at the centre and 1 km times rotation and scale."""
    corners = np.array([[-10.0, -10, 0], [10, -10, 0], [10, 10, 0], [-10, 10, 0]])
    a = corners + np.array([1000.0, 0, 0])
    fit = fit_transformation(a, corners, 7, covariance_b=np.tile(1e-6 * np.eye(3), (4, 1, 1)))
    centre = 1e-6 / 4
    # sum of x^2 + y^2 over the corners: 800; of x^2 alone: 400
    expected = (centre + 1e6 * 1e-6 / 800, centre + 1e6 * 1e-6 / 800, centre + 1e6 * 1e-6 / 400)
    assert np.diag(fit.origin_covariance) == pytest.approx(expected, rel=1e-9)
    assert np.diag(fit.covariance)[:3] == pytest.approx(centre, rel=1e-9)


def test_open_parameters_are_named() -> None:
    line = np.arange(5.0)[:, None] * [[1.0, 2.0, 0.5]]
    with pytest.raises(InputError, match="three points that are not on one line"):
        fit_transformation(line, line, 7)
    flat = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [5, 3, 0]])
    with pytest.raises(InputError, match="four points that are not in one plane"):
        fit_transformation(flat, flat, 12)
    with pytest.raises(InputError, match="there is one common point"):
        fit_transformation(flat[:1], flat[:1], 4)
    plumb = np.array([[0.0, 0, 0], [0, 0, 10]])
    with pytest.raises((InputError, AdjustmentError), match="plumb line"):
        fit_transformation(plumb, plumb, 4)


def test_bad_covariances_are_refused() -> None:
    with pytest.raises(InputError, match=r"has the shape \(4, 2, 2\)"):
        fit_transformation(A, B, 7, covariance_a=np.ones((4, 2, 2)))
    with pytest.raises(InputError, match="not symmetric and positive"):
        fit_transformation(A, B, 7, covariance_a=-C_A)
    with pytest.raises(InputError, match="no uncertainty in either system"):
        fit_transformation(A, B, 7, covariance_a=0 * C_A, covariance_b=0 * C_B)
    with pytest.raises(InputError, match="not a number"):
        fit_transformation(A * np.nan, B, 7)
    with pytest.raises(InputError, match="no transformation with 5 parameters"):
        fit_transformation(A, B, 5)
