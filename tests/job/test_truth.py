"""Errors against the truth: as stated, larger and smaller are told apart."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.project.test_lever_arms import ARM, write
from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.job.state import Remembered
from tribrach.job.truth import TruthRow, against_truth, read_truth
from tribrach.network.adjustment import adjust
from tribrach.simulate.twins import build

POINTS = 10_000
SIGMA = re.compile(r"^((?:direction|zenith|distance|centring|height|levelling)_[\w]+ = )([\d.]+)")


def rows_of(folder, seed, factor=1.0):
    """The survey of the facades, scans left out, with its sigmas times a factor."""
    twin = build("hanoi-facade", POINTS, seed)
    for name, text in twin.files.items():
        (folder / name).write_text(_of_marks(text) if name == "check.csv" else text)
    lines = [
        SIGMA.sub(lambda m: f"{m[1]}{factor * float(m[2])}", line)
        for line in twin.project.splitlines()
    ]
    path = folder / "project.toml"
    path.write_text("\n".join([*lines, "[[scans]]", 'file = "none.laz"', ""]))
    adjustment = adjust(open_job(path).network())
    points = {name: np.asarray(x).tolist() for name, x in twin.marks.items()}
    points |= {t.name: t.center.tolist() for t in twin.targets}
    truth = {"stations": {}, "points": points, "targets": {}}
    return against_truth(truth, folder, adjustment, (), {}, None, state=Remembered(Path()))


def _of_marks(table):
    """The table without the boards, which only scans see."""
    return "".join(x for x in table.splitlines(keepends=True) if x[0] not in "NE" or x[1] == "_")


def jointly(rows):
    return next(r for r in rows if r.name == "jointly")


def test_errors_as_stated_agree_over_many_seeds(tmp_path):
    """Sums over seeds are chi-square as well, and hardly a seed is beyond 99 %."""
    total, dof, beyond = 0.0, 0, 0
    for seed in range(8):
        rows = rows_of(tmp_path, seed)
        joint = jointly(rows)
        total, dof = total + joint.statistic, dof + joint.dof
        beyond += any(not r.agrees for r in rows)
        assert joint.least == pytest.approx(chi2.ppf(0.005, joint.dof))
        assert joint.limit == pytest.approx(chi2.ppf(0.995, joint.dof))
    assert chi2.ppf(0.001, dof) < total < chi2.ppf(0.999, dof)
    assert beyond <= 2


@pytest.mark.parametrize(
    ("factor", "side", "words"),
    [(1, "within", "as stated"), (3, "below", "smaller than"), (1 / 3, "above", "larger than")],
)
def test_the_side_is_told(tmp_path, factor, side, words):
    joint = jointly(rows_of(tmp_path, 1, factor))
    assert joint.side == side
    assert words in joint.verdict
    assert joint.agrees == (side == "within")


def test_limits_of_single_errors_hold_for_all_of_them(tmp_path):
    rows = [r for r in rows_of(tmp_path, 1) if r.what == "point" and r.name != "jointly"]
    assert len(rows) > 10
    each = {chi2.cdf(r.limit, r.dof) for r in rows}
    assert np.allclose([p ** len(rows) for p in each], 0.99)
    # a single error cannot be too small to be true
    assert all(r.least is None for r in rows)


def test_words_of_verdicts():
    assert TruthRow("targets", "S1", "", side="wrong").verdict == "not so"
    assert not TruthRow("targets", "S1", "", side="wrong").agrees
    assert TruthRow("cloud", "S1", "", 1.0, 0.9, 1.1).agrees


def test_a_truth_file_that_is_none(tmp_path):
    path = tmp_path / "truth.json"
    with pytest.raises(InputError, match="cannot be read"):
        read_truth(path)
    path.write_text("[1]")
    with pytest.raises(InputError, match="no stations"):
        read_truth(path)


def test_lever_arms_are_compared(tmp_path):
    """z held 2 mm beside the truth is no error that was estimated; x and y are."""
    arm = "x_m=0\ny_m=0\nz_m=0.331\nsigma_x_mm=50\nsigma_y_mm=50\nsigma_z_mm=0"
    adjustment = adjust(open_job(write(tmp_path, arm)).network())
    facts = {"lever_arm_m": ARM.tolist(), "lever_arms": {"S": "antenna"}}
    truth = {"stations": {}, "points": {}, "targets": {}, "facts": facts}
    rows = against_truth(truth, tmp_path, adjustment, (), {}, None, state=Remembered(Path()))
    (row,) = [r for r in rows if r.what == "lever arm"]
    assert (row.name, row.dof) == ("antenna", 2)
    assert row.agrees
    facts["lever_arm_m"] = [0.112, -0.004, 0.331]
    rows = against_truth(truth, tmp_path, adjustment, (), {}, None, state=Remembered(Path()))
    (row,) = [r for r in rows if r.what == "lever arm"]
    assert row.side == "above"
