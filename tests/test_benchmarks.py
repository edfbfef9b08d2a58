"""Benchmarks load on this tree, and the small ones run; their times are nobody's test."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks.__main__ import NAMES
from benchmarks.figures import Cost, Figure, Growth, as_line, from_line
from benchmarks.guard import grown
from benchmarks.page import write_page

FOLDER = Path(__file__).parents[1] / "benchmarks"
#: modules that measure nothing
OTHERS = {"__init__", "__main__", "figures", "gnss_baseline", "guard", "network_files", "page"}

FOUND = Figure("reading", "10 points", Cost(1.0, 3.0, 90.0), "peer", Cost(2.0, 2.0, 50.0), "alike")
MISSING = Figure("reading", "10 points", Cost(1.0, 3.0), "other", None)
GROWTH = Growth("reading", "points", (10.0, 100.0), (1.0, 10.0))


def test_every_module_is_listed():
    assert {file.stem for file in FOLDER.glob("*.py")} - OTHERS == set(NAMES)


@pytest.mark.parametrize("name", [*NAMES, "gnss_baseline", "network_files"])
def test_it_loads(name):
    """What it imports of ours is there; peers need not be installed."""
    loaded = importlib.import_module(f"benchmarks.{name}")
    assert loaded.__doc__
    assert hasattr(loaded, "measure") == (name in NAMES)


def test_figures_come_back():
    for found in (FOUND, MISSING, GROWTH):
        assert from_line(as_line(found)) == found
    assert FOUND.ratio() == 0.5
    assert FOUND.ratio("processor") == 1.5
    assert MISSING.ratio() is None
    assert GROWTH.exponent() == pytest.approx(1.0)


def test_guard_tells_what_grew(tmp_path):
    limits = tmp_path / "guard.toml"
    limits.write_text("[some]\nreading = 1.4\nwriting = 2.0\n", encoding="utf-8")
    told = grown({"some": [FOUND, MISSING, GROWTH]}, limits)
    assert told == [
        "some, reading: 1.50 times peer, the limit in guard.toml is 1.4",
        "some: guard.toml has a limit for 'writing', which is not measured",
    ]
    limits.write_text("[some]\nreading = 1.6\n", encoding="utf-8")
    assert grown({"some": [FOUND]}, limits) == []


def test_page(tmp_path):
    page = tmp_path / "benchmarks.md"
    write_page(page, {"some": [FOUND, MISSING, GROWTH]})
    text = page.read_text(encoding="utf-8")
    assert "| reading | 10 points | peer | 0.5 | 1.5 | 1 | 2 | 90 / 50 | alike |" in text
    assert "not installed" in text
    assert "points^1.00" in text


@pytest.mark.parametrize("name", ["point_covariance", "start_values"])
def test_small_sizes_run(name):
    command = [sys.executable, "-m", f"benchmarks.{name}", "--small"]
    out = subprocess.run(command, cwd=FOLDER.parent, check=True, capture_output=True, text=True)
    for line in out.stdout.splitlines():
        assert json.loads(line)["kind"] in ("Figure", "Growth")
