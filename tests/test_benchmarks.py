"""Benchmarks load on this tree: their times are nobody's test, their imports are."""

import runpy
from pathlib import Path

import pytest

PEERS = ("py4dgeo", "small_gicp")
FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.stem)
def test_it_loads(file, monkeypatch):
    """What it imports of ours is there; peers need not be installed."""
    monkeypatch.syspath_prepend(str(FOLDER))
    try:
        loaded = runpy.run_path(str(file), run_name="loaded")
    except ModuleNotFoundError as error:
        if error.name not in PEERS:
            raise
        pytest.skip(f"{error.name} is not installed")
    assert loaded["__doc__"]
