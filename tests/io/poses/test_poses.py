"""Poses beside scans: every format by hand-made files whose truth is computed another way."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.poses.formats import assigned, beside, read_pose_list

TRUE = Pose(
    Rotation.from_euler("ZYX", [40, -3, 5], degrees=True).as_matrix(), np.array([3.0, -7.5, 1.25])
)


def same(found: Pose, true: Pose, off: float = 1e-9) -> None:
    np.testing.assert_allclose(found.matrix, true.matrix, atol=off)


def matrix_text(pose: Pose, rows: int = 4) -> str:
    return "\n".join(" ".join(f"{v:.12f}" for v in row) for row in pose.matrix[:rows]) + "\n"


@pytest.mark.parametrize("rows", [3, 4])
def test_a_matrix_in_lines(tmp_path: Path, rows: int) -> None:
    path = tmp_path / "S1_pose.txt"
    path.write_text("# world from scanner\n" + matrix_text(TRUE, rows))
    found = read_pose_list(path)
    same(found.poses[0], TRUE)
    assert found.frames is None
    same(beside(["S1", "S2"], tmp_path)["S1"].poses[0], TRUE)


def test_riscan_positions_are_found_by_the_beginning_of_the_name(tmp_path: Path) -> None:
    other = Pose(np.eye(3), np.array([1.0, 2.0, 3.0]))
    (tmp_path / "ScanPos001.DAT").write_text(matrix_text(TRUE).replace("\n", "\r\n"))
    (tmp_path / "ScanPos010.DAT").write_text(matrix_text(other))
    found = beside(["ScanPos001 - 151012", "ScanPos010", "ScanPos100"], tmp_path)
    assert set(found) == {"ScanPos001 - 151012", "ScanPos010"}
    same(found["ScanPos001 - 151012"].poses[0], TRUE)
    same(found["ScanPos010"].poses[0], other)


def test_data_of_others_beside_a_scan_are_no_error(tmp_path: Path) -> None:
    """STAR*NET writes .dat too; a .pose that is none is one."""
    (tmp_path / "S1.dat").write_text("C A 100.0 200.0 !\nD A-B 12.3\n")
    assert beside(["S1"], tmp_path) == {}
    (tmp_path / "S1.pose").write_text("0 0 0\n0 0 east\n")
    with pytest.raises(InputError, match=r"S1\.pose:2: 'east' is no number of a pose"):
        beside(["S1"], tmp_path)


def test_3dtk_by_points_of_both_frames(tmp_path: Path) -> None:
    """Points carried in the left-handed frame are the same points carried in the right-handed."""
    angles = np.array([3.0, -40.0, 5.0])
    shift = np.array([120.0, -30.0, 750.0])
    path = tmp_path / "scan000.pose"
    path.write_text(f"{shift[0]} {shift[1]} {shift[2]}\n{angles[0]} {angles[1]} {angles[2]}\n")
    (pose,) = read_pose_list(path).poses
    p = np.random.default_rng(1).normal(0, 10, (20, 3))

    def left(xyz: np.ndarray) -> np.ndarray:
        return 100 * np.stack([-xyz[:, 1], xyz[:, 2], xyz[:, 0]], axis=1)

    # entries of the toolkit's matrix, written out: cy cz, -cy sz, sy in its first row
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    turn = np.array(
        [
            [cy * cz, -cy * sz, sy],
            [sx * sy * cz + cx * sz, -sx * sy * sz + cx * cz, -sx * cy],
            [-cx * sy * cz + sx * sz, cx * sy * sz + sx * cz, cx * cy],
        ]
    )
    np.testing.assert_allclose(left(pose @ p), left(p) @ turn.T + shift, atol=1e-9)
    # ahead is x, up is z: z of the file is ahead, y up, x to the right
    np.testing.assert_allclose(pose.translation, [7.5, -1.2, -0.3], atol=1e-12)


def kitti_line(pose: Pose) -> str:
    return " ".join(f"{v:.12e}" for v in pose.matrix[:3].ravel())


def chain() -> list[Pose]:
    return [Pose(np.eye(3), np.array([2.0 * k, 0.0, 0.0])) @ TRUE for k in range(12)]


def test_kitti_by_number_and_by_order(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(map(kitti_line, chain())))
    listed = read_pose_list(path)
    assert listed.frames == tuple(range(12))
    by_number = assigned(["000010", "000005"], listed)
    same(by_number["000010"], chain()[10], 1e-8)
    same(by_number["000005"], chain()[5], 1e-8)
    names = list("ABCDEFGHIJKL")
    same(assigned(names, listed)["C"], chain()[2], 1e-8)
    with pytest.raises(InputError, match="12 poses, there are 2 scans"):
        assigned(["north", "south"], listed)


def test_frames_before_the_matrices(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(f"{7 * k + 1} {kitti_line(p)}" for k, p in enumerate(chain())))
    listed = read_pose_list(path)
    same(assigned(["s8", "s15"], listed)["s15"], chain()[2], 1e-8)
    path.write_text(f"1.5 {kitti_line(TRUE)}\n")
    with pytest.raises(InputError, match=r"poses\.txt:1: 1\.5 is no number of a frame"):
        read_pose_list(path)


def test_poses_of_the_camera_are_carried_to_the_scanner(tmp_path: Path) -> None:
    """A scanner 0.3 m above and behind a camera that looks along its x."""
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    camera_from_scanner = Pose(turn, np.array([0.01, -0.08, -0.27]))
    (tmp_path / "calib.txt").write_text(f"P0: 1 0 0\nTr: {kitti_line(camera_from_scanner)}\n")
    cameras = [TRUE @ p @ camera_from_scanner.inverse for p in chain()]
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(map(kitti_line, cameras)))
    found = read_pose_list(path).poses
    for k in (1, 5):
        same(found[0].inverse @ found[k], chain()[0].inverse @ chain()[k], 1e-8)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", "last row is not 0 0 0 1"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n3 4 5 1\n", "stands transposed"),
        ("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "scales or shears"),
        ("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "mirrors"),
        ("1 2 3 4 5\n", "lines with 5 numbers are no poses"),
        ("1 0 0 nan\n0 1 0 0\n0 0 1 0\n", "'nan' is no number of a pose"),
        ("1 0 0 1e300\n0 1 0 0\n0 0 1 0\n", "'1e300' is no number of a pose"),
        ("\n# nothing\n", "the file has no numbers"),
        (kitti_line(TRUE) + "\n1 2 3\n", "the line has 3 numbers and the first one has 12"),
    ],
)
def test_what_is_no_pose_is_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "S1_pose.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_pose_list(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_pose_of_nobody_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "S7_pose.txt"
    path.write_text(matrix_text(TRUE))
    with pytest.raises(InputError, match="the pose is named S7, and so is no scan"):
        assigned(["S1", "S2"], read_pose_list(path))


@pytest.mark.data
def test_a_relative_pose_of_a_real_sweep(shared_data: Path) -> None:
    (pose,) = read_pose_list(shared_data / "scans" / "spinning_lidar" / "relative.txt").poses
    assert np.linalg.norm(pose.translation) == pytest.approx(0.4974, abs=1e-3)
