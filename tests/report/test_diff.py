"""What differs between two results: covariances of differences from closed forms."""

import json

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tests.report.cases import scanner_content
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.network.adjustment import adjust
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.questions.diff.chapters import answer_of
from tribrach.questions.diff.difference import difference
from tribrach.report import json_result
from tribrach.report.build import build


def result(values, names=None, sigma=0.001, posterior=False):
    """Height of B over A, measured several times; each value has a file of its own."""
    count = len(values)
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    names = range(2, count + 2) if names is None else names
    survey.add(
        HeightDifferences,
        values=list(values),
        sigma=sigma,
        start=["A"] * count,
        end=["B"] * count,
        source=[f"line{k}.csv:2" for k in names],
    )
    adjustment = adjust(survey.network())
    content = build(adjustment, assess(adjustment), posterior=posterior)
    return json.loads(json_result.dumps(content))


def said(document):
    """Findings by their keys."""
    return {one.key: one.words for one in answer_of(document).findings}


def place(document, name="B"):
    return next(p for p in document.places if p.name == name)


def test_nested_results_differ_by_the_difference_of_their_variances() -> None:
    """Mean of 2 of 5 values against the mean of all: sigma^2 (1/2 - 1/5)."""
    values = [1.0, 1.001, 1.002, 0.999, 1.0005]
    all_of_them, some = result(values), result(values[:2])
    for pair in ((some, all_of_them), (all_of_them, some)):
        document = difference(*pair)
        assert document.common == "nested"
        assert place(document).difference_sigma == pytest.approx(1e-3 * np.sqrt(1 / 2 - 1 / 5))
    shift = np.mean(values) - np.mean(values[:2])
    found = place(difference(some, all_of_them))
    assert found.shift[2] == pytest.approx(shift, abs=1e-9)
    assert found.test == pytest.approx(shift**2 / (1e-6 * 0.3), rel=1e-6)


def test_disjoint_results_differ_by_the_sum() -> None:
    document = difference(result([1.0, 1.001]), result([1.0, 1.002, 1.003], names=[7, 8, 9]))
    assert document.common == "disjoint"
    assert place(document).difference_sigma == pytest.approx(1e-3 * np.sqrt(1 / 2 + 1 / 3))


def test_overlapping_results_have_a_bound_that_is_none_too_small() -> None:
    """Means of values 1 to 3 and 3 to 5: the true variance is sigma^2 (2/3 - 2/9)."""
    document = difference(result([1, 1, 1]), result([1, 1, 1.0], names=[4, 5, 6]))
    assert document.common == "overlapping"
    sigma = place(document).difference_sigma
    assert sigma >= 1e-3 * np.sqrt(2 / 3 - 2 / 9)
    assert "at most" in said(document)["largest"]


def test_the_same_measurements_are_never_called_moved() -> None:
    one = result([1.0, 1.001])
    other = json.loads(json.dumps(one))
    other["points"]["B"]["xyz"][2] += 0.5
    document = difference(one, other)
    assert document.common == "same"
    assert not any(p.moved for p in document.places)
    assert next(iter(said(document))) == "same"


def test_two_equal_results_are_said_to_be_the_same() -> None:
    one = result([1.0, 1.001])
    (finding,) = answer_of(difference(one, json.loads(json.dumps(one)))).findings
    assert finding.key == "alike"
    assert finding.words.values["places"] == "2 places"


def test_another_datum_is_said_and_nothing_moved() -> None:
    one = result([1.0, 1.001])
    other = result([1.0, 1.001, 1.4])
    other["datum"] |= {"kind": "free", "names": ["B"]}
    document = difference(one, other)
    assert document.common == "datum"
    assert not any(p.moved for p in document.places)


def test_posterior_covariances_are_taken_back_first() -> None:
    values = [1.0, 1.004, 1.002, 0.996, 1.0005]
    prior = difference(result(values[:2]), result(values))
    posterior = difference(result(values[:2], posterior=True), result(values, posterior=True))
    assert place(posterior).difference_sigma == pytest.approx(place(prior).difference_sigma)


def test_moved_is_said_as_seldom_as_stated() -> None:
    """Of 60 clean pairs 5 %: 3 with a sigma of 1.7; 13 once in a hundred thousand times."""
    rng, count = np.random.default_rng(8), 0
    for _ in range(60):
        values = 1 + 1e-3 * rng.standard_normal(4)
        count += place(difference(result(values[:2]), result(values))).moved
    assert count <= 12
    values = np.array([1.0, 1.0, 1.02, 1.02])
    document = difference(result(values[:2]), result(values))
    assert place(document).moved
    # both places are tested, each with its share of 5 %
    assert place(document).limit == pytest.approx(chi2.ppf(0.95**0.5, 1))
    assert "shifted beyond the limit: B by 10.00 mm (test" in said(document)["moved"]


def turned_on(shift, share, sigma=2e-3):
    """A nested pair: the second result has a variance less by ``share``, and a height shifted."""
    one, other = result([1.0, 1.001]), result([1.0, 1.001, 1.002])
    for data, factor in ((one, 1.0), (other, 1 - share)):
        covariance = np.diag([0.0, 0.0, sigma**2 * factor])
        data["points"]["B"] |= {"covariance": covariance.tolist()}
    other["points"]["B"]["xyz"][2] = one["points"]["B"]["xyz"][2] + shift
    return {"one": one, "two": other}


def test_what_is_left_of_equal_variances_is_no_test() -> None:
    """0.03 mm over a sigma of 2.8 um that two linearisations left: 115 would be a moved point."""
    pair = turned_on(3e-5, 2e-6)
    document = difference(pair["one"], pair["two"])
    found = place(document)
    assert (found.tested, found.freedom, found.moved) == (False, 0, False)
    words = said(document)
    assert {"untold", "nested"} <= words.keys()
    assert words["largest_share"].values["most[0]"] == pytest.approx(0.015, abs=1e-4)
    rows = next(t for t in answer_of(document).tables if t.name == "places").rows
    assert "cannot be told" in [cell.text for row in rows for cell in row.cells]


def test_a_sigma_of_micrometres_is_below_what_coordinates_are_exact_to() -> None:
    """Half of a variance of (2 um)^2 is no measure of a shift of 20 um."""
    pair = turned_on(2e-5, 0.5, sigma=2e-6)
    assert place(difference(pair["one"], pair["two"])).freedom == 0


def test_no_test_of_a_nested_pair_exceeds_the_change_of_the_weighted_sum() -> None:
    """The values agree to 1.5 in the weighted sum: a test of 100 is not one of the measurements."""
    pair = turned_on(0.0141421, 0.5)
    pair["one"]["sigma0"]["vtpv"], pair["two"]["sigma0"]["vtpv"] = 0.5, 2.0
    assert place(difference(pair["one"], pair["two"])).freedom == 0
    pair["two"]["sigma0"]["vtpv"] = 101.0
    found = place(difference(pair["one"], pair["two"]))
    assert (found.freedom, found.moved) == (1, True)
    assert found.test == pytest.approx(100, rel=1e-3)


def test_states_values_and_edits_are_told() -> None:
    one = result([1.0, 1.001, 1.002])
    other = json.loads(json.dumps(one))
    rows = other["observations"]
    rows[0] |= {"state": "off", "reason": "wrong staff"}
    rows[1]["value"] += 0.01
    other["edits"] = [{"id": "x", "action": "off", "reason": "wrong staff", "by": "me"}]
    document = difference(one, other)
    changes = [(o.change, o.states) for o in document.observations]
    assert changes == [("state", ("active", "off")), ("value", ("active", "active"))]
    assert document.observations[0].reason == "wrong staff"
    assert [e["reason"] for e in document.edits_only_second] == ["wrong staff"]
    assert {t.name for t in answer_of(document).tables} == {"places", "changed", "edits"}


def test_the_command_takes_folders_and_writes_json(tmp_path) -> None:
    content = scanner_content()
    for name in ("one", "two"):
        (tmp_path / name / "out").mkdir(parents=True)
        (tmp_path / name / "out" / "result.json").write_text(json_result.dumps(content))
    target = tmp_path / "diff.json"
    call = ["diff", str(tmp_path / "one"), str(tmp_path / "two" / "out"), "--json", str(target)]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output
    data = json.loads(target.read_text())
    assert data["common"] == "same"
    assert data["observations"] == []
    assert {p["name"] for p in data["places"] if p["what"] == "station"} == {"S0", "S1"}


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"observations": [], "points": 3}', "x"])
def test_what_is_no_result_is_said_in_a_sentence(content: str, tmp_path) -> None:
    bad = tmp_path / "result.json"
    bad.write_text(content)
    done = CliRunner().invoke(app, ["diff", str(bad), str(bad)])
    assert done.exit_code == 2
    assert "Traceback" not in done.output
    assert done.output.count("\n") <= 2


def test_a_result_with_holes_is_refused() -> None:
    one = result([1.0, 1.001])
    for key in ("sigma0", "datum", "stations", "observations"):
        with pytest.raises(InputError):
            difference({k: v for k, v in one.items() if k != key}, one)
    broken = json.loads(json.dumps(one))
    broken["points"]["B"]["covariance"] = [[1.0]]
    with pytest.raises(InputError):
        difference(one, broken)
