"""Points are switched off only where no larger model fits all of them, and never most of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribrach.transformation.fit import fit_transformation
from tribrach.transformation.models import MODELS, Model
from tribrach.transformation.outcome import Outcome, examine

TITLES = ("E", "N", "U")


def model_of(count: int, dimension: int) -> Model:
    return next(m for m in MODELS if (m.count, m.dimension) == (count, dimension))


def examined(seed: int, *, scale: float = 1.0, wrong: int = 0, n: int = 10) -> Outcome:
    """Ten points in two systems in space, levelled, with a scale in plan and some wrong points."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(-200, 200, (n, 3)) * (1, 1, 0.1)
    b = a * (scale, scale, 1.0) + (1000, 2000, 50)
    b[:wrong] += rng.choice([-1, 1], (wrong, 3)) * 0.1
    sigma = 0.003
    noise = sigma * rng.normal(size=b.shape)
    fit = fit_transformation(a, b + noise, 4, covariance_b=np.tile(sigma**2 * np.eye(3), (n, 1, 1)))
    names = fit.points.names
    found = examine(fit.points, model_of(4, 3), TITLES, snoop=True)
    return replace(found, removed=tuple(str(names.index(name)) for name in found.removed))


@pytest.mark.parametrize("seed", range(6))
def test_a_scale_in_plan_is_no_reason_to_switch_points_off(seed: int) -> None:
    found = examined(seed, scale=0.9996)
    assert found.removed == ()
    assert found.steps


@pytest.mark.parametrize("seed", range(6))
def test_one_wrong_point_is_still_switched_off(seed: int) -> None:
    assert "0" in examined(seed, wrong=1).removed


def test_most_points_are_never_switched_off() -> None:
    found = examined(1, wrong=5)
    assert found.removed == ()
    assert found.steps
