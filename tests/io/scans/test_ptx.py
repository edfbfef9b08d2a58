"""PTX: pose, grid, directions without return, and whatever a header may get wrong."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.io.scans.scan_files import lines, same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

R = Rotation.from_euler("zyx", [0.7, -0.3, 0.2]).as_matrix()
T = np.array([590_123.456, 2_331_000.25, 12.5])


def header(
    columns: int, rows: int, r: np.ndarray = R, t: np.ndarray = T, matrix: np.ndarray | None = None
) -> str:
    """The ten lines: position, axes in rows, matrix for x y z 1 in a row."""
    m = np.eye(4)
    m[:3, :3], m[3, :3] = r.T, t
    return lines(str(columns), str(rows), [t], r.T, m if matrix is None else matrix).removesuffix(
        "\n"
    )


def points(n: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.hstack(
        [rng.uniform(-30, 30, (n, 3)), rng.uniform(0, 1, (n, 1)), rng.integers(0, 256, (n, 3))]
    )


def test_pose_grid_and_colours(tmp_path: Path) -> None:
    p = points(15)
    p[4, :3] = p[11, :3] = 0
    path = written(tmp_path, "a b.1.ptx", lines(header(5, 3), p))
    (scan,) = read_scans(path)
    assert (scan.name, scan.records, scan.grid, scan.origin) == ("a b.1", 15, (3, 5), "stated")
    assert scan.names == ("intensity", "red", "green", "blue", "row", "column")
    assert scan.pose is not None
    assert np.abs(scan.pose.rotation - R).max() < 1e-12
    assert np.array_equal(scan.pose.translation, T)
    assert scan.pose @ p[0, :3] == pytest.approx(np.append(p[0, :3], 1) @ _matrix(), abs=1e-9)
    got = whole(scan, 4)
    kept = np.delete(np.arange(15), [4, 11])
    assert got.dropped == 2
    assert np.array_equal(got.xyz, p[kept, :3])
    assert np.array_equal(got.values["row"], kept % 3)
    assert np.array_equal(got.values["column"], kept // 3)
    assert np.array_equal(got.values["red"], 257 * p[kept, 4])
    assert np.array_equal(got.values["intensity"], p[kept, 3].astype(np.float32))
    same(whole(scan, 100, start=7), whole(scan, 2, start=7))
    assert np.array_equal(whole(scan, 100, start=7).xyz, p[kept[kept >= 7], :3])


def _matrix() -> np.ndarray:
    return np.vstack([R.T, T])


def test_several_scans_without_returns_windows_ends(tmp_path: Path) -> None:
    a, b = points(6, 1)[:, :4], points(4, 2)
    nothing = "0 0 0 0.500000"  # shorter than the lines with colours
    text = lines(header(2, 3), a) + "\n" + lines(header(5, 1, np.eye(3), -T), nothing, b)
    (first, second) = read_scans(written(tmp_path, "s.ptx", text.replace("\n", "\r\n")))
    assert (first.name, second.name, second.index) == ("s", "s-2", 1)
    assert np.array_equal(whole(first).xyz, a[:, :3])
    got = whole(second, 3)
    assert np.array_equal(got.xyz, b[:, :3])
    assert got.dropped == 1
    assert np.array_equal(got.values["column"], [1, 2, 3, 4])
    assert second.pose is not None
    assert np.array_equal(second.pose.translation, -T)


def test_the_two_poses_must_agree(tmp_path: Path) -> None:
    other = np.eye(4)
    other[3, :3] = T + np.array([0, 0, 0.5])
    path = written(tmp_path, "a.ptx", lines(header(1, 2, matrix=other), points(2)))
    (scan,) = read_scans(path)
    assert scan.origin == "unknown"
    assert "contradict the 4x4 matrix (by 0.5 m" in scan.warnings[0]
    silent = header(1, 2, np.eye(3), np.zeros(3), other)
    (scan,) = read_scans(written(tmp_path, "b.ptx", lines(silent, points(2))))
    assert scan.origin == "stated"
    assert scan.pose is not None
    assert np.array_equal(scan.pose.translation, other[3, :3])


def test_points_that_are_placed_already_have_no_scanner(tmp_path: Path) -> None:
    p = points(2)
    p[:, :3] += T
    text = lines(header(1, 2, np.eye(3), np.zeros(3)), p)
    (scan,) = read_scans(written(tmp_path, "a.ptx", text))
    assert scan.origin == "unknown"
    assert "2405 km" in scan.warnings[0]


@pytest.mark.parametrize(
    ("turn", "words"),
    [
        (np.diag([1, 1, 2.0]), "scales or shears"),
        (np.diag([1, 1, -1.0]), "mirrors"),
        (np.array([[1, 0.2, 0], [0, 1, 0], [0, 0, 1]]), "scales or shears"),
    ],
)
def test_no_rigid_motion_is_a_sentence(tmp_path: Path, turn: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_scans(written(tmp_path, "a.ptx", lines(header(1, 2, turn), points(2))))


def test_counts_must_fit(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="states 6 points and the file holds 5"):
        read_scans(written(tmp_path, "a.ptx", lines(header(2, 3), points(5))))
    with pytest.raises(InputError, match="scan before may have more points"):
        read_scans(written(tmp_path, "a.ptx", lines(header(2, 2), points(5))))
    with pytest.raises(InputError, match="states 1000000000000000000 points"):
        read_scans(written(tmp_path, "a.ptx", lines(header(10**9, 10**9), points(5))))
    with pytest.raises(InputError, match="ends within the header"):
        read_scans(written(tmp_path, "a.ptx", "2\n3\n0 0 0\n"))
    (scan,) = read_scans(written(tmp_path, "a.ptx", header(0, 0) + "\n"))
    assert scan.records == len(whole(scan)) == 0


def test_a_malformed_line_is_named(tmp_path: Path) -> None:
    good = lines(header(2, 3), points(6)).splitlines()
    bad = [*good[:12], "", "1 2 three 0.5 1 2 3", *good[13:]]
    (scan,) = read_scans(written(tmp_path, "a.ptx", "\n".join(bad)))
    with pytest.raises(InputError, match=r"a\.ptx:14: 'three' is no number"):
        whole(scan)


@pytest.mark.data
def test_real_ones(shared_data: Path) -> None:
    folder = shared_data / "scans/formats/pdal_tiny"
    (scan,) = read_scans(folder / "complex-transform.ptx")
    assert (len(whole(scan)), whole(scan).dropped, scan.origin) == (4, 8, "stated")
    assert scan.pose is not None
    assert scan.pose.translation == pytest.approx([-3.028748, -3.819741, -1.384333])
    assert scan.pose.rotation[:, 0] == pytest.approx([0.999979, -0.003604, -0.005365], abs=1e-5)
    assert not scan.warnings
    (scan,) = read_scans(folder / "1.2-with-color.ptx")
    assert (scan.name, len(whole(scan)), scan.grid) == ("1.2-with-color", 1065, (71, 15))
    (scan,) = read_scans(folder / "no-color.ptx")
    assert len(whole(scan)) == 15
    with pytest.raises(InputError, match="scales or shears"):
        read_scans(folder / "multiple-and-transform.ptx")
