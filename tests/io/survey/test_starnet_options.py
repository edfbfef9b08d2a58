"""Options of STAR*NET that say what the job is, and marks that run together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey

#: on the central meridian of UTM 33, where the scale is 0.9996
GRID = (
    "{options}\n.ORDER EN\nC A 500000.000 5400000.000 0.0 ! ! !\n"
    "C B 500000.000 5400400.000 0.0 ! ! !\nC P 500200.0 5400200.0 0.0\nD A-B {length} 0.005\n"
)


def read(folder: Path, text: str) -> Survey:
    path = folder / "job.dat"
    path.write_text(text)
    return read_files([path])


def test_crs_makes_a_grid_job(tmp_path: Path) -> None:
    on_grid = read(tmp_path, GRID.format(options=".CRS EPSG:32633", length=400.0 / 0.9996))
    local = read(tmp_path, GRID.format(options="", length=400.0))
    for survey in (on_grid, local):
        network = survey.network()
        distance = next(o for o in network.observations if "distance" in o.kind)
        assert abs(float(distance.misclosure(network.start)[0, 0])) < 2e-4
    assert on_grid.reference.crs is not None
    assert local.reference.crs is None


@pytest.mark.parametrize("words", [".CRS UTM33N", ".CRS"])
def test_a_grid_that_is_not_known_is_asked_for(tmp_path: Path, words: str) -> None:
    with pytest.raises(InputError, match="EPSG") as refused:
        read(tmp_path, GRID.format(options=words, length=400.0))
    assert refused.value.line == 1
    assert "leave" not in str(refused.value)


@pytest.mark.parametrize("options", [".GRID BEAR", ".MEASURED DIST ANG DIR", ".MEAS DIST"])
def test_what_is_usual_is_taken(tmp_path: Path, options: str) -> None:
    assert read(tmp_path, GRID.format(options=options, length=400.0)).points


@pytest.mark.parametrize("options", [".GRID DIST", ".MEASURED BEAR", ".GRID", ".MEASURED GRID"])
def test_what_would_change_the_job_is_not_left_out(tmp_path: Path, options: str) -> None:
    with pytest.raises(InputError) as refused:
        read(tmp_path, GRID.format(options=options, length=400.0))
    assert "leave" not in str(refused.value)


@pytest.mark.parametrize("marks", ["!!", "!*", "**"])
def test_marks_of_coordinates_that_run_together(tmp_path: Path, marks: str) -> None:
    job = ".2D\n.ORDER EN ATFROMTO\nC A 0 0 ! !\nC B 100 0 ! !\nC P 35.3 35.3 {marks}\n"
    job += "A A-B-P 315-00-00 5\nD A-P 50.0 0.005\nD B-P 73.68 0.005\n"
    first, second = (
        adjust(read(tmp_path, job.format(marks=written)).network())
        for written in (marks, " ".join(marks))
    )
    assert first.dof == second.dof
    np.testing.assert_array_equal(first.points["P"].xyz, second.points["P"].xyz)


@pytest.mark.parametrize("marks", ["&&*", "!!*", "&!"])
def test_marks_of_sights_that_run_together(tmp_path: Path, marks: str) -> None:
    job = (
        "C A 0 0 0 ! ! !\nC B 0 100 0 ! ! !\nC P 35 35 1 ! ! !\nM A-B-P 45-00-00 50 88-51-00 {m}\n"
    )
    job += "D A-P 49.5 0.005\n"
    first, second = (
        read(tmp_path, job.format(m=written)).network() for written in (marks, " ".join(marks))
    )
    assert [len(o) for o in first.observations] == [len(o) for o in second.observations]
    for one, other in zip(first.observations, second.observations, strict=True):
        np.testing.assert_array_equal(one.sigma, other.sigma)
        np.testing.assert_array_equal(one.use, other.use)
