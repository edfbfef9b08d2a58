"""True and false are no numbers, wherever a project or a file of ours has one."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from tribrach.errors import InputError
from tribrach.io.calibration_file import read_calibration
from tribrach.project import Project

OBSERVED = '\n[[observations]]\nfile = "obs.csv"\n'


@pytest.mark.parametrize(
    ("text", "line", "key"),
    [
        ("confidence = true", 1, "confidence"),
        ("[instruments.A]\nrange_mm = true", 2, "instruments.A.range_mm"),
        ("[instruments.A]\nshared_share = false", 2, "instruments.A.shared_share"),
        ("[site]\nepoch = true", 2, "site.epoch"),
        ("[targets]\ncheckerboard_side_m = [true]", 2, "targets.checkerboard_side_m"),
        ("[stations.S]\nlevelled = true\nlevelling_arcsec = true", 3, "levelling_arcsec"),
        ('[[scans]]\nfile = "a.las"\nnames = {A = [0.0, true, 0.0]}', 3, "names"),
    ],
)
def test_no_number_of_a_project_is_true_or_false(
    tmp_path: Path, text: str, line: int, key: str
) -> None:
    (tmp_path / "job.toml").write_text(text + "\n" + OBSERVED)
    with pytest.raises(InputError, match="true and false are no value of this key") as refused:
        Project.load(tmp_path / "job.toml")
    assert key in str(refused.value)
    assert refused.value.line == line


def test_what_asks_for_true_or_false_takes_it(tmp_path: Path) -> None:
    text = "[stations.S]\nlevelled = true\n[cloud]\nmerged = true\n[adjustment]\nvce = true\n"
    (tmp_path / "job.toml").write_text(text + OBSERVED)
    project = Project.load(tmp_path / "job.toml")
    assert project.stations["S"].levelled
    assert project.cloud.merged
    assert project.adjustment.vce


def test_no_number_of_a_calibration_file_is_true_or_false(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[calibration]\nschema = true\n")
    with pytest.raises(InputError, match=r"calibration\.schema is true or false"):
        read_calibration(tmp_path / "c.toml")


def test_projects_made_in_python_are_held_to_the_same() -> None:
    with pytest.raises(ValidationError, match="true and false are no value of this key"):
        Project(confidence=True)
