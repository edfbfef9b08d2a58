import numpy as np
import pytest

from tribrach.comparison.m3c2 import additive_level, mean_sigma, quadratic_level

SIGMA, COUNT, REGISTRATION = 0.004, 25, 0.003


def test_levels_of_the_example() -> None:
    noise = mean_sigma(np.array(SIGMA), np.array(COUNT), np.array(SIGMA), np.array(COUNT))
    assert additive_level(noise, REGISTRATION) == pytest.approx(8.10e-3, abs=5e-6)
    assert quadratic_level(noise, REGISTRATION) == pytest.approx(6.28e-3, abs=5e-6)


def test_false_alarms_of_the_example() -> None:
    rng = np.random.default_rng(1)
    means = SIGMA / np.sqrt(COUNT) * rng.normal(size=(2, 1_000_000))
    distance = means[1] - means[0] + REGISTRATION * rng.normal(size=1_000_000)
    noise = np.array(SIGMA * np.sqrt(2 / COUNT))
    additive = (np.abs(distance) > additive_level(noise, REGISTRATION)).mean()
    quadratic = (np.abs(distance) > quadratic_level(noise, REGISTRATION)).mean()
    assert additive == pytest.approx(0.011, abs=1e-3)
    assert quadratic == pytest.approx(0.050, abs=1e-3)
