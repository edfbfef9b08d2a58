"""Errors of ranges that neighbours of a simulated scan share."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulate.test_scanner import all_of
from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import scanner as module
from tribrach.simulate import scene as sc
from tribrach.simulate.scanner import ScanGrid, Scanner, scan

NOISE = ScanNoise(0.002, 0.0, 0.0, 0.0)
WALL = sc.Scene.of([sc.rectangle((10, 0, 0), (-1, 0, 0), 30, 30, 0.6)])
POSE = Pose(np.eye(3), np.zeros(3))


def errors(noise: ScanNoise, grid: ScanGrid, seed: int = 1) -> Array:
    """Errors of ranges (rows, columns) over their sigma."""
    out = all_of(scan(WALL, POSE, Scanner(noise, intensity=0), grid, seed))
    error = np.full((grid.rows, grid.columns), np.nan)
    length = np.linalg.norm(out["xyz"], axis=1) - np.linalg.norm(out["truth"], axis=1)
    error[out["row"], out["column"]] = length / noise.range
    return error


def window(v: float, step: float, rows: int, columns: int) -> ScanGrid:
    return ScanGrid(-step * columns / 2, v, step, rows, columns)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_neighbours_share_what_their_discs_have_in_common(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    step, angle = 4e-4, 1.6e-3
    noise = replace(NOISE, shared_share=share, shared_angle=angle)
    grid = window(np.pi / 2 - 0.04, step, 200, 200)
    whole = errors(noise, grid)
    assert np.isfinite(whole).all()
    # 40,000 points, 5 to 8 of them as one
    assert whole.std() == pytest.approx(1.0, abs=0.02)
    assert abs(whole.mean()) < 0.03
    expected = noise.shared.at(10.0)
    for lag in (1, 2, 3, 4, 6):
        true = float(expected.correlation(np.array(lag * step)))
        assert np.mean(whole[lag:] * whole[:-lag]) == pytest.approx(true, abs=0.03)
        assert np.mean(whole[:, lag:] * whole[:, :-lag]) == pytest.approx(true, abs=0.03)
    # blocks fit together: across their borders errors are as alike as elsewhere
    monkeypatch.setattr(module, "_BLOCK", 200 * 10)
    blocks = errors(noise, grid, seed=2)
    across = blocks[:, 10::10] * blocks[:, 9:-1:10]
    assert across.mean() == pytest.approx(
        float(expected.correlation(np.array(step))), abs=4 / np.sqrt(across.size)
    )


def test_columns_are_nearer_to_each_other_towards_the_pole() -> None:
    step, angle = 4e-4, 1.6e-3
    noise = replace(NOISE, shared_share=1.0, shared_angle=angle)
    grid = window(np.radians(40), step, 150, 500)
    error = errors(noise, grid)
    sine = np.sin(np.radians(40) + 75 * step)
    expected = noise.shared.at(10.0)
    beside = float(expected.correlation(np.array(step * sine)))
    assert np.nanmean(error[:, 1:] * error[:, :-1]) == pytest.approx(beside, abs=0.03)
    below = float(expected.correlation(np.array(step)))
    assert np.nanmean(error[1:] * error[:-1]) == pytest.approx(below, abs=0.03)


def test_without_a_share_scans_are_what_they_were() -> None:
    grid = window(np.pi / 2, 1e-3, 40, 40)
    noise = replace(NOISE, beam_exit=0.004)
    plain = errors(noise, grid)
    assert np.array_equal(errors(replace(noise, shared_share=0.0), grid), plain)
    shared = errors(replace(noise, shared_share=0.5), grid)
    # beams of 4 mm stand 10 mm apart: shared texture, but none in common
    assert not np.array_equal(shared, plain)
    assert abs(np.mean(shared[1:] * shared[:-1])) < 4 / np.sqrt(shared.size)
