"""Benchmarks load on this tree: their times are nobody's test, their imports are."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.stem)
def test_it_loads(file, monkeypatch):
    """What it imports is there; peers are imported only when it runs."""
    monkeypatch.syspath_prepend(str(FOLDER))
    assert runpy.run_path(str(file), run_name="loaded")["__doc__"]
