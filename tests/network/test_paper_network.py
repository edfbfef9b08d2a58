"""The network of Sabzali & Pilgrim (2023): what they must have done, and what it is worth.

Expected figures are those of an independent reconstruction (method section 4.3; AC-14, 16, 17, 18).
"""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.network.test_rank_defects import S2, paper_network, paper_targets, polar
from tribrach.calibration.minimum_norm import adjust_minimum_norm
from tribrach.calibration.run_comparison import compare_runs
from tribrach.calibration.self_calibration import CalibrationOptions, SelfCalibration, calibrate
from tribrach.cli import app
from tribrach.errors import InputError, RankDefect
from tribrach.instruments.calibration import PAPER_EIGHT_ELEVATION
from tribrach.io.survey.csv.file import read_table
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment
from tribrach.project import Project
from tribrach.questions.calibrate.project import calibrate_project, calibrations_of
from tribrach.units import SEC

FOLDER = Path(__file__).parents[2] / "examples" / "paper-network"
RUN = CliRunner()


def figures(a: Adjustment) -> dict[str, float]:
    """Sigmas in mm and arc seconds by name."""
    pose = np.sqrt(np.maximum(np.diag(a.covariance("S2")), 0))
    out = dict(zip(("X_S", "Y_S", "Z_S"), 1e3 * pose[:3], strict=True))
    out |= dict(zip(("omega", "phi", "kappa"), pose[3:] / SEC, strict=True))
    for parameter in PAPER_EIGHT_ELEVATION.parameters:
        unit = 1e3 if parameter in ("E_R", "a1", "a2", "a4") else 1 / SEC
        for k in (1, 2):
            variance = a.covariance(f"{parameter}(S{k})")[0, 0]
            out[f"{parameter}{k}"] = unit * float(np.sqrt(variance))
    return out


def run(name: str) -> SelfCalibration:
    return calibrate_project(open_job(FOLDER / f"{name}.toml"), lambda *_: None)


def rho(a: Adjustment, first: str, second: str, column: int) -> float:
    """Correlation of a scalar with a component of station 2."""
    cross = a.covariance(first, second)[0, column]
    return float(cross / np.sqrt(a.covariance(first)[0, 0] * a.covariance(second)[column, column]))


#: column "sim" of method table 4.3, to the digits that it prints
PLAIN = {
    "omega": 26.6, "phi": 6.4, "kappa": 1.15, "X_S": 0.12, "Y_S": 0.35, "Z_S": 0.43,
    "E_R1": 0.23, "E_R2": 0.23, "E_H1": 1.6, "E_H2": 1.15, "E_V1": 18, "E_V2": 17,
    "a1_1": 0.23, "a2_1": 1.3, "a2_2": 0.43, "a4_1": 0.043, "a5_1": 0.37,
}  # fmt: skip


def test_minimum_norm_gives_the_published_pattern() -> None:
    """AC-16: every sigma as printed, which is to one per cent or to half of its last digit."""
    a = adjust_minimum_norm(paper_network(PAPER_EIGHT_ELEVATION))
    assert a.defect == 8
    found = figures(a)
    for name, expected in PLAIN.items():
        half = 0.5 * 10.0 ** -len(str(expected).partition(".")[2])
        sigma = found[name.replace("_1", "1").replace("_2", "2") if name[0] == "a" else name]
        assert sigma == pytest.approx(expected, abs=max(half, 0.01 * expected)), name


def test_one_component_fixed_moves_the_heading() -> None:
    """AC-17."""
    a = adjust_minimum_norm(paper_network(PAPER_EIGHT_ELEVATION, fixed=(1,)))
    found = figures(a)
    expected = {"kappa": 29.90, "X_S": 1.839, "E_H1": 59.87, "E_H2": 29.90}
    for name, sigma in expected.items():
        assert found[name] == pytest.approx(sigma, rel=2e-3), name
    assert abs(rho(a, "E_H(S1)", "S2", 0)) == pytest.approx(0.998, abs=5e-4)
    assert abs(rho(a, "E_R(S1)", "S2", 5)) == pytest.approx(0.893, abs=1e-3)


def test_minimum_norm_is_the_pseudo_inverse() -> None:
    network = paper_network(PAPER_EIGHT_ELEVATION)
    a = adjust_minimum_norm(network)
    design = a.design.toarray()
    expected = np.linalg.pinv(design.T @ design, rcond=1e-13, hermitian=True)
    size = np.sqrt(np.diag(expected))
    index = np.arange(len(size))
    mine = a.cofactor.entries(np.repeat(index, len(size)), np.tile(index, len(size)))
    difference = mine.reshape(expected.shape) - expected
    assert np.abs(difference / np.outer(size, size)).max() < 1e-5


def test_the_example_is_the_recipe() -> None:
    table = read_table(FOLDER / "targets.csv")
    values = table.columns("range", "horizontal", "zenith")
    x = paper_targets()
    expected = np.concatenate([polar(x), polar(x - S2)])
    np.testing.assert_allclose(values, expected, atol=1e-8)


def test_as_printed_it_is_refused_in_eight_sentences() -> None:
    """AC-14 through the program."""
    result = RUN.invoke(app, ["calibrate", str(FOLDER / "refused.toml")])
    assert result.exit_code == 2
    text = result.output
    assert "8 combinations of unknowns cannot be determined" in text
    assert text.count("cannot be separated") == 8
    assert "E_R(S1) is to be left out: it acts like a1(S1)" in text
    assert "the back face of every target would make estimable" in text


def test_three_experiments_one_command_each() -> None:
    plain = run("no_constraint")
    assert figures(plain.adjustment)["kappa"] == pytest.approx(1.15, abs=0.005)
    one, two = run("one_constraint"), run("two_constraints")
    assert figures(one.adjustment)["kappa"] == pytest.approx(29.90, abs=0.01)
    assert figures(two.adjustment)["E_V1"] == pytest.approx(3.7, abs=0.05)
    assert figures(two.adjustment)["a2_1".replace("_", "")] == pytest.approx(0.26, abs=0.005)
    compared = compare_runs(plain, one)
    assert compared.datum_only
    np.testing.assert_allclose(compared.distances, 1.0, atol=1e-6)  # AC-18
    assert any("choice of the datum alone" in s for s in compared.sentences())
    assert not compare_runs(plain, two).datum_only  # the tilt is information


def test_a_known_base_improves_the_range_zero_twice() -> None:
    plain, known = run("no_constraint"), run("base_length")
    compared = compare_runs(plain, known)
    assert not compared.datum_only
    ratio = {line.name: line.ratio for line in compared.lines}
    assert 1 / ratio["E_R(S1)"] > 2.0
    assert max(r for r in ratio.values() if np.isfinite(r)) < 1 + 1e-6
    assert compared.distances.max() < 1 + 1e-6


def test_commands_as_documented(tmp_path: Path) -> None:
    files = [tmp_path / "one.json", tmp_path / "one.html"]
    result = RUN.invoke(
        app,
        [
            "calibrate",
            str(FOLDER / "one_constraint.toml"),
            "--against",
            str(FOLDER / "no_constraint.toml"),
            "--json",
            str(files[0]),
            "--html",
            str(files[1]),
        ],
    )
    assert result.exit_code == 0, result.output
    assert "nothing estimable changed" in result.output
    assert "minimum norm over metres and radians" in result.output
    page = files[1].read_text()
    assert page.count("<figure") == 4
    assert page.count('class="dots s1"') == 9


def test_a_minimum_norm_says_what_it_is_and_is_not_saved() -> None:
    project = Project.load(FOLDER / "no_constraint.toml")
    job = open_job(project)
    found = calibrate_project(job, lambda *_: None)
    assert any("depends on these units" in words for words in found.adjustment.warnings)
    with pytest.raises(InputError, match="single stations"):
        calibrations_of(job, found)


def test_with_zenith_angles_and_what_can_be_separated() -> None:
    """The set that the refusal offers can be estimated."""
    network = paper_network(PAPER_EIGHT_ELEVATION)
    with pytest.raises(RankDefect) as caught:
        calibrate(network)
    offered = next(s for s in caught.value.sentences if s.startswith("these can be estimated"))
    found = calibrate(network, CalibrationOptions(reduce=True))
    assert set(found.names) == set(offered.split(": ")[1].split(", "))
    assert found.adjustment.defect == 0
