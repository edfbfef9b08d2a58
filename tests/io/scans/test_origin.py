"""Where the scanner stood, by the points: rows and columns of directions, whatever the format."""

from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import points_of
from tests.registration.plane_scenes import upright
from tribrach.io.scans.formats import read_scans
from tribrach.scan.angular_step import on_lattice
from tribrach.simulate.scene import Scene, box, rectangle


def _face() -> np.ndarray:
    """A rock face, 18 m before the scanner, with steps; nothing nearer."""
    parts = [rectangle((0, 18, 3), (0, -1, 0), 60, 30, 0.4)]
    parts += [box((x, 17.5, z), (3, 1.5, 2), 0.4, 0.2) for x in (-9, 2, 8) for z in (-1, 5)]
    xyz = points_of(Scene.of(parts), upright(0.4, (0, 0, 1.6)), 250_000, 1)
    return xyz[np.linalg.norm(xyz, axis=1) > 12.0]


def _ply(path: Path, xyz: np.ndarray) -> Path:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(xyz)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
    path.write_bytes(head.encode() + xyz.astype("<f8").tobytes())
    return path


@pytest.mark.parametrize(
    ("off", "known"),
    [
        ((0, 0, 0), "assumed"),
        ((8, -45, 3), "unknown"),
        ((2, 15, 1), "unknown"),
        ((3e5, 5e6, 200), "unknown"),
    ],
)
def test_a_face_from_afar(tmp_path: Path, off: tuple[float, ...], known: str) -> None:
    xyz = _face() + np.array(off)
    (scan,) = read_scans(_ply(tmp_path / "a.ply", xyz))
    assert scan.origin == known
    np.savetxt(tmp_path / "a.xyz", xyz, fmt="%.4f")
    assert read_scans(tmp_path / "a.xyz")[0].origin == known


def test_points_in_any_order_are_no_lattice() -> None:
    xyz = _face()
    assert on_lattice(xyz)
    thinned = np.random.default_rng(1).choice(len(xyz), len(xyz) // 10, replace=False)
    assert not on_lattice(xyz[thinned])
    assert not on_lattice(xyz[:100])


def test_the_face_of_others(shared_data: Path) -> None:
    folder = shared_data / "faults" / "scans2" / "11-face-from-afar"
    assert [read_scans(folder / name)[0].origin for name in ("a.ply", "b.ply")] == ["assumed"] * 2
