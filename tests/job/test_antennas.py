"""Chapters on lever arms and rigid placing, and the files that go to the next job."""

from pathlib import Path

import numpy as np
import pytest

import tribrach as tb
from tests.project.test_lever_arms import ARM, write
from tests.registration.test_rigid_model import CONTROL, LOOP, NAMES, site, survey_of
from tribrach import pipeline
from tribrach.io.lever_arm_file import read_lever_arm
from tribrach.job.antennas import carried_antennas, height_sentences
from tribrach.job.results import JobResults
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.snooping import snoop
from tribrach.network.quality import assess
from tribrach.report import text
from tribrach.report.build import build


def test_a_run_leaves_its_lever_arm_for_the_next(tmp_path: Path) -> None:
    station = "levelled = true\nlevelling_arcsec = 20000"  # leaning by two degrees
    project = tb.Project.load(
        write(tmp_path, "x_m=0\ny_m=0\nz_m=0.3\nsigma_mm=1e5", station=station)
    )
    content = pipeline.run(project, tmp_path / "out")
    arm = read_lever_arm(tmp_path / "out" / "lever-arm-antenna.toml")
    assert arm.vector == pytest.approx(ARM, abs=1e-5)
    assert arm.stations == ("S",)
    assert arm.datum == content.datum.sentence
    chapter = next(c for c in content.chapters if c.name == "lever_arm_calibration")
    assert "Lever arm antenna, carried by 1 station: x 12.0 ±" in chapter.sentences[0]
    assert any("Lever arm antenna is not zero in x" in s for s in chapter.sentences)
    assert any("Without levelling" in s for s in chapter.sentences)
    facts = chapter.data["antenna"]
    # without the compensator the tilt is of the targets alone: the arm is known no better
    free = np.array(facts.free.covariance)
    assert (np.diag(free) >= np.diag(facts.covariance) * (1 - 1e-6)).all()
    assert "Lever arms" in (tmp_path / "out" / "report.txt").read_text()


def test_targets_on_one_side_are_named(tmp_path: Path) -> None:
    path = write(tmp_path, "x_m=0\ny_m=0\nz_m=0.3\nsigma_mm=1e5")
    rows = (tmp_path / "targets.csv").read_text().splitlines()
    # the three targets left lie within 168 degrees
    (tmp_path / "targets.csv").write_text("\n".join(r for r in rows if ",C," not in r) + "\n")
    content = pipeline.run(tb.Project.load(path), tmp_path / "out")
    chapter = next(c for c in content.chapters if c.name == "lever_arm_calibration")
    assert any("degrees of the horizon free" in s for s in chapter.sentences)


def test_the_rigid_model_is_compared_with_the_adjustment() -> None:
    one = site(4, 0.009, 0.0008)
    survey = survey_of(one, CONTROL[5], closed=True)
    adjustment = adjust(survey.network())
    antennas = carried_antennas(survey, adjustment)
    content = build(adjustment, assess(adjustment), job=JobResults(antennas=antennas))
    assert not antennas.lever_arms  # its lever arm is held
    assert content.chapter("lever_arm_calibration") is None
    chapter = content.chapter("rigid_model")
    assert "placed by 5 places with 6 parameters" in chapter.sentences[0]
    assert len(chapter.tables[0].rows) == len(LOOP)
    assert set(chapter.data.poses) == set(NAMES)
    measured = one.antennas[[k for k in range(10) if k not in CONTROL[5]]]
    ends = adjustment.state.pose_t + adjustment.state.pose_r @ [0, 0, 0.329]
    difference = measured - ends[[k for k in range(10) if k not in CONTROL[5]]]
    assert chapter.data.check_rms_adjusted == pytest.approx(np.sqrt((difference**2).mean()))
    assert "rigid body" in text.render(content)


def test_a_wrong_antenna_height_is_named_as_one() -> None:
    """100 mm too high at S5: found, switched off, and said to be a height."""
    one = site(1, 0.009, 0.0002)
    one.antennas[4, 2] += 0.1
    adjustment, log = snoop(survey_of(one, CONTROL[9], closed=True).network())
    assert log.removed
    (sentence,) = height_sentences(adjustment)
    assert "antenna on S5" in sentence
    assert "mm above" in sentence
    assert "look at its height" in sentence
