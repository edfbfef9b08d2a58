"""Pairs of stations by their planes: remembered until a station is another."""

from pathlib import Path

import numpy as np
import pytest

from tests.registration.plane_scenes import yard_station
from tribrach.io.keeping import keeping
from tribrach.job import tie
from tribrach.job.state import Remembered
from tribrach.job.tie import remembered_pairs
from tribrach.registration.planes.poses import pair_poses


def test_a_pair_is_sought_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stations = [yard_station("S1"), yard_station("S2")]
    asked = []

    def counted(first, second):
        asked.append((first.name, second.name))
        return pair_poses(first, second)

    counted.__module__, counted.__qualname__ = pair_poses.__module__, pair_poses.__qualname__
    truth = pair_poses(*stations)
    monkeypatch.setattr(tie, "pair_poses", counted)
    with keeping():
        for _ in range(2):
            found = remembered_pairs(Remembered(tmp_path))(*stations)
            assert (found.first, found.second, found.lacking) == ("S1", "S2", truth.lacking)
            assert len(found.poses) == len(truth.poses) == 1
            one, other = found.poses[0], truth.poses[0]
            assert (one.pose.matrix == other.pose.matrix).all()
            assert (one.pairs == other.pairs).all()
            assert (one.rms, one.seen, one.overlap) == (other.rms, other.seen, other.overlap)
            assert one.open.shape == other.open.shape
        assert asked == [("S1", "S2")]
        moved = [yard_station("S1"), yard_station("S2", seed=5)]
        assert np.isfinite(remembered_pairs(Remembered(tmp_path))(*moved).poses[0].rms)
    assert asked == [("S1", "S2")] * 2
