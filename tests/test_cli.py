"""The command line: results for good input, one sentence and status 2 for bad input."""

import json
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
import typer
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.cli.commands import COMMANDS

RUN = CliRunner()

CONTROL = "point,e_m,n_m,u_m\nA,0,0,0\nB,100,0,0\n"
SIGHTS = (
    "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
    "A,P,50.001,2\nB,P,111.804,2\nA,Q,70.712,2\nB,Q,70.709,2\nP,Q,50.002,2\n"
)
PROJECT = """
title = "Test"
[[points]]
file = "control.csv"
role = "fixed"
[[points]]
file = "start.csv"
role = "approximate"
[[observations]]
file = "sights.csv"
"""
START = "point,e_m,n_m,u_m\nP,0,50,0\nQ,50,50,0\n"

GKF = """<?xml version="1.0" ?>
<gama-local xmlns="http://www.gnu.org/software/gama/gama-local">
<network axes-xy="en">
<parameters sigma-apr="1"/>
<points-observations>
<point id="A" z="10.0" fix="z"/>
<point id="B" adj="z"/>
<height-differences>
<dh from="A" to="B" val="1.000" stdev="1.0"/>
<dh from="A" to="B" val="1.001" stdev="1.0"/>
</height-differences>
</points-observations>
</network>
</gama-local>
"""


def levelling(tmp_path: Path, text: str = GKF) -> Path:
    path = tmp_path / "net.gkf"
    path.write_text(text)
    return path


def fails(*arguments: object) -> str:
    """Standard error of a call that must end with 2 and one sentence."""
    result = RUN.invoke(app, [str(a) for a in arguments])
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    assert len(lines) >= 1
    return result.stderr


def project(tmp_path: Path, **files: str) -> Path:
    """A plane network of two control and two new points; files may be replaced."""
    content = {"project": PROJECT, "control": CONTROL, "start": START, "sights": SIGHTS} | files
    for name, text in content.items():
        (tmp_path / (f"{name}.toml" if name == "project" else f"{name}.csv")).write_text(text)
    return tmp_path / "project.toml"


def test_adjust_writes_json_html_and_text(tmp_path: Path) -> None:
    files = {kind: tmp_path / f"result.{kind}" for kind in ("json", "html", "text")}
    options = [word for kind, path in files.items() for word in (f"--{kind}", str(path))]
    result = RUN.invoke(app, ["adjust", str(levelling(tmp_path)), *options])
    assert result.exit_code == 0, result.output
    data = json.loads(files["json"].read_text())
    assert data["schema"] == 2
    assert data["points"]["B"]["xyz"][2] == pytest.approx(11.0005, abs=1e-9)
    assert data["points"]["B"]["covariance"][2][2] == pytest.approx(0.5e-6, rel=1e-9)
    assert data["observations"][0]["source"] == "net.gkf:9"
    assert data["observations"][0]["id"].endswith(":net.gkf:1")
    assert "datum" in files["text"].read_text().lower()
    assert files["html"].read_text().lstrip().lower().startswith("<!doctype html")


def test_posterior_scales_the_covariances(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    RUN.invoke(app, ["adjust", str(levelling(tmp_path)), "--posterior", "--json", str(path), "-q"])
    # v^T P v / r = 0.5 for the two readings 1 mm apart
    found = json.loads(path.read_text())["points"]["B"]["covariance"][2][2]
    assert found == pytest.approx(0.25e-6, rel=1e-6)


def test_quiet_prints_nothing(tmp_path: Path) -> None:
    assert RUN.invoke(app, ["adjust", str(levelling(tmp_path)), "-q"]).output == ""


def test_version() -> None:
    assert RUN.invoke(app, ["--version"]).output.startswith("tribrach 0")


def test_datum_free_and_unknown_names(tmp_path: Path) -> None:
    path = levelling(tmp_path)
    assert RUN.invoke(app, ["adjust", str(path), "--datum", "free"]).exit_code == 0
    assert "Q7" in fails("adjust", path, "--datum", "free:A,Q7")
    assert "datum" in fails("adjust", path, "--datum", "nonsense")


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('<point id="B" adj="z"/>', '<point id="B" adj="z"/><point id="B" adj="z"/>', 7, "twice"),
        ('val="1.001" stdev="1.0"', 'val="1.001"', 10, "standard deviation"),
        ('val="1.001" stdev="1.0"', 'val="1.001" stdev="-1.0"', 10, "above zero"),
        ('val="1.001" stdev="1.0"', 'val="1.001" stdev="0"', 10, "above zero"),
        ('val="1.001"', 'val="nan"', 10, "number"),
        ('val="1.001"', 'val="12a"', 10, "number"),
        ("</network>", "", 14, "XML"),
        ("<gama-local", '<!DOCTYPE x [<!ENTITY a "b">]>\n<gama-local', 2, "entities"),
    ],
)
def test_bad_gama_files(tmp_path: Path, old: str, new: str, line: int, words: str) -> None:
    path = levelling(tmp_path, GKF.replace(old, new))
    said = fails("adjust", path)
    assert words in said
    assert f"net.gkf:{line}" in said


def test_covariance_that_is_not_positive_definite(tmp_path: Path) -> None:
    matrix = '<cov-mat dim="2" band="1"> 1 2 1 </cov-mat></height-differences>'
    said = fails("adjust", levelling(tmp_path, GKF.replace("</height-differences>", matrix)))
    assert "positive definite" in said
    assert "net.gkf:11" in said


def test_wrong_encoding_and_missing_files(tmp_path: Path) -> None:
    path = tmp_path / "sights.csv"
    path.write_bytes(b"from,to\nM\x81hle,B")
    said = fails("adjust", path)
    assert "UTF-8" in said
    assert "sights.csv:2" in said
    assert "no such file" in fails("adjust", tmp_path / "absent.gkf")
    (tmp_path / "x.foo").write_text("x")
    assert "no known format" in fails("adjust", tmp_path / "x.foo")


def test_no_redundancy_is_said(tmp_path: Path) -> None:
    text = GKF.replace('<dh from="A" to="B" val="1.001" stdev="1.0"/>\n', "")
    assert "nothing is checked" in fails("adjust", levelling(tmp_path, text))


def test_project_runs(tmp_path: Path) -> None:
    result = RUN.invoke(app, ["run", str(project(tmp_path)), "--out", str(tmp_path / "out")])
    # distances in plan alone say nothing of heights
    assert result.exit_code == 0, result.output
    assert "Heights are not observed: the network is adjusted in plan." in result.output
    assert (tmp_path / "out" / "report.html").is_file()


LEVELS = (
    "from,to,height_difference_m,sigma_height_difference_mm\n"
    "A,P,1.001,1\nP,B,-1.000,1\nB,P,1.002,1\n"
)
LEVEL_PROJECT = """
title = "Levelling"
[[points]]
file = "control.csv"
role = "fixed"
[[points]]
file = "start.csv"
role = "fixed"
[[observations]]
file = "levels.csv"
"""


def level_project(tmp_path: Path, **files: str) -> Path:
    """Levelling to P whose plan position is control."""
    start = "point,e_m,n_m,u_m\nP,5,5,\n"
    files = {"project": LEVEL_PROJECT, "levels": LEVELS, "start": start} | files
    return project(tmp_path, **files)


def test_levelling_project(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = RUN.invoke(app, ["run", str(level_project(tmp_path)), "--out", str(out)])
    assert result.exit_code == 0, result.output
    data = json.loads((out / "result.json").read_text())
    assert data["points"]["P"]["xyz"][2] == pytest.approx(1.001, abs=1e-9)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("levels", "height_difference_m", "hight_difference_m", "height_difference"),
        ("levels", "sigma_height_difference_mm", "sigma_height_difference_furlong", "furlong"),
        ("levels", "A,P,1.001,1", "A,P,1.001,0", "levels.csv:2"),
        ("levels", "A,P,1.001,1", "A,P,1.001,-1", "levels.csv:2"),
        ("levels", "A,P,1.001,1", "A,P,nan,1", "levels.csv:2"),
        ("levels", "A,P,1.001,1", "A,P,1.0.01,1", "levels.csv:2"),
        ("levels", "A,P,1.001,1", "A,P,1.001", "levels.csv:2"),
        ("control", "B,100,0,0", "A,100,0,0", "A"),
        ("project", 'title = "Levelling"', 'tittle = "Levelling"', "tittle"),
        ("project", 'role = "fixed"', 'role = "fixd"', "role"),
        ("project", 'file = "levels.csv"', 'file = "nowhere.csv"', "nowhere.csv"),
        ("project", "[[points]]", "[[points", "TOML"),
    ],
)
def test_bad_projects(tmp_path: Path, file: str, old: str, new: str, words: str) -> None:
    source = {"levels": LEVELS, "control": CONTROL, "project": LEVEL_PROJECT}[file]
    assert old in source
    path = level_project(tmp_path, **{file: source.replace(old, new, 1)})
    said = fails("run", path, "--out", tmp_path / "out")
    assert words in said
    assert not (tmp_path / "out").exists()


def test_station_observed_by_nothing(tmp_path: Path) -> None:
    text = LEVEL_PROJECT + "\n[stations.S9]\nlevelled = true\n"
    assert "S9" in fails("run", level_project(tmp_path, project=text))


def _helps(command: click.Command) -> Iterator[str]:
    """Every text of help of a command and of those below it."""
    command = getattr(command, "loaded", command)
    yield command.help or ""
    for parameter in command.params:
        yield getattr(parameter, "help", None) or ""
    for other in getattr(command, "commands", {}).values():
        yield from _helps(other)


def test_no_help_is_taken_for_markup() -> None:
    """Units in brackets would vanish from what the terminal shows."""
    for text in _helps(typer.main.get_command(app)):
        assert "[" not in text, text


def test_commands_are_listed_as_a_job_needs_them() -> None:
    group = typer.main.get_command(app)
    names = group.list_commands(click.Context(group))  # type: ignore[attr-defined]
    assert names[:4] == ["init", "check-project", "run", "demo"]
    assert sorted(names) == sorted(group.commands)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_do_what_their_list_says(name: str) -> None:
    listed = typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
    command = listed.loaded
    assert (command.name or name) == name
    assert command.help.splitlines()[0] == listed.help


def test_the_list_of_commands_loads_none_of_them() -> None:
    """Half a second of imports before a word of help would be too long."""
    code = (
        "import sys; from typer.testing import CliRunner; from tribrach.cli import app\n"
        "said = CliRunner().invoke(app, ['--help']); assert said.exit_code == 0, said.output\n"
        "print([n for n in ('numpy', 'scipy', 'numba', 'matplotlib') if n in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_no_command_loads_what_only_some_runs_need() -> None:
    """Charts, readers of formats and scipy.stats are loaded when they are needed, or never."""
    modules = sorted({module for module, _ in COMMANDS.values()})
    code = (
        f"import sys; from importlib import import_module\n"
        f"for name in {modules}: import_module('tribrach.' + name)\n"
        "print([n for n in ('matplotlib', 'scipy.stats', 'polars', 'laspy') if n in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_a_small_network_loads_nothing_that_it_does_not_use(tmp_path: Path) -> None:
    """Loading is most of the time of ten observations: what is asked for is loaded, and no more."""
    benchmark = Path(__file__).parents[1] / "benchmarks" / "start_up.py"
    (tmp_path / "ten.gkf").write_text(runpy.run_path(str(benchmark))["TEN"])
    code = (
        "import sys; from typer.testing import CliRunner; from tribrach.cli import app\n"
        "command = ['adjust', 'ten.gkf', '--json', 'a.json', '--text', 'a.txt']\n"
        "said = CliRunner().invoke(app, command); assert said.exit_code == 0, said.output\n"
        "theirs = 'numba llvmlite polars matplotlib laspy jinja2 rich.progress'.split()\n"
        "theirs += ['scipy.' + n for n in 'stats optimize spatial interpolate'.split()]\n"
        "ours = 'pipeline scan targets comparison cloud gnss io.scans io.clouds report.html'\n"
        "ours = ['tribrach.' + n for n in (ours + ' project.model').split()]\n"
        "print([n for n in ours + theirs if n in sys.modules])"
    )
    command = [sys.executable, "-c", code]
    out = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
