"""Keys that say how lists are written, and one value where a list is asked for."""

from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.network.facts import AssumedSigmas, ListReading, facts_of
from tribrach.project import Project
from tribrach.questions.adjust.adjusted import adjust_job

LEVELS = "from,to,height_difference_m,sigma_mm\nA,B,1.0,1\nB,C,1.0,1\nA,C,2.001,1\n"


def project(folder: Path, points: str, keys: str = "") -> Path:
    (folder / "levels.csv").write_text(LEVELS)
    (folder / "points.csv").write_text(points)
    path = folder / "p.toml"
    path.write_text(f'[points]\nfile = "points.csv"\n{keys}\n[observations]\nfile = "levels.csv"\n')
    return path


def test_one_value_is_a_list_of_one() -> None:
    loaded = Project.model_validate(
        {
            "points": {"file": "a.csv"},
            "scans": {"file": "a.laz"},
            "targets": {"sphere_radius_m": 0.0725},
            "registration": {"by": "clouds", "poses": "poses"},
            "gnss": {"navigation": "n.rnx"},
            "calibration": {"instrument": "a", "leave_out": "x10"},
            "plan": {"keep": "A", "scene": {"kind": "sphere", "center_m": [0, 0, 0], "size_m": 1}},
            "heights": {"target_at": "A", "seen_from": "B"},
            "datum": {"kind": "fixed", "points": "A"},
        }
    )
    assert loaded.targets.sphere_radius_m == (0.0725,)
    assert loaded.registration.by == ("clouds",)
    assert loaded.points[0].file == "a.csv"
    assert loaded.datum.points == ("A",)
    assert loaded.plan is not None
    assert loaded.plan.scene[0].size_m == (1.0,)
    assert loaded.calibration is not None
    assert loaded.calibration.instrument == ("a",)


def test_a_fixed_number_of_values_stays_so(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('[[scans]]\nfile = "a.laz"\nnames = { T = 1.0 }\n')
    with pytest.raises(InputError, match=r"a\.toml:3: scans.names.T is 1.0 and"):
        Project.load(path)


def test_columns_and_sigmas_of_the_project(tmp_path: Path) -> None:
    keys = 'columns = { point = "Pkt", easting = "Y", northing = "X" }\nsigma_plan_mm = 5\n'
    keys += "sigma_up_mm = 2"
    path = project(tmp_path, "Pkt;Y;X;Z\nA;1,5;2,5;100,25\nC;3,5;4,5;102,25\n", keys)
    job = open_job(path)
    assert job.survey.points["A"].xyz.tolist() == [1.5, 2.5, 100.25]
    (assumed,) = facts_of(job.survey.facts, AssumedSigmas)
    assert assumed.sentence.startswith("points.csv gives no sigmas: 5 mm in plan and 2 mm")
    (read,) = facts_of(job.survey.facts, ListReading)
    assert "decimals are written with a comma" in "; ".join(read.sentences)
    lines = dict(adjust_job(job).facts)
    assert lines["Sigmas of points.csv"] == assumed.sentence
    assert lines["How points.csv was read"] == "; ".join(read.sentences)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('separator = ";;"', "':;;' is no separator|';;' is no separator; give one character"),
        ('encoding = "utf-9"', "'utf-9' is no encoding that is known"),
        ('decimal = ";"', r"p\.toml:3: points.decimal is ';' and should be '.' or ','"),
    ],
)
def test_keys_that_say_nothing(tmp_path: Path, keys: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Project.load(project(tmp_path, "point,e_m,n_m,u_m\nA,0,0,0\n", keys))


def test_raw_files_have_no_columns(tmp_path: Path) -> None:
    (tmp_path / "a.gsi").write_text("*110001+000000000000000A 88...6+0000000000015620 \n")
    path = tmp_path / "p.toml"
    path.write_text('[[observations]]\nfile = "a.gsi"\ndecimal = ","\n')
    with pytest.raises(InputError, match=r"p\.toml:3: decimal says nothing about a.gsi"):
        open_job(path)
