"""Where approximate poses come from, and that a project uses them as the command does."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import points_of, yard
from tribrach import pipeline
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.scans.formats import read_scans
from tribrach.job.approximate_poses import approximate_poses
from tribrach.scan.scan import Scan
from tribrach.simulate.setups import levelled


def at(x: float) -> Pose:
    return Pose(np.eye(3), np.array([x, 0.0, 0.0]))


def tiny(folder: Path, *names: str) -> dict[str, Scan]:
    """Scans of a few points."""
    for name in names:
        np.savetxt(folder / f"{name}.xyz", np.random.default_rng(1).normal(0, 5, (50, 3)))
    return {name: read_scans(folder / f"{name}.xyz")[0] for name in names}


def test_lists_go_before_files_beside_and_these_before_headers(tmp_path: Path) -> None:
    scans = tiny(tmp_path, "A", "B")
    for scan, x in zip(scans.values(), (1.0, 2.0), strict=True):
        object.__setattr__(scan, "pose", at(x))
    found = approximate_poses(scans)
    assert found.poses["B"].translation[0] == 2.0
    assert "in the headers" in found.origin
    for name, x in (("A", 3.0), ("B", 4.0)):
        np.savetxt(tmp_path / f"{name}_pose.txt", at(x).matrix)
    assert approximate_poses(scans).poses["B"].translation[0] == 4.0
    listed = tmp_path / "list.txt"
    np.savetxt(listed, [at(x).matrix[:3].ravel() for x in (5.0, 6.0)])
    assert approximate_poses(scans, [listed]).poses["B"].translation[0] == 6.0
    (sentence,) = approximate_poses(scans, [listed]).sentences
    assert "approximate poses of 2 scans (list.txt: a matrix in each line" in sentence
    assert "0.25 m and 1.25 degrees" in sentence
    folder = approximate_poses(scans, [tmp_path])
    assert folder.poses["A"].translation[0] == 3.0
    with pytest.raises(InputError, match="A has a second pose here"):
        approximate_poses(scans, [tmp_path, listed])
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="there is no pose of any of the scans here"):
        approximate_poses(scans, [empty])


def test_poses_that_scans_share_say_nothing(tmp_path: Path) -> None:
    scans = tiny(tmp_path, "A", "B", "C")
    for name, x in (("A", 0.0), ("B", 0.0), ("C", 7.0)):
        np.savetxt(tmp_path / f"{name}_pose.txt", at(x).matrix)
    assert set(approximate_poses(scans).poses) == {"C"}


def test_poses_of_an_earlier_registration(tmp_path: Path) -> None:
    scans = tiny(tmp_path, "A", "B")
    rows = [
        {"scan": n, "file": f"{n}.xyz", "world_from_scanner": at(x).matrix.tolist()}
        for n, x in (("A", 1.0), ("B", 9.0), ("Z", 0.0))
    ]
    path = tmp_path / "poses.json"
    path.write_text(json.dumps({"scans": rows}))
    found = approximate_poses(scans, [path])
    assert set(found.poses) == {"A", "B"}
    assert found.poses["B"].translation[0] == 9.0


def test_a_project_takes_lists_of_poses(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    poses = []
    for k, (x, y, heading) in enumerate(((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5))):
        poses.append(levelled((x, y, 1.6), heading, 5e-5, rng))
        np.savetxt(tmp_path / f"S{k}.xyz", points_of(yard(), poses[k], 20_000, k), fmt="%.4f")
    np.savetxt(tmp_path / "list.txt", [p.matrix[:3].ravel() for p in poses])
    project = tmp_path / "yard.toml"
    text = """
[[scans]]
file = "S0.xyz"

[[scans]]
file = "S1.xyz"

[datum]
kind = "free"

[cloud]
write = false

[registration]
by = ["clouds"]
pose_sigma_m = 0.5
"""
    project.write_text(text + 'poses = ["nowhere.txt"]\n')
    with pytest.raises(InputError, match=r"yard\.toml:\d+: there is no file or folder nowhere"):
        pipeline.run(project)
    project.write_text(text + 'poses = ["list.txt"]\n')
    content = pipeline.run(project)
    said = [s for chapter in content.chapters for s in chapter.sentences]
    assert any(s.startswith("Approximate poses of 2 scans (list.txt") for s in said)
    state = content.adjustment.state
    one, two = (Pose(state.pose_r[k], state.pose_t[k]) for k in (0, 1))
    off = (one.inverse @ two).translation - (poses[0].inverse @ poses[1]).translation
    assert np.linalg.norm(off) < 2e-3
