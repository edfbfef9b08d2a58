"""Scans are decoded once for all that is wanted of them, after everything else was checked."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.job.test_no_return import BEAMS, written
from tribrach.errors import InputError
from tribrach.io.scans.xyz import XyzScan
from tribrach.job.find_planes import surroundings
from tribrach.job.find_targets import extract
from tribrach.job.opened import open_job
from tribrach.job.state import Remembered
from tribrach.job.steps import FoundInScans, find
from tribrach.job.surface_samples import SurfaceSamples
from tribrach.project import Project
from tribrach.scan.scan import Chunk
from tribrach.units import MM

WANTED = """\
[targets]
sphere_radius_m = [{radius}]
[registration]
by = ["targets", "planes"]
plane_area_m2 = {area}
"""


def silent(what: str, done: int, total: int | None) -> None:
    """Nobody is told of what is done."""


def found(folder: Path, *, radius: float = 0.1, area: float = 0.5) -> FoundInScans:
    project = written(folder, WANTED.format(radius=radius, area=area))
    return find(open_job(project), folder / "out", silent)


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of scans, one for each time that their points are read from the file."""
    names: list[str] = []
    stored = XyzScan.stored

    def counted(self: XyzScan, *args: Any, **more: Any) -> Iterator[Chunk]:
        names.append(self.name)
        return stored(self, *args, **more)

    monkeypatch.setattr(XyzScan, "stored", counted)
    return names


def records(folder: Path, kind: str) -> dict[str, Any]:
    return json.loads((folder / "out" / ".tribrach" / f"{kind}-S1.json").read_text())


def test_a_scan_is_decoded_once_for_everything(tmp_path: Path, reads: list[str]) -> None:
    (tmp_path / "a").mkdir()
    first = found(tmp_path / "a")
    (scan,) = first.scans
    assert scan.scan.no_return is not None
    assert scan.scan.no_return.in_shell == BEAMS
    # one for the beams without return that there are, to be sure of them, is from memory as well;
    # a block of points for the sample is from the file, which knows where these were
    assert reads == ["S1", "S1"]


def test_what_a_visit_makes_is_what_each_makes_alone(tmp_path: Path, reads: list[str]) -> None:
    first = found(tmp_path)
    before = len(reads)
    floor = Project.load(tmp_path / "p.toml").registration.plane_floor_mm * MM
    alone = Remembered(tmp_path / "alone")
    for state in (first.state, alone):
        extract(first.scans, first.wanted, state, silent)
        surroundings(first.scans, 0.5, floor, state, silent)
        SurfaceSamples(state, silent).of(first.scans)
        # nothing is left to do after a visit
        assert (len(reads) > before) == (state is alone)
    for kind in ("targets", "planes", "surface"):
        one = (tmp_path / "out" / ".tribrach" / f"{kind}-S1.json").read_bytes()
        assert one == (alone.folder / f"{kind}-S1.json").read_bytes(), kind


def test_a_second_run_reads_no_point(tmp_path: Path, reads: list[str]) -> None:
    found(tmp_path)
    reads.clear()
    again = found(tmp_path)
    assert reads == []
    assert again.scans[0].scan.no_return is not None
    assert not again.scans[0].unscreened


def test_a_setting_of_planes_makes_planes_anew(tmp_path: Path) -> None:
    found(tmp_path)
    kept = {kind: records(tmp_path, kind) for kind in ("targets", "planes", "surface")}
    for path in (tmp_path / "out" / ".tribrach").glob("targets-*.json"):
        path.chmod(0o400)
        stamp = path.stat().st_mtime_ns
    found(tmp_path, area=0.8)
    assert path.stat().st_mtime_ns == stamp
    assert records(tmp_path, "targets") == kept["targets"]
    assert records(tmp_path, "surface") == kept["surface"]
    assert records(tmp_path, "planes")["key"] != kept["planes"]["key"]
    found(tmp_path, area=0.8, radius=0.2)
    assert records(tmp_path, "targets")["key"] != kept["targets"]["key"]


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("points.csv", "point,x,y,z\nP,1,2,3\n", "points.csv"),
        ("targets.csv", "station,target,range_m\nS1,P,ten\n", "targets.csv"),
    ],
)
def test_other_files_are_checked_before_a_scan_is_read(
    tmp_path: Path, reads: list[str], file: str, text: str, said: str
) -> None:
    project = written(tmp_path, WANTED.format(radius=0.1, area=0.5))
    (tmp_path / file).write_text(text)
    with pytest.raises(InputError, match=said):
        find(open_job(project), tmp_path / "out", silent)
    assert reads == []


def test_products_before_a_failure_are_kept(tmp_path: Path) -> None:
    project = written(tmp_path, WANTED.format(radius=0.1, area=0.5))
    np.savetxt(tmp_path / "S2.xyz", np.ones((5, 3)), "%.3f", header="x y z", comments="")
    text = project.read_text() + '[[scans]]\nfile = "S2.xyz"\ninstrument = "A"\n'
    project.write_text(text)
    with pytest.raises(InputError, match=r"S2|range image"):
        find(open_job(project), tmp_path / "out", silent)
    assert records(tmp_path, "targets")
    assert records(tmp_path, "planes")
