"""The ladder of examples: every one runs, and says what its own first lines promise."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.demo_twin import few_boards
from tribrach import demo

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
#: a line that each must print, by its number
PROMISES = {
    "00": "<point B, free: 100.0040 - - m, sigma 1.41 - - mm a priori>",
    "01": "height_difference:P:Q:line 2:1: residual -1.20 mm, MDB 9.2 mm, redundancy 0.30",
    "02": "stands at field.book:13",
    "03": "give more control coordinates, heights, an azimuth or GNSS",
    "04": "<station S2: ",
    "05": "horizontal_dist",
    "06": "carried over with sigma",
    "07": "5 targets: station",
    "08": "levelling.gkf:7",
    "09": "written: ",
    "11": "mean of 1000000 points: sigma 0.78 mm, floor 0.78",
    "10": "<point VLBI, free: 1.2002 -0.8000 11.5001 m, sigma 0.15 0.15 0.15 mm a priori>",
}
LADDER = sorted(EXAMPLES.glob("[0-9][0-9]_*.py"))


def test_the_ladder_has_no_missing_rung() -> None:
    assert [path.name[:2] for path in LADDER] == sorted(PROMISES)


@pytest.mark.parametrize("path", LADDER, ids=lambda path: path.stem)
def test_example_runs(
    path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As Python runs it, but in this process, which has loaded already what all of them load."""
    monkeypatch.setattr("sys.argv", [str(path), str(tmp_path / "out")])
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "build", few_boards)
    runpy.run_path(str(path), run_name="__main__")
    assert PROMISES[path.name[:2]] in capsys.readouterr().out


def test_an_example_is_a_program_of_its_own(tmp_path: Path) -> None:
    path = LADDER[0]
    command = [sys.executable, "-W", "error", str(path)]
    out = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert out.returncode == 0, out.stderr
    assert PROMISES[path.name[:2]] in out.stdout
