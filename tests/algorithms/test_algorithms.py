"""Every command on degenerate clouds, networks and tables: a result that holds, or a sentence."""

import subprocess
import sys

import pytest


def _run(first: int, cases: int) -> None:
    words = [sys.executable, "-m", "tests.algorithms", "--first", str(first), "--cases", str(cases)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout[-6000:]}\n{done.stderr[-3000:]}"


def test_100_cases() -> None:
    _run(0, 100)


@pytest.mark.slow
def test_10000_cases() -> None:
    _run(100, 9900)
