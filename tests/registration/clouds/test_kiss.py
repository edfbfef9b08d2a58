"""The proposal of kiss-matcher: none without it, a proper motion with it."""

import numpy as np
import pytest

from tests.registration.clouds.scenes import yard_scans
from tribrach.registration.clouds import starts as kiss


def test_nothing_is_proposed_where_it_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kiss, "kiss_matcher", None)
    (a, b, _), _ = yard_scans()
    assert kiss.kiss_poses(a.coarse.surfels, b.coarse.surfels) == []


def test_what_it_proposes_is_a_motion() -> None:
    pytest.importorskip("kiss_matcher")
    (a, _, c), _ = yard_scans()
    poses = kiss.kiss_poses(a.coarse.surfels, c.coarse.surfels)
    for pose in poses:
        assert np.allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
