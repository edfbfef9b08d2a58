"""The figure, command and chapter that docs/extending.md adds: two files each, nothing else."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_check_cli import SIGMAS, THREE, polar_table
from tests.instruments.field_surveys import readings
from tests.way_of_a_direction import traverse

ROOT = Path(__file__).resolve().parents[2]
FIGURE, COMMAND, CHAPTER = (
    (ROOT / "docs" / "extending" / f"{name}.diff").read_text()
    for name in ("figure", "command", "chapter")
)


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package with all changes, and a table of readings."""
    folder = tmp_path_factory.mktemp("changed")
    shutil.copytree(
        ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__", "static")
    )
    for text in (FIGURE, COMMAND, CHAPTER):
        subprocess.run(["git", "apply", "-"], cwd=folder, input=text, text=True, check=True)
    (folder / "t.csv").write_text(polar_table(readings(np.random.default_rng(3), series=THREE)))
    return folder


def tribrach(folder: Path, *words: str) -> str:
    code = "import sys; sys.path.insert(0, 'src'); from tribrach.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_a_figure_is_two_files(changed: Path) -> None:
    assert len(re.findall(r"^\+\+\+ ", FIGURE, re.MULTILINE)) == 2
    out = tribrach(changed, "check", "t.csv", *SIGMAS, "--json", "c.json", "--html", "c.html")
    ranges = json.loads((changed / "c.json").read_text())["two_face"]["ranges"]
    assert ranges == pytest.approx([12.0, 50.0], abs=0.3)
    said = f"at {ranges[0]:.1f} to {ranges[1]:.1f} m"
    assert said in " ".join(out.split())
    page = (changed / "c.html").read_text().replace("&nbsp;", " ")
    assert said in " ".join(page.split())


def test_a_command_is_two_files(changed: Path) -> None:
    assert len(re.findall(r"^\+\+\+ ", COMMAND, re.MULTILINE)) == 2
    out = tribrach(changed, "ranges", "t.csv", "--json", "r.json", "--html", "r.html")
    stations = json.loads((changed / "r.json").read_text())["stations"]
    assert [one["station"] for one in stations] == ["inside", "outside"]
    assert f"{stations[1]['longest']:.2f}" in out
    assert "ranges" in tribrach(changed, "--help")


def test_a_chapter_is_two_files(changed: Path) -> None:
    assert len(re.findall(r"^\+\+\+ ", CHAPTER, re.MULTILINE)) == 2
    files = [path.name for path in traverse(changed)]
    tribrach(changed, "adjust", *files, "--json", "a.json", "--html", "a.html", "-q")
    longest = json.loads((changed / "a.json").read_text())["longest_sights"]
    assert longest[0]["length"] == max(one["length"] for one in longest)
    assert "Longest sights" in (changed / "a.html").read_text()
