"""Files of a folder by their content, and the project file that is made of them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.job.scans_of_boxes import empty_las
from tribrach.errors import InputError
from tribrach.io.instrument_sheets import find_sheet
from tribrach.job.first_project import Wishes, compose, parse_target, sheet_of
from tribrach.job.folder import FolderFile, look_through
from tribrach.job.opened import open_job
from tribrach.project import Project

GSI = Path(__file__).parents[2] / "fuzz" / "seeds" / "gsi"
LEVELS = "from,to,height_difference_m,sigma_mm\nA,B,1.0,1\nB,C,1.0,1\nA,C,2.001,1\n"
LISTED = "Nr;{};{};H\nA;1;2;3\nB;4;5;6\nC;1;3;5\n"


def known(folder: Path) -> dict[str, FolderFile]:
    return {one.path.name: one for one in look_through(folder)}


def test_files_are_known_by_content_and_not_by_name(tmp_path: Path) -> None:
    (tmp_path / "raw.txt").write_bytes(sorted(GSI.iterdir())[0].read_bytes())
    (tmp_path / "levels.txt").write_text(LEVELS)
    (tmp_path / "punkte.dat").write_text(LISTED.format("Rechtswert", "Hochwert"), "latin-1")
    (tmp_path / "list.pts").write_text("".join(f"P{k} {k}.5 {2 * k}.25 3.125\n" for k in range(9)))
    (tmp_path / "scan.pts").write_text("3\n" + "1.5 2.5 3.5 10\n" * 3)
    (tmp_path / "site.jpeg").write_bytes(b"\xff\xd8")
    (tmp_path / "letter.txt").write_text("Dear Sir,\nplease find the scans below.\n")
    (tmp_path / "empty.csv").write_text(" \n")
    empty_las(tmp_path / "S1.bin")
    np.savetxt(tmp_path / "cloud.asc", np.random.default_rng(1).normal(size=(2000, 3)), fmt="%.4f")
    (tmp_path / "out").mkdir()
    for name in ("report.html", "result.json", "cloud.laz"):
        (tmp_path / "out" / name).write_text("x")
    found = known(tmp_path)
    assert found["raw.txt"].words == "Leica GSI"
    assert found["levels.txt"].words == "3 rows of height differences"
    assert found["punkte.dat"].words == "3 points with coordinates, without sigmas"
    assert found["cloud.asc"].kind == found["scan.pts"].kind == "scans"
    assert found["list.pts"].kind == "points"
    reasons = {name: one.words for name, one in found.items() if one.kind == "not understood"}
    assert reasons == {
        "site.jpeg": "one of the pictures",
        "letter.txt": "text of no format that is known",
        "empty.csv": "it is empty; copy it again from its source",
        "S1.bin": "its scan has no points; export it again",
    }


def test_x_and_y_are_told_by_their_size_or_asked(tmp_path: Path) -> None:
    rows = "A;5300456,5;456123,1;5\nB;5300400,7;456200,0;6\n"
    (tmp_path / "utm.csv").write_text("Nr;X;Y;Z\n" + rows)
    (tmp_path / "bare.csv").write_text(rows)
    (tmp_path / "local.csv").write_text(LISTED.format("Y", "X"))
    found = known(tmp_path)
    for name, columns in (
        ("utm.csv", {"point": "Nr", "easting": "Y", "northing": "X"}),
        ("bare.csv", {"point": 1, "height": 4, "easting": 3, "northing": 2}),
    ):
        assert found[name].kind == "points", found[name].words
        assert found[name].form.columns == columns
        assert "as the size of the numbers tells" in found[name].remarks[0]
        table = found[name].table
        assert table is not None
        assert table.number("n").tolist() == [5300456.5, 5300400.7]
    assert found["local.csv"].assumed_axes == "north"
    (north,) = (f for f in look_through(tmp_path, "north") if f.path.name == "local.csv")
    assert north.form.columns == {"point": "Nr", "easting": "Y", "northing": "X"}


def test_the_project_opens_and_names_what_was_assumed(tmp_path: Path) -> None:
    (tmp_path / "levels.csv").write_text(LEVELS)
    (tmp_path / "points.csv").write_text(LISTED.format("Y", "X"))
    (tmp_path / "broken.csv").write_text("from,to,height_difference_m,sigma_mm\nA,B,x,1\n")
    made = compose(tmp_path, look_through(tmp_path, "north"), Wishes(control_sigma_mm=7))
    assert [path.name for path, _ in made.left] == ["broken.csv"]
    assert any("gives no sigmas: 7 mm in plan and in height are assumed" in t for t in made.assumed)
    (tmp_path / "p.toml").write_text(made.text)
    job = open_job(tmp_path / "p.toml")
    assert job.survey.points["A"].xyz.tolist() == [1, 2, 3]
    data = tomllib.loads(made.text)
    assert data["points"][0]["columns"] == {"point": "Nr", "easting": "Y", "northing": "X"}


def test_a_folder_without_measurements_is_refused_with_reasons(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"x")
    with pytest.raises(InputError, match="nothing that is measured was found") as refused:
        compose(tmp_path, look_through(tmp_path), Wishes())
    assert refused.value.__notes__ == ["  - a.jpg: one of the pictures"]
    with pytest.raises(InputError, match="there is no such folder"):
        look_through(tmp_path / "none")


def test_files_of_one_reason_share_a_line(tmp_path: Path) -> None:
    for k in range(1, 12):
        (tmp_path / f"a{k}.jpg").write_bytes(b"x")
    (tmp_path / "points.csv").write_text(LISTED.format("E", "N"))
    with pytest.raises(InputError, match="nothing that is measured was found") as refused:
        compose(tmp_path, look_through(tmp_path), Wishes())
    assert refused.value.__notes__ == [
        "  - points.csv: 3 points with coordinates, without sigmas: no observations go with it",
        "  - a1.jpg, a2.jpg, a3.jpg and 8 more: one of the pictures",
    ]


def test_levelling_alone_is_of_a_level(tmp_path: Path) -> None:
    """No total station is assumed, and heights that nobody measured are asked for."""
    (tmp_path / "levels.csv").write_text(LEVELS)
    (tmp_path / "points.csv").write_text("Nr;E;N;H\nA;1;2;0\nB;4;5;0\nC;1;3;0\n")
    wishes = Wishes(control_sigma_mm=3, control_sigma_up_mm=20)
    made = compose(tmp_path, look_through(tmp_path), wishes)
    data = tomllib.loads(made.text)
    assert list(data["instruments"]) == ["level"]
    assert data["observations"][0]["instrument"] == "level"
    assert (data["points"][0]["sigma_plan_mm"], data["points"][0]["sigma_up_mm"]) == (3, 20)
    said = " ".join(made.assumed)
    assert "3 mm in plan and 20 mm in height are assumed" in said
    assert "has the height 0 m for every point" in said
    assert "total station" not in said


@pytest.mark.parametrize("levelled", [None, True, False])
def test_whether_stations_are_levelled_is_said(tmp_path: Path, levelled: bool | None) -> None:
    for name in ("S1", "S2"):
        np.savetxt(
            tmp_path / f"{name}.asc", np.random.default_rng(1).normal(size=(2000, 3)), fmt="%.4f"
        )
    made = compose(tmp_path, look_through(tmp_path), Wishes(levelled=levelled))
    data = tomllib.loads(made.text)
    assert data["stations"]["S1"].get("levelled", False) is (levelled is True)
    assert any("--levelled" in one for one in made.assumed) is (levelled is None)


def test_names_that_toml_would_stumble_over(tmp_path: Path) -> None:
    (tmp_path / 'le "v" els.csv').write_text(LEVELS)
    (tmp_path / "pünkte.csv").write_text(LISTED.format("E", "N"))
    made = compose(tmp_path, look_through(tmp_path), Wishes())
    assert Project.model_validate(tomllib.loads(made.text)).observations


@pytest.mark.parametrize(
    ("words", "key", "size", "guessed"),
    [
        ("sphere:0.0725", "sphere_radius_m", 0.0725, False),
        ("sphere:72.5", "sphere_radius_m", 0.0725, True),
        ("Checkerboard:300mm", "checkerboard_side_m", 0.3, False),
        ("disc:5 cm", "disc_radius_m", 0.05, False),
        ("sphere:0,1", "sphere_radius_m", 0.1, False),
    ],
)
def test_targets_in_any_unit(words: str, key: str, size: float, guessed: bool) -> None:
    own, metres, said = parse_target(words)
    assert (own, bool(said)) == (key, guessed)
    assert metres == pytest.approx(size)


@pytest.mark.parametrize("words", ["ball:0.1", "sphere", "sphere:x", "sphere:1e9", "sphere:5000"])
def test_what_is_no_target(words: str) -> None:
    with pytest.raises(InputError, match="write sphere:RADIUS"):
        parse_target(words)


def test_models_may_be_named_in_part() -> None:
    assert sheet_of("Leica P40") == find_sheet("Leica ScanStation P40")
    assert sheet_of("rtc360") == find_sheet("Leica RTC360")
    with pytest.raises(InputError, match="there is no sheet"):
        sheet_of("Leica")
