"""Real scans: three of a rotating lidar, of decimetre class and thin, moved between them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.registration.clouds.scenes import error
from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.prepared import prepare
from tribrach.registration.clouds.together import register_clouds

pytestmark = pytest.mark.data


def points(path: Path) -> np.ndarray:
    """Points of an old VTK file of text."""
    text = path.read_text()
    head, body = text.split("POINTS", 1)
    assert "ASCII" in head
    count = int(body.split(None, 1)[0])
    return np.array(body.split()[2 : 2 + 3 * count], dtype=float).reshape(-1, 3)


def test_all_pairs_converge_to_a_loop_that_closes(shared_data: Path) -> None:
    folder = shared_data / "scans" / "icp_pair"
    clouds = [points(folder / f"cloud.{k:05d}.vtk") for k in range(3)]
    scans = [prepare(f"C{k}", [cloud]) for k, cloud in enumerate(clouds)]
    found = register_clouds(scans)
    assert [p.fit is not None for p in found.pairs] == [True] * 3
    (loop,) = found.consistency.loops
    assert loop.closes, loop.words
    assert loop.shift < 0.1
    assert loop.turn < np.radians(1)
    assert len(found.groups) == 1
    # the vehicle moved by less than half a metre; its scans lie on each other by nearest points
    poses = found.groups[0].poses
    shift, turn = error(poses["C1"], Pose.identity())
    assert shift < 0.5
    assert turn < np.radians(20)
    tree = cKDTree(clouds[0])
    for k in (1, 2):
        placed, _ = tree.query(poses[f"C{k}"] @ clouds[k])
        assert np.median(placed) < 0.9 * np.median(tree.query(clouds[k])[0])
        assert np.median(placed) < 0.2
