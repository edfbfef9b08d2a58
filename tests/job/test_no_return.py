"""Beams without return in a project: left out once for everything, counted in the report."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.scan.in_memory import shell
from tribrach.cli import app
from tribrach.io.scans.formats import read_scans
from tribrach.job.opened import open_job
from tribrach.job.scans import StationScan, open_scans
from tribrach.job.state import Remembered
from tribrach.job.visits import visit

BEAMS = 60
PROJECT = """\
[instruments.A]
range_mm = 1
scan_angle_arcsec = 10
levelling_arcsec = 3
[stations.S1]
levelled = true
[[points]]
file = "points.csv"
role = "fixed"
[[observations]]
file = "targets.csv"
instrument = "A"
[[scans]]
file = "S1.xyz"
instrument = "A"
"""


def written(folder: Path, more: str = "") -> Path:
    """A scan of 4000 points at 2 to 9 m, some on a shell of 40 m, from a station at 10, 20, 5."""
    rng = np.random.default_rng(1)
    points = rng.uniform(2, 5, (4000, 3))
    both = np.concatenate([points, shell(BEAMS, 40.0), np.zeros((5, 3))])
    np.savetxt(folder / "S1.xyz", both, "%.6f", header="x y z", comments="")
    names, rows = [], ["point,x_m,y_m,z_m"]
    for name, r, h, v in (("P", 10, 20, 90), ("Q", 12, 110, 80), ("R", 9, 200, 95)):
        names.append(f"S1,{name},{r},{h},{v}")
        h, v = np.radians(h), np.radians(v)
        at = r * np.array([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)]) + [10, 20, 5]
        rows.append(",".join([name, *(f"{x:.5f}" for x in at)]))
    (folder / "points.csv").write_text("\n".join(rows) + "\n")
    head = "station,target,range_m,horizontal_deg,zenith_deg"
    (folder / "targets.csv").write_text("\n".join([head, *names]) + "\n")
    path = folder / "p.toml"
    path.write_text(PROJECT + more)
    return path


def test_they_are_counted_and_in_no_cloud(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["run", str(written(tmp_path)), "-q"])
    assert result.exit_code == 0, result.output
    report = json.loads((tmp_path / "out" / "result.json").read_text())
    (beams,) = report["scans"]["no_return"]
    assert (beams["scan"], beams["points"], beams["zeros"]) == ("S1", BEAMS + 5, 5)
    assert beams["in_shell"] == BEAMS
    assert beams["shell"] == pytest.approx(40, abs=0.05)
    assert beams["share"] == pytest.approx((BEAMS + 5) / (4005 + BEAMS))
    (cloud,) = report["scans"]["clouds"]
    assert cloud["points"] == 4000
    (scan,) = read_scans(tmp_path / "out" / "clouds" / cloud["file"])
    assert sum(len(chunk) for chunk in scan.chunks()) == 4000
    assert "Beams without return" in (tmp_path / "out" / "report.html").read_text()


def opened(project: Path, state: Remembered) -> list[StationScan]:
    """The scans of a project, screened, and nothing else done."""
    scans = open_scans(open_job(project), state)
    return visit(scans, lambda _: (), lambda _: (), state=state, progress=lambda *_: None)


def test_they_are_sought_once_and_kept_on_wish(tmp_path: Path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    state = Remembered(tmp_path / "out")
    (first,) = opened(written(tmp_path), state)
    monkeypatch.setattr(type(first.scan), "stored", lambda *_: pytest.fail("the scan is read"))
    (again,) = opened(tmp_path / "p.toml", state)
    assert again.scan.no_return == first.scan.no_return
    assert first.scan.no_return is not None
    (kept,) = opened(written(tmp_path, 'no_return = "keep"\n'), state)
    assert kept.scan.no_return is None
