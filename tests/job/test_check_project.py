"""Everything that is wrong in a project, at once: mistakes that people make."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.job.scans_of_boxes import empty_las
from tribrach.cli import app
from tribrach.errors import InputError, RankDefect
from tribrach.job.check_project import ProjectCheck, check_project
from tribrach.job.opened import open_job
from tribrach.job.plausibility import after_doubts
from tribrach.questions.adjust.adjusted import adjust_job

RUN = CliRunner()

#: a site: names, easting, northing, height
PLACES = {
    "PF1001": (691000.0, 5334000.0, 510.0),
    "PF1002": (691050.0, 5334020.0, 511.0),
    "PF1003": (691030.0, 5334080.0, 512.0),
    "PF1004": (690970.0, 5334060.0, 509.0),
}
HEAD = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\n"
PROJECT = """title = "Site"
[instruments.station]
direction_arcsec = 3
zenith_arcsec = 3
distance_mm = 1
[[points]]
file = "control.csv"
[[observations]]
file = "sights.csv"
instrument = "station"
"""


def sights(direction: float = 1.0, length: float = 1.0) -> str:
    """Readings from PF1001 to the others, angles and lengths times a factor."""
    rows = ["from,to,direction_gon,zenith_gon,slope_distance_m,height_instrument_m,height_target_m"]
    e, n, u = PLACES["PF1001"]
    for name, (x, y, z) in list(PLACES.items())[1:]:
        gon = math.degrees(math.atan2(x - e, y - n)) / 0.9 % 400
        far = math.hypot(x - e, y - n)
        zenith = math.degrees(math.atan2(far, z - u)) / 0.9
        slope = math.hypot(far, z - u) * length
        rows.append(f"PF1001,{name},{gon * direction:.5f},{zenith:.5f},{slope:.4f},0,0")
    return "\n".join(rows) + "\n"


def control(scale: float = 1.0, order: tuple[int, int, int] = (0, 1, 2), sigma: str = "5") -> str:
    rows = []
    for name, xyz in PLACES.items():
        cells = [f"{scale * xyz[k]:.4f}" for k in order]
        rows.append(",".join([name, *cells, sigma, sigma, sigma]))
    return HEAD + "\n".join(rows) + "\n"


def site(folder: Path, text: str = PROJECT, **files: str) -> Path:
    given = {"control.csv": control(), "sights.csv": sights()}
    given |= {name.replace("_", ".", 1): content for name, content in files.items()}
    for name, content in given.items():
        (folder / name).write_text(content)
    path = folder / "site.toml"
    path.write_text(text)
    return path


def mistakes(check: ProjectCheck) -> str:
    return "\n".join(map(str, check.mistakes))


def test_a_good_project_has_nothing_to_say(tmp_path: Path) -> None:
    check = check_project(site(tmp_path))
    assert check.good
    assert check.doubts == ()
    assert check.contents == "4 control points, 13 observations"


def test_01_a_missing_file(tmp_path: Path) -> None:
    path = site(tmp_path, PROJECT.replace("control.csv", "Control_.csv"))
    assert mistakes(check_project(path)) == (
        f"{path}:7: there is no file Control_.csv; did you mean control.csv."
    )


def test_02_a_key_that_is_misspelt(tmp_path: Path) -> None:
    path = site(tmp_path, PROJECT.replace("distance_mm", "distanz_mm"))
    assert (
        "site.toml:5: key instruments.station.distanz_mm is unknown; did you mean distance_mm"
        in (mistakes(check_project(path)))
    )


def test_03_a_word_that_is_none_of_those_allowed(tmp_path: Path) -> None:
    path = site(tmp_path, PROJECT.replace('"control.csv"', '"control.csv"\nrole = "kontrol"'))
    assert mistakes(check_project(path)) == (
        f"{path}:8: points.role is 'kontrol' and should be 'control', 'fixed', 'approximate' or "
        "'check'; did you mean control."
    )


def test_04_an_instrument_that_is_not_there(tmp_path: Path) -> None:
    path = site(tmp_path, PROJECT.replace('instrument = "station"', 'instrument = "Stations"'))
    assert mistakes(check_project(path)) == (
        f"{path}:10: instrument Stations is not defined; add a section [instruments.Stations]; did "
        "you mean station."
    )
    path = site(tmp_path, PROJECT.replace("distance_mm = 1", 'sheet = "Leica TS61"'))
    assert "no sheet of an instrument 'Leica TS61'; the nearest are Leica TS60" in (
        mistakes(check_project(path))
    )


def test_05_columns_that_are_exchanged(tmp_path: Path) -> None:
    check = check_project(site(tmp_path, control_csv=control(order=(1, 0, 2))))
    (doubt,) = check.doubts
    assert "4 given points (PF1001, PF1002, PF1003, PF1004) do not fit" in doubt
    assert doubt.endswith(
        "m if easting and northing are exchanged: are two columns of the list in each other's place"
    )
    check = check_project(site(tmp_path, control_csv=control(order=(0, 2, 1))))
    assert any("northing and height are exchanged: are" in text for text in check.doubts)


def test_06_sigmas_that_are_missing(tmp_path: Path) -> None:
    bare = control().replace(",sigma_e_mm,sigma_n_mm,sigma_u_mm", "").replace(",5,5,5", "")
    told = mistakes(check_project(site(tmp_path, control_csv=bare)))
    assert (
        "control.csv:2: control point PF1001 has a coordinate without sigma; add sigma_e_mm" in told
    )
    assert "control.csv:5: control point PF1004" in told
    assert "sigma_plan_mm" in told


def test_07_millimetres_for_metres(tmp_path: Path) -> None:
    (far,) = check_project(site(tmp_path, control_csv=control(scale=1000))).doubts[:1]
    assert "1000 times as far apart as the distances between them say" in far
    assert "the coordinates are millimetres" in far
    doubts = check_project(site(tmp_path, control_csv=control(sigma="5000"))).doubts
    assert doubts[0].startswith("the sigma of control point PF1001 is 5 m, and that of 3 others")
    path = site(tmp_path, PROJECT.replace("distance_mm = 1", "distance_mm = 0.001"))
    assert check_project(path).doubts == (
        "[instruments.station]: distance_mm is 0.001: is it in millimetres",
    )


def test_08_a_point_that_was_renamed(tmp_path: Path) -> None:
    renamed = sights().replace("PF1003", "pf-1003")
    (doubt,) = check_project(site(tmp_path, sights_csv=renamed)).doubts
    assert doubt == (
        "point PF1003 of the lists is observed by nothing, and pf-1003, which is observed and in "
        "no list, lies 0.00 m from where PF1003 is given: "
        "is pf-1003 meant to be PF1003"
    )
    other = sights().replace("PF1003", "FP1003")
    assert (
        "is FP1003 meant to be PF1003" in check_project(site(tmp_path, sights_csv=other)).doubts[0]
    )


def test_09_angles_in_another_unit(tmp_path: Path) -> None:
    doubts = check_project(site(tmp_path, sights_csv=sights(direction=0.9))).doubts
    assert any(
        text.endswith("the angles are taken as degrees instead of gon: is their unit right")
        for text in doubts
    )


def test_10_feet(tmp_path: Path) -> None:
    doubts = check_project(site(tmp_path, sights_csv=sights(length=1 / 0.3048))).doubts
    assert any("it looks as if the distances are feet" in text for text in doubts)


def test_11_a_scan_that_is_empty(tmp_path: Path) -> None:
    empty_las(tmp_path / "S1.las")
    path = site(tmp_path, PROJECT + '[[scans]]\nfile = "S1.las"\nstation = "S1"\n')
    assert "S1.las: the scan S1 has no points; export it again" in mistakes(check_project(path))


def test_12_a_point_that_is_there_twice(tmp_path: Path) -> None:
    twice = control() + control().splitlines()[2] + "\n"
    told = mistakes(check_project(site(tmp_path, control_csv=twice)))
    assert "PF1002" in told
    assert "control.csv:6" in told
    both = PROJECT + '[[points]]\nfile = "more.csv"\n'
    told = mistakes(check_project(site(tmp_path, both, more_csv=control())))
    assert "PF1001" in told
    assert "more.csv" in told


def test_13_coordinates_outside_of_their_reference_system(tmp_path: Path) -> None:
    text = PROJECT.replace("[instruments", '[site]\ncrs = "EPSG:25832"\n[instruments', 1)
    assert check_project(site(tmp_path, text)).doubts == ()
    zone = control().replace("69", "3269", 1).replace(",69", ",3269")
    doubts = check_project(site(tmp_path, text, control_csv=zone)).doubts
    assert any("without the first two digits of the easting" in d for d in doubts), doubts
    doubts = check_project(site(tmp_path, text, control_csv=control(order=(1, 0, 2)))).doubts
    assert any("inside if easting and northing are exchanged" in d for d in doubts), doubts


def test_14_stations_that_nothing_observes(tmp_path: Path) -> None:
    (tmp_path / "targets.csv").write_text(
        "station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm\nS1,PF1001,1,2,3,1,1,1\n"
    )
    text = PROJECT + '[[observations]]\nfile = "targets.csv"\n[stations.s1]\nlevelled = true\n'
    assert "station s1 is scanned and observed by nothing; did you mean S1" in (
        mistakes(check_project(site(tmp_path, text)))
    )


def test_all_of_them_in_one_go(tmp_path: Path) -> None:
    """Mistakes of the project, of its files and of its scans, each with its own line."""
    text = (
        PROJECT.replace("distance_mm", "distanz_mm")
        .replace('"control.csv"', '"control.csv"\nrole = "kontrol"')
        .replace('instrument = "station"', 'instrument = "Stations"')
    )
    text += '[[scans]]\nfile = "S9.laz"\n[targets]\nsphere_radius_m = 72.5\n'
    rows = "".join(f"X{k},a,2,3,4,5,6\n" for k in range(30))
    path = site(tmp_path, text, control_csv=control() + rows)
    check = check_project(path)
    lines = [(Path(str(error.file)).name, error.line) for error in check.mistakes]
    assert {("site.toml", k) for k in (5, 8, 11, 13)} <= set(lines)
    # no "and 10 more": every row of the list has its sentence
    assert [line for name, line in lines if name == "control.csv"] == list(range(6, 36))
    assert any("sphere_radius_m is 72.5" in text for text in check.doubts)


def test_the_command_and_the_dry_run_say_the_same(tmp_path: Path) -> None:
    path = site(tmp_path, PROJECT.replace("control.csv", "contrl.csv"))
    told = RUN.invoke(app, ["check-project", str(path)])
    same = RUN.invoke(app, ["run", "--dry-run", str(path)])
    assert told.exit_code == same.exit_code == 2
    assert told.stderr == same.stderr
    assert "1 mistake:" in told.stderr
    good = RUN.invoke(app, ["run", "--dry-run", str(site(tmp_path))])
    assert good.exit_code == 0
    assert "nothing would stop a run" in good.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["", "a = ", "\x00", "[points]\nfile = 'a'\n[[points]]\n"])
def test_what_is_no_project(tmp_path: Path, text: str) -> None:
    path = tmp_path / "p.toml"
    path.write_text(text)
    check = check_project(path)
    assert len(check.mistakes) == 1


def test_a_control_point_of_another_name_is_found_by_its_place(tmp_path: Path) -> None:
    check = check_project(site(tmp_path, control_csv=control().replace("PF1003", "QX7")))
    assert check.doubts == (
        "point QX7 of the lists is observed by nothing, and PF1003, which is observed and in no "
        "list, lies 0.00 m from where QX7 is given: is PF1003 meant to be QX7",
    )
    assert "3 of 4 control points observed (QX7 by nothing)" in check.contents
    # a given point elsewhere is counted, and nothing is guessed of it
    (tmp_path / "control.csv").write_text(control() + "QX7,691200,5334000,510,5,5,5\n")
    check = check_project(tmp_path / "site.toml")
    assert check.doubts == ()
    assert "4 of 5 control points observed (QX7 by nothing)" in check.contents


def test_what_is_doubtful_is_said_before_scans_that_fit_nowhere(tmp_path: Path) -> None:
    job = open_job(site(tmp_path, control_csv=control(order=(1, 0, 2))))
    error = InputError("station S1 cannot be matched", record="S1", cure="name its targets")
    said = str(after_doubts(error, job.project, job.survey))
    assert said.startswith("S1: 4 given points (PF1001, PF1002, PF1003, PF1004) do not fit")
    assert said.endswith("place? As it is: station S1 cannot be matched; name its targets.")
    job = open_job(site(tmp_path, control_csv=control()))
    assert after_doubts(error, job.project, job.survey) is error


def test_a_missing_scan_is_one_mistake(tmp_path: Path) -> None:
    text = PROJECT + '[[scans]]\nfile = "S1.las"\nstation = "S1"\n[stations.S1]\nlevelled = true\n'
    check = check_project(site(tmp_path, text))
    assert len(check.mistakes) == 1
    assert "there is no file S1.las" in mistakes(check)
    (tmp_path / "S1.las").write_bytes(b"LASF and nothing else")
    check = check_project(tmp_path / "site.toml")
    assert len(check.mistakes) == 1
    assert "observed by nothing" not in mistakes(check)


def test_15_control_whose_names_are_all_others(tmp_path: Path) -> None:
    check = check_project(site(tmp_path, control_csv=control().replace("PF100", "Mark ")))
    assert any("none of the control points (Mark 1, Mark 2, " in text for text in check.doubts)
    assert "0 of 4 control points observed" in check.contents
    told = mistakes(check)
    assert "not tied to a frame" in told
    assert "shift in E, shift in N, shift in U" in told


def test_16_leading_zeros(tmp_path: Path) -> None:
    given = control().replace("PF100", "000")
    check = check_project(
        site(tmp_path, control_csv=given, sights_csv=sights().replace("PF100", ""))
    )
    assert check.doubts[0].endswith("observed and in no list: is 1 meant to be 0001")


def test_17_control_without_heights(tmp_path: Path) -> None:
    rows = [line.split(",") for line in control().splitlines()]
    plan = "\n".join(",".join([*row[:3], *row[4:6]]) for row in rows) + "\n"
    told = mistakes(check_project(site(tmp_path, control_csv=plan)))
    assert "can still move without any observation noticing: shift in U (1 in all)" in told


@pytest.mark.parametrize(
    ("old", "new", "cure"),
    [
        ("distance_mm = 1", "distance_mm = 1,5", "write decimals with a point, 1.5"),
        ('"control.csv"', '"C:\\daten\\control.csv"', "write / in paths"),
        ('"control.csv"', "\u201ccontrol.csv\u201d", "write plain quotation marks"),
        ('"control.csv"', "control.csv", "put words into quotation marks"),
    ],
)
def test_18_what_is_no_toml(tmp_path: Path, old: str, new: str, cure: str) -> None:
    (mistake,) = check_project(site(tmp_path, PROJECT.replace(old, new))).mistakes
    assert "site.toml:" in str(mistake)
    assert cure in str(mistake)


def test_19_files_that_are_not_what_their_names_say(tmp_path: Path) -> None:
    text = PROJECT.replace("control.csv", "list.xlsx").replace("sights.csv", "job.gsi")
    (tmp_path / "list.xlsx").write_text(control())
    told = mistakes(check_project(site(tmp_path, text, job_gsi="\n")))
    assert "list.xlsx: the file is no spreadsheet" in told
    assert "job.gsi: the file is empty" in told
    (tmp_path / "~$list.xlsx").write_bytes(b"\x05Meier" + b" " * 159)
    told = mistakes(check_project(site(tmp_path, PROJECT.replace("control.csv", "~$list.xlsx"))))
    assert "what Excel leaves beside one that is open; give list.xlsx" in told


def test_20_units_in_cells(tmp_path: Path) -> None:
    told = mistakes(check_project(site(tmp_path, control_csv=control(sigma="5 mm"))))
    assert "sigma_e_mm is '5 mm', not a number; write 5: the unit stands in the head" in told


def test_a_run_says_what_looks_wrong_as_well(tmp_path: Path) -> None:
    """Where the network cannot be adjusted, and where it fails its test, with the cause first."""
    other = site(tmp_path, control_csv=control().replace("PF100", "Mark "))
    with pytest.raises(RankDefect, match="are they the same points under other names"):
        adjust_job(open_job(other))
    swapped = control(order=(1, 0, 2), sigma="9000")
    with pytest.raises(InputError, match=r"and northing are exchanged: are .* As it is"):
        adjust_job(open_job(site(tmp_path, control_csv=swapped)))
    wrong = control(sigma="90").replace("691050", "691058")
    content = adjust_job(open_job(site(tmp_path, control_csv=wrong)))
    assert any("do not fit what was measured between them" in text for text in content.warnings)
