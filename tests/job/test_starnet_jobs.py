"""Data of STAR*NET as entries of a project: measured ones, and those of a pre-analysis."""

import json
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.questions.plan.design import plan_project
from tribrach.report import json_result
from tribrach.solution import AdjustmentSettings

SETTINGS = """
[Adjustment]
adjustment_type                3D
linear_units                   Meters
local_or_grid_adjustment       1
coordinate_system_name         UTM83-19
coordinate_order               EN
[Instrument]
distance_std_err               0.0010000000
edm_ppm                        1.0000000000
direction_std_err              1.0000000000
zenith_std_err                 1.0000000000
"""
POINTS = """
C A 682000.000 5090000.000 40.000 ! ! !
C B 682300.000 5090050.000 45.000 ! ! !
C P 682150.000 5090200.000 50.000
"""
PLANNED = "DB A\nDM B\nDM P\nDE\nDB B\nDM A\nDM P\nDE\n"


@pytest.fixture
def folder(tmp_path) -> Path:
    """A project of planned observations."""
    (tmp_path / "job.dat").write_text(POINTS + PLANNED)
    (tmp_path / "job.snproj").write_text(SETTINGS)
    return tmp_path


def job(folder: Path, text: str):
    (folder / "job.toml").write_text(text)
    return open_job(folder / "job.toml")


def test_the_grid_of_the_file_is_that_of_the_job(folder):
    """Adjusted points come back in the grid, with the datum of the grid for their places."""
    sights = "DV A-B 304.173 89-03-31\nDV A-P 250.288 87-42-27\nDV B-P 212.186 88-38-59\n"
    (folder / "job.dat").write_text(POINTS + sights + "B A-P 36-52-12 5\n")
    opened = job(folder, '[[observations]]\nfile = "job.dat"\n')
    assert opened.frame.grid.crs == "EPSG:26919"
    settings = AdjustmentSettings.of(opened.project)
    document = json.loads(json_result.dumps(adjust_job(opened, settings)))
    assert document["reference"]["crs"] == "EPSG:26919"
    place = document["points"]["P"]
    np.testing.assert_allclose(place["projected"], [682150, 5090200, 50], atol=0.15)
    assert not any("taken as flat" in warning for warning in opened.survey.warnings)


def test_a_pre_analysis_is_planned(folder):
    """Two directions, distances and zenith angles tell a point: by hand within a tenth."""
    opened = job(folder, '[plan]\nobservations = ["job.dat"]\n')
    adjustment = plan_project(opened).adjustment
    assert adjustment.dof == 12 - 3 - 2
    sigmas = np.sqrt(np.diag(adjustment.covariance("P")))
    # each distance of 1.2 mm tells its own direction, both zenith angles the height
    assert 0.8e-3 < sigmas[:2].min() < sigmas[:2].max() < 1.3e-3
    assert sigmas[2] == pytest.approx(230 / 206265 / 2**0.5, rel=0.15)


def test_planned_observations_are_no_measured_ones(folder):
    with pytest.raises(InputError, match=r"have no values: they are planned.*\[plan\]"):
        job(folder, '[[observations]]\nfile = "job.dat"\n')


def test_a_site_beside_a_file_with_a_grid_is_refused(folder):
    text = '[site]\nlatitude_deg = 46\nlongitude_deg = -66\n[plan]\nobservations = ["job.dat"]\n'
    with pytest.raises(InputError, match="brings a work frame of its own"):
        job(folder, text)
