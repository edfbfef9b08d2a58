"""Benchmarks load on this tree, and the small ones run; their times are nobody's test."""

import importlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from benchmarks.__main__ import NAMES
from benchmarks.figures import Cost, Figure, Growth, as_line, from_line
from benchmarks.guard import grown
from benchmarks.page import write_page
from benchmarks.record import Machine, Measured, Watch, keep, kept

FOLDER = Path(__file__).parents[1] / "benchmarks"
#: modules that measure nothing
OTHERS = {
    "__init__",
    "__main__",
    "figures",
    "gnss_baseline",
    "guard",
    "network_files",
    "page",
    "record",
}

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


HERE = Machine("a processor, 2 cores", "Linux", "numpy 2.0")


def measured(name: str, others: float, found: list[Figure | Growth]) -> Measured:
    return Measured(name, "full", HERE, "abc", "2026-01-02 03:04", 90.0, 0.5, others, found)


def test_page(tmp_path):
    page = tmp_path / "benchmarks.md"
    runs = {"some": measured("some", 0.7, [FOUND, MISSING, GROWTH])}
    write_page(page, HERE, runs, ["some", "another"])
    text = page.read_text(encoding="utf-8")
    ratios = (tmp_path / "measured" / "ratios.csv").read_text(encoding="utf-8")
    assert "reading,10 points,peer,0.5,1.5,1,2,90 / 50,alike" in ratios
    assert "not installed" in ratios
    assert "points^1.00" in (tmp_path / "measured" / "growth.csv").read_text(encoding="utf-8")
    assert "{insert: measured measured/ratios.csv}" in text
    assert "began, which count what ran before: 0.5 to 0.5." in text
    assert "* abc: `some`\n" in text
    assert "Not measured: `another`." in text
    assert "not idle" in text
    write_page(page, HERE, {"some": measured("some", 0.02, [FOUND])}, ["some"])
    text = page.read_text(encoding="utf-8")
    assert "not idle" not in text
    assert "Not measured" not in text


def test_runs_are_kept_and_replaced(tmp_path):
    """Those of another machine, or with other libraries, do not stand beside ours."""
    file = tmp_path / "build" / "kept.jsonl"
    assert kept(file, HERE) == {}
    one, two = measured("one", 0.1, [FOUND, MISSING]), measured("two", 0.2, [GROWTH])
    elsewhere = Machine(HERE.machine, HERE.system, "numpy 2.1")
    keep(file, [one, two])
    assert kept(file, HERE) == {"one": one, "two": two}
    assert kept(file, elsewhere) == {}


def test_load_of_others_leaves_out_ones_own():
    """A second of this process alone is nobody else's: at most the machine less one processor."""
    watch = Watch()
    end = time.process_time() + 0.5
    while time.process_time() < end:
        pass
    found = watch.measured("some", "full", [FOUND])
    assert found.found == [FOUND]
    assert found.seconds >= 0.5
    assert found.others is None or 0 <= found.others <= os.cpu_count() - 0.5 / found.seconds + 0.2


@pytest.mark.parametrize("name", ["point_covariance", "start_values"])
def test_small_sizes_run(name):
    command = [sys.executable, "-m", f"benchmarks.{name}", "--small"]
    out = subprocess.run(command, cwd=FOLDER.parent, check=True, capture_output=True, text=True)
    for line in out.stdout.splitlines():
        assert json.loads(line)["kind"] in ("Figure", "Growth")
