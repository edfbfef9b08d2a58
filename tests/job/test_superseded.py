"""Clouds of an earlier grouping or format go, and nothing else does."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from tests.job.cloud_jobs import made, opened, placed
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.keeping import STATE_FOLDER as FOLDER

WORK = OutputFrame(WorkFrame())


@pytest.fixture
def scans(tmp_path: Path) -> list:
    """Two scans of a few points."""
    for name in ("S1", "S2"):
        with create(tmp_path / f"{name}.las", CloudHeader(name)) as writer:
            writer.write(np.random.default_rng(0).uniform(-5, 5, (300, 3)), {})
    return opened(tmp_path / "S1.las", tmp_path / "S2.las")


def run(scans: list, out: Path, **wish: object) -> set[str]:
    """The files in the folder of clouds after a run."""
    made(scans, placed(scans), WORK, out, **wish)
    return {p.name for p in (out / "clouds").iterdir()}


def test_another_grouping_and_format(scans: list, tmp_path: Path) -> None:
    out = tmp_path / "out"
    alone = run(scans, out, format="laz")
    assert len(alone) == 2
    assert run(scans, out, format="laz", merged=True) == {"cloud.laz"}
    assert run(scans, out, format="ply", merged=True) == {"cloud.ply"}
    assert run(scans, out, format="laz") == alone
    for sign in ("cloud-*.json", "file-cloud-*.json"):
        assert len(list((out / FOLDER).glob(sign))) == 2


def test_what_was_changed_or_put_there_stays(scans: list, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first, second = sorted(run(scans, out, format="las"))
    cloud = out / "clouds" / first
    cloud.write_bytes(cloud.read_bytes()[:-1] + b"x")
    (out / "clouds" / "mine.laz").write_bytes(b"mine")
    (out / "clouds" / second).rename(tmp_path / "kept.las")
    (out / "clouds" / second).symlink_to(tmp_path / "kept.las")
    left = run(scans, out, format="laz", merged=True)
    assert left == {first, second, "mine.laz", "cloud.laz"}
    assert (tmp_path / "kept.las").is_file()


def test_a_file_of_the_same_size_and_another_date_stays(scans: list, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first, _ = sorted(run(scans, out, format="las"))
    os.utime(out / "clouds" / first, ns=(1, 1))
    assert run(scans, out, format="laz", merged=True) == {first, "cloud.laz"}


def test_the_cloud_of_a_scan_that_the_project_has_no_longer_stays(
    scans: list, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    alone = run(scans, out, format="las")
    assert run(scans[:1], out, format="las") == alone
    merged = run(scans, out, format="laz", merged=True)
    assert merged == {"cloud.laz"}
    # what holds more scans than now is not taken the place of
    assert len(run(scans[:1], out, format="las")) == 2


@pytest.mark.parametrize("name", ["../../outside.las", "..", "", "/etc/hostname", "a\0b"])
def test_records_lead_nowhere_else(scans: list, tmp_path: Path, name: str) -> None:
    out, outside = tmp_path / "out", tmp_path / "outside.las"
    outside.write_bytes(b"12345")
    run(scans, out, format="las")
    for record in (out / FOLDER).glob("file-cloud-*.json"):
        data = json.loads(record.read_text())
        data["files"] = [5]
        data["facts"] |= {"file": name, "date": outside.stat().st_mtime_ns}
        record.write_text(json.dumps(data))
    run(scans, out, format="laz", merged=True)
    assert outside.read_bytes() == b"12345"


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"facts": 1, "files": [3]}'])
def test_damaged_records_remove_nothing(scans: list, tmp_path: Path, text: str) -> None:
    out = tmp_path / "out"
    alone = run(scans, out, format="las")
    for record in (out / FOLDER).glob("*cloud-*.json"):
        record.write_text(text)
    assert run(scans, out, format="laz", merged=True) == {*alone, "cloud.laz"}
