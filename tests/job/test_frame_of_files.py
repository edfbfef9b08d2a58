"""The frame of registered files is offered, and not left without a word."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.job.first_project import Wishes, compose
from tribrach.job.folder import look_through


def ptx(folder: Path, places: list[tuple[float, float, float]]) -> Path:
    """A file of small scans with poses at these places."""
    rng = np.random.default_rng(1)
    lines = []
    for place in places:
        axes = [" ".join(f"{v:.1f}" for v in row) for row in np.eye(3)]
        where = " ".join(f"{v:.3f}" for v in place)
        lines += ["10", "10", where, *axes, *(f"{axis} 0" for axis in axes), f"{where} 1"]
        lines += [" ".join(f"{v:.4f}" for v in row) for row in rng.uniform(0.1, 0.9, (100, 4))]
    path = folder / "scans.ptx"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("places", "offered"),
    [
        (
            [(691236.5, 5334571.0, 521.6), (691242.6, 5334575.2, 521.5), (691248, 5334572, 522)],
            True,
        ),
        ([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)], False),
    ],
)
def test_init_offers_the_frame_of_poses(
    tmp_path: Path, places: list[tuple[float, float, float]], offered: bool
) -> None:
    ptx(tmp_path, places)
    project = compose(tmp_path, look_through(tmp_path), Wishes())
    assert any("poses of their own" in said for said in project.assumed) == offered
    rows = [line for line in project.text.splitlines() if "-frame,6912" in line]
    assert len(rows) == (3 if offered else 0)
