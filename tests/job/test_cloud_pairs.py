"""Pairs of a project's stations: the needed ones alone, and nothing made twice."""

from pathlib import Path

import numpy as np
import pytest

from tests.registration.clouds.scenes import points_of, yard
from tribrach.io.scans.formats import read_scans
from tribrach.job import cloud_pairs as pairs_module
from tribrach.job.cloud_pairs import StationSurfels, cloud_pairs
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.registration.clouds import proposals
from tribrach.simulate.setups import levelled

FLOOR = (1e-3, 5e-5)


def quiet(*_: object) -> None:
    pass


def test_proposed_pairs_and_their_plans_are_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proposals, "GATES", proposals.ProposalGates(all_pairs=2))
    rng = np.random.default_rng(1)
    scans = []
    for k, (x, y, heading) in enumerate(((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5), (2.0, 8.0, -1.4))):
        pose = levelled((x, y, 1.6), heading, 5e-5, rng)
        np.savetxt(tmp_path / f"S{k}.xyz", points_of(yard(), pose, 30_000, k), fmt="%.4f")
        (scan,) = read_scans(tmp_path / f"S{k}.xyz")
        scans.append(StationScan(f"S{k}", f"S{k}", scan, None, True, {}))
    state = Remembered(tmp_path / "out")
    first = cloud_pairs(StationSurfels(scans, state, quiet), FLOOR, state, quiet)
    assert len(first.edges) == 3
    assert len(first.joints) == 3
    assert (state.folder / "clouds-plans.json").exists()

    def never(*_: object) -> None:
        raise AssertionError("surfels were made again")

    assert len(list(state.folder.glob("surfels-*.json"))) == 3
    monkeypatch.setattr(pairs_module, "surfaces", never)
    again = cloud_pairs(StationSurfels(scans, state, quiet), FLOOR, state, quiet)
    assert [e.ends for e in again.edges] == [e.ends for e in first.edges]
    # all pairs of three are the same three, remembered one by one
    every = cloud_pairs(StationSurfels(scans, state, quiet), FLOOR, state, quiet, choice="all")
    assert {e.ends for e in every.edges} == {e.ends for e in first.edges}
    # pairs that are lost are registered from the surfels that are kept, with the same result
    for product in state.folder.glob("clouds-S*.json"):
        product.unlink()
    third = cloud_pairs(StationSurfels(scans, state, quiet), FLOOR, state, quiet)
    for one, other in zip(first.edges, third.edges, strict=True):
        assert np.array_equal(one.pose.matrix, other.pose.matrix)
        assert np.array_equal(one.covariance, other.covariance)
