"""A plan and the two epochs that are measured after it say the same."""

from pathlib import Path

import numpy as np
import pytest

from tests.job.plan_jobs import load
from tribrach.epochs.comparison import Settings, compare
from tribrach.epochs.design import detectable_displacement, sigma_for_displacement
from tribrach.epochs.differences import Epoch, difference
from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.job.plan.steps import plan_project
from tribrach.report.planning.report import plan_report


@pytest.mark.parametrize(("axes", "factor"), [(1, 3.962), (2, 4.390), (3, 4.670)])
def test_plan_and_epochs_agree(axes: int, factor: float) -> None:
    """The published non-centralities 7.849, 9.635 and 10.903 at 5 % and 80 %."""
    assert detectable_displacement(1.0, axes) == pytest.approx(factor, abs=1e-3)
    assert factor**2 / 2 == pytest.approx({1: 7.849, 2: 9.635, 3: 10.903}[axes], abs=5e-3)
    assert sigma_for_displacement(2e-3, axes) == pytest.approx(2e-3 / factor, rel=1e-3)
    rng = np.random.default_rng(axes)
    covariance = np.zeros((6, 6))
    root = rng.normal(size=(6, 6)) * 1e-3
    covariance[3:, 3:] = (root @ root.T)[3:, 3:]
    xyz = np.array([[0.0, 0, 0], [50, 20, 5]])
    one = Epoch("1", ("datum", "P"), xyz, covariance)
    two = Epoch("2", one.names, xyz, covariance)
    space = {1: "heights", 2: "plan", 3: "3D"}[axes]
    (point,) = compare(difference(one, two, space=space), Settings()).displacements
    chosen = {1: [5], 2: [3, 4], 3: [3, 4, 5]}[axes]
    sigma = float(np.sqrt(np.linalg.eigvalsh(covariance[np.ix_(chosen, chosen)])[-1]))
    assert point.detectable == pytest.approx(detectable_displacement(sigma, axes), rel=1e-9)


def test_a_plan_for_a_displacement(tmp_path: Path) -> None:
    """What is required is the sigma with which it is found, and the report says what would be."""
    job = open_job(load(tmp_path, "displacement_mm = 2\n", targets=13, calibration=False))
    plan = plan_project(job)
    assert plan.required == pytest.approx(2e-3 / 4.670, rel=1e-3)
    assert plan.reached == (plan.detectable <= 2e-3)
    words = " ".join(plan_report(plan).sentences)
    assert "would be found with 80 %" in words


def test_two_requirements_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="either displacement_mm or sigma_mm"):
        load(tmp_path, "displacement_mm = 2\nsigma_mm = 1\n", targets=13)
