"""The ladder of examples: every one runs, and says what its own first lines promise."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
def test_example_runs(path: Path, tmp_path: Path) -> None:
    settings = os.environ | {"MPLBACKEND": "agg", "PYTHONUTF8": "1", "COLUMNS": "200"}
    out = subprocess.run(
        [sys.executable, "-W", "error", str(path), str(tmp_path / "out")],
        capture_output=True, text=True, check=False, cwd=tmp_path, env=settings,
    )  # fmt: skip
    assert out.returncode == 0, out.stderr
    assert PROMISES[path.name[:2]] in out.stdout
