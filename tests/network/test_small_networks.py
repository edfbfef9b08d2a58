"""Networks with fewer observations than open motions, and with nothing unknown at all."""

import numpy as np
import pytest

from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import SlopeDistances, ZenithAngles


def test_one_line_with_inner_constraints() -> None:
    """Zenith and distance of one line: its length and slope are known, all else is datum."""
    survey = Survey(site=EllipsoidSite(0.85, 0.0, 0.0), datum=Datum("free"))
    survey.point("a", (0, 0, 0))
    # a nanometre beside the line, as rounding leaves it
    survey.point("b", (10, 1e-9, 0))
    line = {"start": ["a"], "end": ["b"]}
    survey.add(SlopeDistances, values=[10.002], sigma=0.001, **line)
    survey.add(ZenithAngles, values=[np.pi / 2 + 1e-4], sigma=2e-4, **line)
    adjustment = adjust(survey.network())
    assert (adjustment.dof, adjustment.defect) == (0, 4)
    a, b = adjustment.state.points
    assert np.linalg.norm(b - a) == pytest.approx(10.002, abs=1e-9)
    # either end carries half of the length's variance, and the slope across it
    covariance = adjustment.covariance("a")
    assert np.sqrt(covariance[0, 0]) == pytest.approx(0.0005, rel=1e-3)
    assert np.sqrt(covariance[2, 2]) == pytest.approx(10 * 2e-4 / 2, rel=1e-3)
    # nothing tells how large the errors were, so that covariances stay what they are
    assert np.isnan(adjustment.posterior_factor)
    assert adjustment.variance_factor(posterior=True) == 1.0


@pytest.mark.parametrize("misclosure", [0.0, 0.003])
def test_covariances_are_scaled_by_what_the_residuals_tell(misclosure: float) -> None:
    """A height that was levelled twice; equal readings tell nothing of their errors."""
    survey = Survey()
    survey.point("a", (0, 0, 0), free=(False, False, False))
    survey.point("b", (0, 0, 1), free=(False, False, True))
    rises = [1.0, 1.0 + misclosure]
    survey.add(HeightDifferences, values=rises, sigma=0.001, start=["a"] * 2, end=["b"] * 2)
    adjustment = adjust(survey.network())
    assert adjustment.dof == 1
    assert adjustment.variance_factor(posterior=False) == 1.0
    expected = misclosure**2 / 2 / 0.001**2 if misclosure else 1.0
    assert adjustment.variance_factor(posterior=True) == pytest.approx(expected)


def test_nothing_unknown() -> None:
    """Between fixed points an observation is a check and nothing else."""
    survey = Survey()
    for name, height in (("a", 0.0), ("b", 1.0)):
        survey.point(name, (0, 0, height), free=(False, False, False))
    survey.add(HeightDifferences, values=[1.003], sigma=0.001, start=["a"], end=["b"])
    adjustment = adjust(survey.network())
    assert (adjustment.n_unknowns, adjustment.dof) == (0, 1)
    assert adjustment.sigma0_posterior == pytest.approx(3.0)
