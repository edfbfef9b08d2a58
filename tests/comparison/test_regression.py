"""Regression against certified values, scipy, closed forms, and the published figures."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import linregress

from tribrach.comparison.regression import fit_terms, regress
from tribrach.errors import InputError
from tribrach.io.number_table import read_numbers
from tribrach.report.regression import regression_findings

HERE = Path(__file__).parent

# NIST StRD, Pontius: load cells, quadratic, higher difficulty of the linear sets
PONTIUS_X = np.tile(150000.0 * np.arange(1, 21), 2)
PONTIUS_Y = np.array(
    [
        0.11019, 0.21956, 0.32949, 0.43899, 0.54803, 0.65694, 0.76562, 0.87487, 0.98292, 1.09146,
        1.20001, 1.30822, 1.41599, 1.52399, 1.63194, 1.73947, 1.84646, 1.95392, 2.06128, 2.16844,
        0.11052, 0.22018, 0.32939, 0.43886, 0.54798, 0.65739, 0.76596, 0.87474, 0.98300, 1.09150,
        1.20004, 1.30818, 1.41613, 1.52408, 1.63159, 1.73965, 1.84696, 1.95445, 2.06177, 2.16829,
    ]
)  # fmt: skip


def test_certified_quadratic() -> None:
    found = regress({"load": PONTIUS_X, "deflection": PONTIUS_Y}, ["load"], ["deflection"])
    fit = found.relations[0].quadratic
    certified = [0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14]
    sigmas = [0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16]
    assert fit.values == pytest.approx(certified, rel=1e-8)
    assert [term.sigma for term in fit.terms] == pytest.approx(sigmas, rel=1e-8)
    assert fit.scatter == pytest.approx(0.205177424076185e-03, rel=1e-8)
    assert fit.r2 == pytest.approx(0.999999900178537, abs=1e-13)
    assert found.relations[0].curved


def test_line_against_scipy() -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(10, 50, 16)
    y = 3 + 0.4 * x + rng.normal(0, 1, 16)
    line = regress({"x": x, "y": y}, ["x"], ["y"]).relations[0].line
    expected = linregress(x, y)
    assert line.values == pytest.approx([expected.intercept, expected.slope], rel=1e-10)
    assert line.terms[0].sigma == pytest.approx(expected.intercept_stderr, rel=1e-10)
    assert line.terms[1].sigma == pytest.approx(expected.stderr, rel=1e-10)
    assert line.terms[1].p == pytest.approx(expected.pvalue, rel=1e-8)
    assert line.r2 == pytest.approx(expected.rvalue**2, rel=1e-12)
    assert line.adjusted_r2 == pytest.approx(1 - (1 - line.r2) * 15 / 14, rel=1e-12)


def published(path: Path) -> None:
    """R², coefficients, t, correlation and verdicts published for the sixteen sites."""
    names = ["range", "incidence", "mean", "std"]
    table = read_numbers(path, names)
    found = regress(table.values, names[:2], names[2:], table.units)
    by_pair = {(r.y, r.x): r for r in found.relations}
    r2 = {("mean", "range"): 0.9570, ("std", "range"): 0.7355,
          ("mean", "incidence"): 0.9659, ("std", "incidence"): 0.8356}  # fmt: skip
    t = dict(zip(r2, (-0.34, -1.47, 4.51, 1.71), strict=True))
    for pair, relation in by_pair.items():
        assert relation.quadratic.r2 == pytest.approx(r2[pair], abs=5e-5)
        assert relation.t_curvature == pytest.approx(t[pair], abs=5e-3)
        assert relation.curved == (pair == ("mean", "incidence"))
        assert relation.t_limit == pytest.approx(2.16, abs=5e-3)
    on_range = by_pair["mean", "range"].quadratic.values
    assert on_range == pytest.approx([-5.6429, 0.81129, -0.002195], rel=3e-4)
    on_angle = by_pair["mean", "incidence"].quadratic.values
    assert on_angle == pytest.approx([15.5204, -0.41038, 0.009886], rel=3e-4)
    assert by_pair["mean", "range"].line.r2 == pytest.approx(0.9567, abs=5e-4)
    assert found.correlations[0].value == pytest.approx(0.94, abs=5e-3)
    said = {one.key: one for one in regression_findings(found)}
    assert set(said) == {"curved", "straight", "causes_alike", "weak_term"}
    assert said["causes_alike"].values["c.value"] == pytest.approx(0.94, abs=5e-3)


def test_published_figures_on_constructed_rows() -> None:
    published(HERE / "sixteen_sites.csv")


@pytest.mark.data
def test_published_table(shared_data: Path) -> None:
    path = shared_data / "papers" / "sixteen_sites.csv"
    if not path.is_file():
        pytest.skip("the published rows of the sixteen test sites are not among the shared data")
    published(path)


def test_physical_model_is_found() -> None:
    rng = np.random.default_rng(3)
    length, degrees = rng.uniform(10, 50, 40), rng.uniform(0, 65, 40)
    y = 1.5 + 0.2 * length + 3.0 / np.cos(np.radians(degrees))
    values = {"range": length, "incidence": degrees, "y": y}
    fit = regress(values, ["range", "incidence"], ["y"], {"incidence": "deg"}).physical[0]
    assert fit.values == pytest.approx([1.5, 0.2, 3.0], rel=1e-10)
    gon = {**values, "incidence": degrees / 0.9}
    same = regress(gon, ["range", "incidence"], ["y"], {"incidence": "gon"}).physical[0]
    assert same.values == pytest.approx(fit.values, rel=1e-9)


def test_t_of_nothing_follows_students_distribution() -> None:
    """A straight truth is called curved in 5 % of the trials, and no more."""
    rng = np.random.default_rng(5)
    x = rng.uniform(10, 50, 16)
    trials = 2000
    called = sum(
        regress({"x": x, "y": x + rng.normal(0, 3, 16)}, ["x"], ["y"]).relations[0].curved
        for _ in range(trials)
    )
    assert abs(called / trials - 0.05) < 4 * np.sqrt(0.05 * 0.95 / trials)


@given(
    scale=st.floats(1e-6, 1e6),
    shift=st.floats(-100, 100),
    factor=st.floats(1e-3, 1e3),
)
def test_units_do_not_matter(scale: float, shift: float, factor: float) -> None:
    rng = np.random.default_rng(7)
    x = rng.uniform(10, 50, 12)
    y = 0.01 * x**2 + rng.normal(0, 1, 12)
    first = regress({"x": x, "y": y}, ["x"], ["y"]).relations[0]
    values = {"x": x * scale, "y": (y + shift) * factor}
    again = regress(values, ["x"], ["y"]).relations[0]
    assert again.t_curvature == pytest.approx(first.t_curvature, rel=1e-6)
    assert again.quadratic.r2 == pytest.approx(first.quadratic.r2, rel=1e-8)


def test_straight_truth_without_noise_is_not_curved() -> None:
    x = np.linspace(10, 50, 9)
    relation = regress({"x": x, "y": 2 + 0.5 * x}, ["x"], ["y"]).relations[0]
    assert not relation.curved
    assert relation.taken is relation.line


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ([1, 2, 3], [1, 2, 4], "cannot carry"),
        ([1, 1, 2, 2, 1], [1, 2, 3, 4, 5], "too alike"),
        ([1, 2, 3, 4, 5], [2, 2, 2, 2, 2], "the same in every row"),
    ],
)
def test_what_cannot_be_fitted_is_said(x: list[float], y: list[float], words: str) -> None:
    values = {"x": np.array(x, dtype=float), "y": np.array(y, dtype=float)}
    with pytest.raises(InputError, match=words):
        regress(values, ["x"], ["y"])


def test_beam_along_the_surface_is_refused() -> None:
    rng = np.random.default_rng(1)
    values = {"range": rng.uniform(1, 9, 8), "incidence": np.linspace(10, 90, 8)}
    values["y"] = rng.normal(0, 1, 8)
    with pytest.raises(InputError, match="below 90 degrees"):
        regress(values, ["range", "incidence"], ["y"], {"incidence": "deg"})


def test_fit_needs_independent_columns() -> None:
    y = np.arange(6.0)
    with pytest.raises(InputError, match="too alike"):
        fit_terms("line", "y", ["x"], y, {"constant": np.ones(6), "x": np.full(6, 3.0)})
