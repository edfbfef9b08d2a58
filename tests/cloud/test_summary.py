"""Summaries gathered in pieces are those of the whole; the weakest direction of a cloud."""

import numpy as np
import pytest

from tribrach.cloud.budget import weakest_direction
from tribrach.cloud.summary import CLASSES, EDGES, CloudSummary


def cloud(n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-30, 30, (n, 3)), rng.lognormal(-6.5, 0.4, (n, 3)).astype(np.float32)


def test_pieces_make_the_whole() -> None:
    xyz, sigma = cloud(50_000)
    whole, parts = CloudSummary(), CloudSummary()
    whole.add(xyz, sigma)
    for piece in np.array_split(np.arange(len(xyz)), 17):
        parts.add(xyz[piece], sigma[piece])
    total = np.sqrt((sigma.astype(float) ** 2).sum(axis=1))
    for summary in (whole, parts):
        assert summary.points == len(xyz)
        assert summary.rms == pytest.approx(np.sqrt((sigma.astype(float) ** 2).mean(0)), rel=1e-5)
        assert summary.largest == pytest.approx(total.max(), rel=1e-6)
        for name, limit in CLASSES.items():
            assert summary.shares[name] == pytest.approx((2 * total <= limit).mean(), abs=1e-4)
        # bins are 12 % wide, and evenly filled
        for share in (0.5, 0.95):
            assert summary.quantile(share) == pytest.approx(np.quantile(total, share), rel=0.02)
        assert len(summary.sample) > 500
    assert (parts.counts == whole.counts).all()
    assert whole.counts[1:-1].sum() == np.histogram(total, EDGES)[0].sum()


def test_every_point_is_in_its_bin_and_its_classes() -> None:
    """From far below the first edge to far beyond the last, close to edges and limits as well."""
    rng = np.random.default_rng(5)
    near = np.concatenate([EDGES, np.array(list(CLASSES.values())) / 2])
    near = np.concatenate([near * (1 - 1e-5), near * (1 + 1e-5), [1e-12, 1e-6, 5.0, 1e4, 0.0]])
    size = np.concatenate([10 ** rng.uniform(-6, 1, 20_000), near])
    sigma = np.zeros((len(size), 3), dtype=np.float32)
    sigma[:, 1] = size
    total = sigma[:, 1].astype(float)
    summary = CloudSummary()
    summary.add(np.zeros((len(size), 3)), sigma)
    expected = np.histogram(total, np.concatenate([[0.0], EDGES, [np.inf]]))[0]
    assert (summary.counts == expected).all()
    within = [(2 * total <= limit).sum() for limit in CLASSES.values()]
    assert summary.within.tolist() == within
    assert (summary.smallest, summary.largest) == (0.0, total.max())


def test_the_sample_stays_small() -> None:
    summary = CloudSummary()
    for seed in range(30):
        summary.add(*cloud(20_000, seed))
    assert 1000 < len(summary.sample) <= 4000


def test_a_heading_error_is_weakest_across_the_line_of_sight() -> None:
    """Points due north at 30 m and 40": 5.8 mm along east, azimuth 100 gon."""
    covariance = np.diag([1e-8] * 3 + [1e-14, 1e-14, (40 / 206265) ** 2])
    points = np.array([[0.0, 30.0, 0.0], [0.1, 30.0, 1.0]])
    found = weakest_direction(points, covariance)
    assert found.sigma == pytest.approx(30 * 40 / 206265, rel=1e-2)
    assert found.azimuth == pytest.approx(np.pi / 2, abs=1e-2)
    assert found.elevation == pytest.approx(0.0, abs=1e-2)
