"""A scan whose scanner stands elsewhere than at zero."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.scan.prepared import seen_from
from tribrach.scan.scan import Field, Scan

AT = (590_100.0, 2_331_000.0, 25.0)


@pytest.fixture
def scan(tmp_path: Path) -> Scan:
    """Points around a far place, with a field."""
    xyz = np.random.default_rng(0).uniform(-30, 30, (1000, 3)) + AT
    header = CloudHeader("a", (Field("gain", "float32"),), 1e-4, np.array(AT))
    with create(tmp_path / "a.las", header) as writer:
        writer.write(xyz, {"gain": np.arange(1000, dtype=np.float32)})
    return read_scans(tmp_path / "a.las")[0]


def test_points_begin_at_the_scanner(scan: Scan) -> None:
    moved = seen_from(scan, AT)
    assert (scan.origin, moved.origin, moved.scanner) == ("unknown", "stated", AT)
    ours, theirs = list(moved.chunks(300, 100)), list(scan.chunks(300, 100))
    assert [len(c) for c in ours] == [len(c) for c in theirs] == [300, 300, 300]
    for a, b in zip(ours, theirs, strict=True):
        assert np.array_equal(a.xyz, b.xyz - AT)
        assert np.array_equal(a.values["gain"], b.values["gain"])
    assert np.array_equal(moved.bounds, scan.bounds - AT)
    assert (moved.name, moved.path, moved.records, moved.names) == (
        scan.name, scan.path, scan.records, scan.names,
    )  # fmt: skip


def test_poses_carry_points_to_the_same_place(scan: Scan) -> None:
    pose = Pose(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3]))
    placed = replace(scan, pose=pose, origin="stated")
    moved = seen_from(placed, AT)
    (a,), (b,) = moved.chunks(), placed.chunks()
    assert moved.pose is not None
    assert np.abs(moved.pose @ a.xyz - pose @ b.xyz).max() < 1e-8
    # points that were placed in spite of the pose are not placed twice
    assert seen_from(replace(placed, origin="unknown"), AT).pose is None


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ((np.nan, 0.0, 0.0), "no finite numbers"),
        ((2_331_000.0, 590_100.0, 25.0), "m from the points"),
        ((0.0, 0.0, 0.0), "m from the points"),
    ],
)
def test_places_where_no_scanner_stood(
    scan: Scan, at: tuple[float, float, float], words: str
) -> None:
    with pytest.raises(InputError, match=words) as error:
        seen_from(scan, at)
    assert "a.las" in str(error.value)
