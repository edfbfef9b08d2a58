"""Samples of scans with normals: where they lie and how they stand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.io.scans.formats import read_scans
from tribrach.scan import surface_sample as module
from tribrach.scan.surface_sample import surface_sample


def written(folder: Path, xyz: np.ndarray):  # type: ignore[no-untyped-def]
    path = folder / "s.xyz"
    np.savetxt(path, xyz, fmt="%.5f")
    return replace(read_scans(path)[0], origin="stated")


def wall(n: int, sigma: float = 0.0005) -> np.ndarray:
    """A wall at 10 m in front of the scanner, row by row."""
    y, z = np.meshgrid(np.linspace(-5, 5, n), np.linspace(-2, 2, n), indexing="ij")
    x = 10 + sigma * np.random.default_rng(1).normal(size=y.size)
    return np.stack([x, y.ravel(), z.ravel()], axis=1)


def test_normals_of_a_wall(tmp_path: Path) -> None:
    sample = surface_sample(written(tmp_path, wall(150)))
    assert len(sample.xyz) == 300
    assert sample.normals[:, 0].mean() == pytest.approx(-1, abs=0.002)
    assert (sample.normals[:, 0] < -0.99).all()
    assert np.linalg.norm(sample.normals, axis=1) == pytest.approx(1)


def test_clutter_has_no_normals(tmp_path: Path) -> None:
    cloud = np.random.default_rng(2).uniform(5, 6, (4000, 3))
    sample = surface_sample(written(tmp_path, cloud))
    assert np.isnan(sample.normals[:, 0]).mean() > 0.5


def test_blocks_are_spread_over_the_scan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_RECORDS", 500)
    xyz = wall(100)
    sample = surface_sample(replace(written(tmp_path, xyz), records=len(xyz)))
    assert sample.xyz[:, 1].min() < -4.9
    assert sample.xyz[:, 1].max() > 4.9
    assert len(np.unique(np.round(sample.xyz[:, 1]))) >= 5


def test_few_points_have_no_normals(tmp_path: Path) -> None:
    sample = surface_sample(written(tmp_path, wall(4)))
    assert len(sample.xyz) == 16
    assert np.isnan(sample.normals).all()
