"""AC-06: the floor of nearest-neighbour distances, closed form against a lattice."""

import numpy as np
import pytest

from tribrach.cloud.sampling_floor import MEAN, RMS, STD, rms_of_rectangle


def test_the_published_numbers() -> None:
    assert pytest.approx(0.382598, abs=5e-7) == MEAN
    assert pytest.approx(0.142427, abs=5e-7) == STD
    assert pytest.approx(RMS**2) == MEAN**2 + STD**2


def test_a_lattice_has_them() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.5, 0.5, (2, 400_000))  # the cell around one lattice point
    d = np.hypot(x, y)
    n = np.sqrt(len(d))
    assert d.mean() == pytest.approx(MEAN, abs=4 * STD / n)
    assert d.std() == pytest.approx(STD, abs=4 * STD / n)
    assert rms_of_rectangle(0.3, 0.4) == pytest.approx(
        np.sqrt(((0.3 * x) ** 2 + (0.4 * y) ** 2).mean()), rel=5e-3
    )
