"""Instrument files: what they fill in, what goes before them, and what is refused."""

from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.instruments.range_law import RangeLaw
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.project.instrument import Instrument

LAW = """
[instrument]
range_mm = 1.5
range_law_a_mm = 800.0
range_law_b = -0.75
range_law_c_mm = 0.4
range_law_from = 200
range_law_to = 40000
source = "noise of 4 scans, June"
"""
PROJECT = """
[instruments.GTL]
sheet = "Topcon GTL-1000"
file = "gtl.toml"
{more}
[[observations]]
file = "obs.csv"
"""


def project(folder: Path, file: str = LAW, more: str = "") -> Project:
    (folder / "gtl.toml").write_text(file)
    (folder / "job.toml").write_text(PROJECT.format(more=more))
    return Project.load(folder / "job.toml")


def test_typed_figures_go_before_the_file_and_the_file_before_the_sheet(tmp_path: Path) -> None:
    sheet = Instrument(sheet="Topcon GTL-1000").noise()
    noise = project(tmp_path).instruments["GTL"].noise()
    assert sheet is not None
    assert noise is not None
    assert noise.law == RangeLaw(0.8, -0.75, 0.0004, 200.0, 40_000.0)
    assert noise.range == 0.0015 != sheet.range
    assert (noise.horizontal, noise.beam_exit) == (sheet.horizontal, sheet.beam_exit)
    # the very figure of the sheet, typed, is typed all the same
    typed = f"range_mm = {1e3 * sheet.range:g}\nrange_law_c_mm = 0.5"
    again = project(tmp_path, more=typed).instruments["GTL"].noise()
    assert again is not None
    assert again.law is not None
    assert again.range == pytest.approx(sheet.range)
    assert (again.law.c, again.law.b) == (0.0005, -0.75)


def test_each_figure_has_its_source(tmp_path: Path) -> None:
    figures = {
        f.key: f for f in project(tmp_path, more="range_ppm = 3").instruments["GTL"].figures()
    }
    assert figures["range_law_b"].source == "noise of 4 scans, June"
    assert figures["range_mm"].source == "noise of 4 scans, June"
    assert figures["range_ppm"].source == "project file"
    assert "noise of 4 scans" not in figures["scan_angle_arcsec"].source


def test_a_file_may_name_the_sheet_and_an_angle_by_its_other_key(tmp_path: Path) -> None:
    text = '[instrument]\nsheet = "Topcon GTL-1000"\ndirection_arcsec = 2.0\n'
    (tmp_path / "one.toml").write_text(text)
    given = Project(
        instruments={"A": Instrument(file="one.toml", direction_both_faces_arcsec=1.0)}
    ).at(tmp_path)
    filled = open_job(given).project.instruments["A"]
    assert filled.sheet == "Topcon GTL-1000"
    assert filled.range_mm is not None
    assert (filled.direction_arcsec, filled.direction_both_faces_arcsec) == (None, 1.0)
    assert filled.file_is_read


def test_the_file_is_among_those_that_are_read(tmp_path: Path) -> None:
    assert tmp_path / "gtl.toml" in project(tmp_path).inputs()


@pytest.mark.parametrize(
    ("file", "line", "said"),
    [
        ("[instrument]\nrange_mm = -1\n", 2, "range_mm"),
        ("[instrument]\nrange_millimetre = 1\n", 2, "is unknown"),
        (
            "[instruments.A]\nrange_mm = 1\n",
            1,
            "has a table \\[instrument\\], and this one has none",
        ),
        ("range_mm = 1\nrange_ppm = 0\n", 1, "has a table \\[instrument\\], and this one has none"),
        ("range_ppm = 1\n[instrument]\nrange_mm = 1\n", 1, "range_ppm has no place in the top"),
        ("[instrument]\nrange_mm = true\n", 2, "range_mm: true and false are no value"),
        ("[instrument]\nrange_law_a_mm = 1\n", 1, "has range_law_b"),
        (LAW.replace("-0.75", "0.75"), 2, "has a = 0.8, b = 0.75"),
        ('[instrument]\nfile = "other.toml"\n', 2, "file names another file"),
        ('[instrument]\ncalibration = "c.toml"\n', 2, "calibration names another file"),
        ("[instrument\n", 1, "not TOML"),
        ("# " + "x" * 100_000, None, "MB"),
        ("", None, "empty"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(
    tmp_path: Path, file: str, line: int | None, said: str
) -> None:
    with pytest.raises(InputError, match=said) as refused:
        project(tmp_path, file)
    assert refused.value.file == tmp_path / "gtl.toml"
    if line is not None:
        assert refused.value.line == line


def test_figures_that_do_not_go_together_are_said_at_the_key(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"with gtl\.toml: the law of the noise") as refused:
        project(tmp_path, more="range_law_to = 100")
    assert (refused.value.file, refused.value.line) == (tmp_path / "job.toml", 4)


def test_without_a_file_that_is_there_nothing_is_opened(tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text(PROJECT.format(more=""))
    with pytest.raises(InputError, match="cannot be read"):
        Project.load(tmp_path / "job.toml")


def test_figures_of_a_file_that_do_not_count_are_named(tmp_path: Path) -> None:
    (tmp_path / "obs.csv").write_text("from,to,distance_m,sigma_mm\nA,B,10.0,1.0\n")
    told = project(tmp_path, more="range_mm = 1.5\nrange_law_c_mm = 0.5")
    assert told.instruments["GTL"].shadowed == ("range_law_c_mm",)
    said = "instrument GTL: range_law_c_mm of gtl.toml without effect"
    assert any(said in warning for warning in open_job(told).surveyed().warnings)
    assert project(tmp_path).instruments["GTL"].shadowed == ()


@pytest.mark.parametrize(
    ("more", "origin"), [("range_mm = 2.0", "project"), ("", "file"), ("", "sheet")]
)
def test_it_is_known_who_states_a_figure(tmp_path: Path, more: str, origin: str) -> None:
    file = LAW if origin == "file" else LAW.replace("range_mm = 1.5\n", "")
    assert project(tmp_path, file, more).instruments["GTL"].stated_by("range_mm") == origin


def test_figures_typed_without_a_sheet_are_those_of_the_project() -> None:
    assert Instrument(range_mm=2.0, scan_angle_arcsec=8.0).stated_by("range_mm") == "project"
