"""The kind that docs/extending.md adds works everywhere, with nothing but what the page shows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DIFF = (ROOT / "docs" / "extending" / "kind.diff").read_text()

#: runs in a process of its own, where the package of kinds has one file more
PREPARE = """
import sys
import tribrach.observations as package
package.__path__.append(sys.argv[1])
from tribrach.observations.gradients import Gradients
"""

JACOBIAN = """
import tests.observations.examples as examples
examples.BUILDERS["gradient"] = {example}
from tests.observations import test_contract as contract
assert Gradients in contract.KINDS
for test in (
    contract.test_every_kind_has_an_example,
    contract.test_jacobian_is_the_derivative,
    contract.test_misclosure_is_observed_minus_computed,
    contract.test_every_observation_has_ends_with_names,
    contract.test_every_kind_answers_every_question,
    contract.test_index_fields_say_what_they_refer_to,
    contract.test_start_ties_are_what_the_kind_says,
    contract.test_a_required_end_must_be_there,
):
    test(kind=Gradients)
"""

READING = """
from pathlib import Path
import numpy as np
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust

folder = Path(sys.argv[2])
survey = read_files([folder / "points.csv", folder / "sights.csv"])
adjustment = adjust(survey.network())
heights = dict(zip(adjustment.layout.names["point"], adjustment.state.points[:, 2]))
# instrument at 1.5 m, target at 1.3 m: B = 10 + 1.5 + 0.0112 * 100 - 1.3
assert abs(heights["B"] - 11.32) < 1e-9, heights
# 100 ppm over 100 m, twice measured
sigma = np.sqrt(adjustment.covariance("B")[2, 2])
assert abs(sigma - 0.01 / np.sqrt(2)) < 1e-6, sigma
"""

PLANNING = """
from pathlib import Path
import numpy as np
from tribrach.geometry import rotation
from tribrach.io.survey.csv.planned import PLANNED, read_planned
from tribrach.io.survey.csv.reader import Context
from tribrach.network.adjustment import adjust
from tribrach.network.contributions import by_category, contributions
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.planning.prediction import Criterion
from tribrach.planning.weights import needed_sets, reading_groups

points = {"A": (0.0, 0.0, 10.0), "B": (0.0, 100.0, 11.0), "C": (80.0, 40.0, 12.0)}
places = {name: np.array(xyz) for name, xyz in points.items()}
planned, scans = read_planned(Path(sys.argv[2]) / "plan.csv", Context(), places)
(table,) = planned.tables()
assert table.kind is Gradients
assert np.isclose(table.columns["covariance"][0, 0, 0], 1e-8)
assert "gradient" in PLANNED and not scans

survey, t, turn = Survey(), np.array([20.0, 30.0, 10.0]), rotation.exp(np.array([0, 0, 0.4]))
survey.station("S", translation=t, rotation=turn)
for name, xyz in places.items():
    survey.point(name, xyz, covariance=1e-6 * np.eye(3), role="control")
    survey.add(TargetCentres, values=(xyz - t) @ turn, sigma=0.002, station=["S"], target=[name])
    e, n, u = xyz - t
    survey.add(Gradients, values=u / np.hypot(e, n), sigma=1e-4, start=["S"], end=[name])
network = survey.network()
shares = by_category(contributions(adjust(network), "S"))
assert set(shares) == {"control", "own targets", "backsight"}, set(shares)
assert ("gradient", "1", [0], "gradient") in reading_groups(network)
assert set(needed_sets(network, Criterion("sigma", ("S",)), 1e-4, most=2).sets) == {"S"}
"""

FILES = {
    "points.csv": "point,e_m,n_m,u_m,role\nA,0,0,10,fixed\nB,0,100,,fixed\n",
    "sights.csv": (
        "from,to,gradient_percent,sigma_gradient_ppm,height_instrument_m,height_target_m\n"
        "A,B,1.12,100,1.5,1.3\nA,B,1.12,100,1.5,1.3\n"
    ),
    "plan.csv": "from,to,kind,sigma_gradient_ppm\nA,B,gradient,100\n",
}


def added() -> dict[str, str]:
    """Lines that the page adds, by file."""
    parts = re.split(r"^--- .*\n\+\+\+ b/(.*)\n", DIFF, flags=re.MULTILINE)[1:]
    files = zip(parts[::2], parts[1::2], strict=True)
    return {
        name: "".join(line[1:] + "\n" for line in text.splitlines() if line.startswith("+"))
        for name, text in files
    }


def run(script: str, folder: Path) -> str:
    (folder / "kinds").mkdir()
    (folder / "kinds" / "gradients.py").write_text(
        added()["src/tribrach/observations/gradients.py"]
    )
    for name, text in FILES.items():
        (folder / name).write_text(text)
    result = subprocess.run(
        [sys.executable, "-c", PREPARE + script, str(folder / "kinds"), str(folder)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])},
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_a_kind_takes_two_files() -> None:
    assert list(added()) == [
        "src/tribrach/observations/gradients.py",
        "tests/observations/examples.py",
    ]


@pytest.mark.parametrize("script", [READING, PLANNING], ids=["reading", "planning"])
def test_everybody_asks_the_kind(script: str, tmp_path: Path) -> None:
    run(script, tmp_path)


def test_it_answers_the_contract(tmp_path: Path) -> None:
    example = added()["tests/observations/examples.py"].split(": ", 1)[1].rstrip().rstrip(",")
    example = example.replace("sights(", "examples.sights(")
    run(JACOBIAN.replace("{example}", example), tmp_path)


def test_a_report_states_ratios_with_their_units(tmp_path: Path) -> None:
    script = """
from typer.testing import CliRunner
from tribrach.cli import app

files = [f"{sys.argv[2]}/points.csv", f"{sys.argv[2]}/sights.csv"]
result = CliRunner().invoke(app, ["adjust", *files, "--text", f"{sys.argv[2]}/report.txt"])
assert result.exit_code == 0, result.output
print(open(f"{sys.argv[2]}/report.txt").read())
"""
    text = run(script, tmp_path)
    rows = [line for line in text.splitlines() if "gradient" in line and " A " in line]
    row = next(line for line in rows if " % " in line)
    assert "1.1200 %" in row
    assert "100.00 ppm" in row
