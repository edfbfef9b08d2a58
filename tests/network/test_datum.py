"""Datum: inner constraints, S-transformation and hard constraints against dense algebra."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from tests.network.networks import scanner_network, trilateration
from tribrach.errors import InputError, RankDefect, UnknownName
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.defects import datum_mask
from tribrach.network.network import Datum
from tribrach.network.roles import datum_sentence
from tribrach.network.survey import Survey
from tribrach.observations.sights import SlopeDistances


def dense_cofactor(adjustment: Adjustment) -> np.ndarray:
    """Upper-left block of the inverse of the bordered normal matrix (method 3.3)."""
    design = adjustment.design.toarray()
    constraints, _ = adjustment.assembly.constraints(adjustment.state)
    mask = datum_mask(adjustment.network, adjustment.free_columns)
    inner = np.where(mask[:, None], adjustment.motions.basis, 0.0).T
    border = np.vstack([constraints.toarray(), inner])
    normal = design.T @ design
    scale = 1 / np.sqrt(np.diag(normal))
    unit = normal * scale[:, None] * scale
    border = border * scale
    border /= np.linalg.norm(border, axis=1, keepdims=True) + (len(border) == 0)
    q = len(border)
    kkt = np.block([[unit, border.T], [border, np.zeros((q, q))]])
    return np.linalg.inv(kkt)[: len(unit), : len(unit)] * scale[:, None] * scale


def assert_same_cofactor(adjustment: Adjustment) -> None:
    truth = dense_cofactor(adjustment)
    i, j = (a.ravel() for a in np.meshgrid(*[np.arange(len(truth))] * 2))
    size = np.sqrt(np.diag(truth).clip(1e-30))
    error = (adjustment.cofactor.entries(i, j) - truth[i, j]) / (size[i] * size[j] + 1e-12)
    assert np.abs(error).max() < 1e-6
    solved = adjustment.cofactor.solve(np.eye(len(truth)))
    assert np.allclose(solved, truth, atol=1e-9 * truth.max())
    # forms of sparse rows, block by block, by entries and without them
    rng = np.random.default_rng(0)
    rows = np.where(rng.random((12, len(truth))) < 0.3, rng.normal(size=(12, len(truth))), 0.0)
    rows /= np.sqrt(np.einsum("ij,jk,ik->i", rows, truth, rows) + (rows == 0).all(axis=1))[:, None]
    block = rng.permutation(12).reshape(4, 3)
    form = rows[block] @ truth @ rows[block].swapaxes(1, 2)
    assert np.abs(adjustment.cofactor.row_blocks(sp.csr_array(rows), block) - form).max() < 1e-6
    columns = sp.csc_array(rows[block.ravel()].T)
    assert np.abs(adjustment.cofactor.forms(columns, 3) - form).max() < 1e-6


def test_free_trilateration_of_strang_and_borre() -> None:
    """Linear Algebra, Geodesy, and GPS (1997), example 12.4."""
    adjustment = adjust(trilateration(Datum("free")).network())
    points = dict(zip(adjustment.layout.names["point"], adjustment.state.points, strict=True))
    assert points["P"][:2] == pytest.approx((170.7123, 170.7185), abs=5e-5)
    assert points["1"][:2] == pytest.approx((170.7032, 270.7213), abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(1.1764, abs=5e-5)
    # nobody is told of stations where there are none
    assert "inner constraints over all points close" in datum_sentence(adjustment)
    assert (adjustment.defect, adjustment.dof) == (3, 1)
    assert_same_cofactor(adjustment)


def test_points_and_stations_carry_a_free_datum_together() -> None:
    survey, _ = scanner_network(np.random.default_rng(3), targets=6, stations=2)
    sentence = datum_sentence(adjust(survey.network()))
    assert "inner constraints over all points and stations close 6 open motions" in sentence


def test_free_scanner_network() -> None:
    survey, _ = scanner_network(np.random.default_rng(1))
    adjustment = adjust(survey.network())
    assert adjustment.defect == 6
    assert_same_cofactor(adjustment)
    mean = (adjustment.state.points - adjustment.network.start.points).mean(axis=0)
    assert np.abs(mean).max() < 1e-9


@pytest.mark.parametrize("names", [("T0", "T1", "T2"), ("S1",), ("T4", "S0", "T7")])
def test_inner_constraints_over_chosen_points_and_stations(names: tuple[str, ...]) -> None:
    survey, _ = scanner_network(np.random.default_rng(2))
    survey.datum = Datum("free", names)
    assert_same_cofactor(adjust(survey.network()))


def test_s_transformation_gives_the_covariance_of_the_fixed_datum() -> None:
    """AC-39: transforming a free network onto fixed points equals adjusting with them fixed."""
    survey, _ = scanner_network(np.random.default_rng(3))
    network = survey.network()
    onto_station = adjust(network.with_datum(Datum("free", ("S0",))))
    station = survey.stations["S0"]
    adjusted = onto_station.state
    survey.stations["S0"] = type(station)(
        adjusted.pose_t[0], adjusted.pose_r[0], np.zeros(6, dtype=bool)
    )
    survey.datum = Datum("control")
    fixed = adjust(survey.network())
    for name in ("T0", "T7"):
        free, held = onto_station.covariance(name), fixed.covariance(name)
        assert np.allclose(free, held, rtol=1e-4, atol=1e-4 * held.max())


def test_more_datum_points_give_a_smaller_trace() -> None:
    """AC-39: trace(inner) < trace(partial) < trace(fixed)."""
    survey, _ = scanner_network(np.random.default_rng(4))
    network = survey.network()

    def trace(datum: Datum) -> float:
        covariances = adjust(network.with_datum(datum)).family_covariances("point")
        return float(np.einsum("nii->", covariances))

    inner = trace(Datum("free"))
    partial = trace(Datum("free", ("T0", "T1", "T2", "T3")))
    minimal = trace(Datum("free", ("T0", "T1", "T2")))
    assert inner < partial < minimal


def test_estimable_quantities_do_not_depend_on_the_datum() -> None:
    survey, _ = scanner_network(np.random.default_rng(5))
    network = survey.network()
    distances = []
    for datum in (Datum("free"), Datum("free", ("T0", "T1", "T2"))):
        adjustment = adjust(network.with_datum(datum))
        a, b = (adjustment.state.points[i] for i in (5, 6))
        unit = (b - a) / np.linalg.norm(b - a)
        block = adjustment.covariance("T5") + adjustment.covariance("T6")
        block = block - adjustment.covariance("T5", "T6") - adjustment.covariance("T6", "T5")
        distances.append(unit @ block @ unit)
    assert distances[0] == pytest.approx(distances[1], rel=1e-5)


def test_hard_constraint_equals_bordered_system() -> None:
    survey = trilateration(Datum("free"))
    survey.add(SlopeDistances, values=[100.02], hard=True, start=["1"], end=["P"])
    adjustment = adjust(survey.network())
    gap = adjustment.state.points
    names = adjustment.layout.names["point"]
    difference = gap[names.index("1")] - gap[names.index("P")]
    assert np.linalg.norm(difference) == pytest.approx(100.02, abs=1e-9)
    assert adjustment.n_constraints == 1
    assert adjustment.dof == 2
    assert_same_cofactor(adjustment)


def test_a_repeated_constraint_counts_once() -> None:
    survey = trilateration(Datum("free"))
    survey.add(SlopeDistances, values=[100.02] * 2, hard=True, start=["1", "P"], end=["P", "1"])
    assert adjust(survey.network()).n_constraints == 1


def test_fixed_datum_holds_the_named_points() -> None:
    network = trilateration(Datum("free")).network()
    held = network.with_datum(Datum("fixed", ("1", "2")))
    adjustment = adjust(held)
    assert adjustment.defect == 0
    assert np.abs(adjustment.covariance("1")).max() == 0.0
    assert adjustment.state.points[1] == pytest.approx((170.71, 270.71, 0.0), abs=0)


def test_a_missing_datum_is_said_in_words() -> None:
    with pytest.raises(RankDefect) as caught:
        adjust(trilateration(Datum("control")).network())
    assert "shift in E, shift in N, rotation about U" in str(caught.value)
    assert "control" in str(caught.value)


def test_too_few_datum_points_are_said_in_words() -> None:
    with pytest.raises(RankDefect, match="more datum points"):
        adjust(trilateration(Datum("free", ("1",))).network())


def test_an_unknown_datum_point_is_refused() -> None:
    network = trilateration(Datum("free")).network()
    with pytest.raises(InputError, match="Q7"):
        network.with_datum(Datum("free", ("Q7",)))


def test_unknowns_that_cannot_be_separated_are_named() -> None:
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3)
    survey.point("B", (10, 0, 0), free=(False,) * 3)
    survey.point("C", (0, 9, 0), free=(False,) * 3)
    survey.point("P", (5, 5, 3))
    survey.point("Q", (5, 8, 1))
    survey.point("Z", (5, 8, 1))
    ends = [("A", "P", 7.68), ("B", "P", 7.68), ("C", "P", 7.07), ("P", "Q", 3.6)]
    start, end, value = zip(*ends, strict=True)
    survey.add(
        SlopeDistances,
        values=value,
        sigma=0.01,
        start=start,
        end=end,
        source=["net.csv:2", "net.csv:3", "net.csv:4", "net.csv:5"],
        zero=["zero of the EDM"] * 3 + [""],
    )
    with pytest.raises(RankDefect) as caught:
        adjust(survey.network())
    said = caught.value.sentences
    assert any("point Z is observed by nothing" in s for s in said)
    assert any("point Q" in s and "net.csv:5" in s for s in said)
    assert any("zero of the EDM" in s and "points P" in s for s in said)
    assert len(said) == 3


@pytest.mark.parametrize("kind", ["Free", "fre"])
def test_an_unknown_kind_of_datum_is_refused(kind: Any) -> None:
    with pytest.raises(UnknownName, match=f"no kind of datum {kind}; did you mean free"):
        Datum(kind)


def test_a_text_is_not_taken_for_several_datum_points() -> None:
    names: Any = "AB"
    with pytest.raises(InputError, match=r"give a tuple of names, \('AB',\)"):
        Datum("free", names)
