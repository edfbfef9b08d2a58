"""Scans that reach beyond the targets of their station are told with what it costs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.network.facade import TARGETS, facade
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.job.budget import reach_sentences
from tribrach.job.scans import StationScan
from tribrach.job.shared import shared_part
from tribrach.job.state import Remembered
from tribrach.job.surface_samples import SurfaceSamples
from tribrach.network.adjustment import Adjustment, adjust


def samples(folder: Path) -> SurfaceSamples:
    return SurfaceSamples(Remembered(folder), lambda *_: None)


@pytest.fixture(scope="module")
def adjustment() -> Adjustment:
    """Only the two targets to the left are seen from S1."""
    network = facade().network()
    for o in network.observations:
        if o.kind == "target_centre":
            o.use[6 * 0 + 1 : 5] = 2
    return adjust(network)


def scan(folder: Path, adjustment: Adjustment, world: np.ndarray) -> StationScan:
    """A scan of points (n, 3) of the world from S1."""
    state = adjustment.state
    k = state.layout.index("pose", "S1")
    path = folder / "S1.xyz"
    np.savetxt(path, (world - state.pose_t[k]) @ state.pose_r[k], fmt="%.4f")
    one = replace(read_scans(path)[0], origin="stated")
    return StationScan("S1", "S1", one, ScanNoise(1e-3, 0, 1e-5, 1e-5), True, {})


def around(center: np.ndarray, radius: float) -> np.ndarray:
    return center + np.random.default_rng(1).uniform(-radius, radius, (2000, 3))


def test_far_away_is_told(adjustment: Adjustment, tmp_path: Path) -> None:
    one = scan(tmp_path, adjustment, around(np.array([140.0, 20.0, 8.0]), 5.0))
    where = shared_part([one], adjustment).scans
    (said,) = reach_sentences([one], where, adjustment, samples(tmp_path))
    assert said.startswith("the scans of station S1 reach ")
    assert float(said.split("reach ")[1].split()[0]) > 5
    near = float(said.split("uncertain is ")[1].split(" mm")[0])
    far = float(said.split("targets and ")[1].split(" mm")[0])
    assert far > 1.3 * near


def test_among_the_targets_is_silent(adjustment: Adjustment, tmp_path: Path) -> None:
    one = scan(tmp_path, adjustment, around(TARGETS[0] * 0.6 + [4.0, 3.0, 3.0], 2.0))
    where = shared_part([one], adjustment).scans
    assert reach_sentences([one], where, adjustment, samples(tmp_path)) == []
