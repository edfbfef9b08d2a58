"""Every writer keeps coordinates of the size of UTM to half of the stated step."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.scans.scan_files import whole
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import WRITERS, create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.scan.scan import Field

STEPS = st.sampled_from([1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3])
EAST, NORTH, UP = st.floats(1e5, 9e5), st.floats(0.0, 1e7), st.floats(-400.0, 8800.0)
NUMBER = (Field("number", "int32"),)


def read_back(path: Path, header: CloudHeader, parts: list[np.ndarray]) -> np.ndarray:
    """Points written in parts and read, in the order in which they were written."""
    done = 0
    with create(path, header) as writer:
        for xyz in parts:
            writer.write(xyz, {"number": np.arange(done, done + len(xyz), dtype=np.int32)})
            done += len(xyz)
    (scan,) = read_scans(path)
    found = whole(scan)
    number = np.asarray(found.values["number"], dtype=np.int64)
    assert sorted(number) == list(range(done))
    out = np.empty((done, 3))
    out[number] = found.xyz
    return out


@pytest.mark.parametrize("suffix", sorted(WRITERS))
@settings(max_examples=12, deadline=None)
@given(EAST, NORTH, UP, STEPS, st.integers(0, 2**32 - 1), st.lists(st.integers(1, 60), max_size=3))
def test_coordinates_come_back_to_half_a_step(
    suffix: str, e: float, n: float, u: float, step: float, seed: int, sizes: list[int]
) -> None:
    rng, middle = np.random.default_rng(seed), np.array([e, n, u])
    parts = [middle + rng.uniform(-300, 300, (size, 3)) for size in (1, *sizes)]
    xyz = np.concatenate(parts)
    header = CloudHeader("a", NUMBER, step, np.round(middle, -2))
    with tempfile.TemporaryDirectory() as folder:
        found = read_back(Path(folder) / f"a{suffix}", header, parts)
    # a float64 of ten million metres is known to 2e-9
    limit = 0.0 if suffix == ".ply" else step / 2 + 4e-9
    assert np.abs(found - xyz).max() <= limit


@settings(max_examples=12, deadline=None)
@given(EAST, NORTH, UP, STEPS, st.integers(0, 2**32 - 1))
def test_points_in_the_scanner_frame_come_back_through_their_pose(
    e: float, n: float, u: float, step: float, seed: int
) -> None:
    """E57 keeps them there: a rotation makes of half a step along each axis at most its root 3."""
    rng = np.random.default_rng(seed)
    pose = Pose(rotation.exp(rng.normal(size=3)), np.array([e, n, u]))
    xyz = rng.uniform(-300, 300, (50, 3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.e57"
        found = read_back(path, CloudHeader("a", NUMBER, step, pose=pose), [xyz])
        (scan,) = read_scans(path)
    assert scan.pose is not None
    off = np.linalg.norm(scan.pose @ found - pose @ xyz, axis=1)
    assert off.max() <= np.sqrt(3) * step / 2 + 4e-9
