"""Small damaged files end in one sentence, exit status 2, and no traceback."""

import json
from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN, end
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.io.json_file import read_json
from tribrach.io.totalstation.text import packed_dms
from tribrach.project import Project


@pytest.mark.parametrize(
    "text", ["1" * 400, "[1e999]", '{"a": Infinity}', "NaN", "[" * 100_000, '{"a": -Infinity}', "{"]
)
def test_numbers_of_json(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"."):
        read_json(path)
    assert "this is no JSON of a comparison" in end("regress", path, "--x", "a", "--y", "b")


def test_json_is_what_it_was(tmp_path: Path) -> None:
    data = {"a": [1, -2.5, 123456789012345678, True, None], "b": {"c": "text"}}
    path = tmp_path / "a.json"
    path.write_text(json.dumps(data))
    assert read_json(path) == data


@pytest.mark.parametrize("number", ["1e13", "1e308", "inf", "nan", "1" * 30, "-1e20"])
def test_numbers_of_a_project(number: str, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("point,x,y,z\nA,0,0,0\n")
    path = tmp_path / "a.toml"
    path.write_text(f'[[points]]\nfile = "p.csv"\n\n[site]\nkind = "flat"\nsigma_m = {number}\n')
    with pytest.raises(InputError):
        Project.load(path)
    path.write_text(
        '[[observations]]\nfile = "p.csv"\n\n[instruments.total-station]\n'
        f"direction_arcsec = {number}\n"
    )
    with pytest.raises(InputError, match=r"a\.toml:5: ") as refused:
        Project.load(path)
    assert "beyond any measurement" in str(refused.value)


def test_angles_of_many_digits() -> None:
    with pytest.raises(ValueError, match="beyond any measurement"):
        packed_dms("1" * 400 + ".0000")


@pytest.mark.parametrize(
    "words",
    [
        ("adjust", "overflow/dynaml/msr.xml", "overflow/dynaml/stn.xml"),
        ("adjust", "overflow/nikon_sample.raw"),
        ("adjust", "overflow/w.snx"),
        ("adjust", "gvx/a.gvx"),
        ("run", "toml_overflow/konya-building.toml", "--out", "out"),
        ("run", "toml_overflow2/p.toml", "--out", "out"),
        ("compare", "poses/S1.laz", "poses/S2.laz"),
        ("check", "misc/field.csv", "--earlier", "tr.json"),
        ("transform", "apply", "tr.json", "toml_overflow/check.csv", "out.csv"),
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_small_files_that_once_failed(
    words: tuple[str, ...], shared_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    faults = shared_data / "faults"
    given = [str(faults / word) if (faults / word).is_file() else word for word in words]
    result = RUN.invoke(app, given)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stderr.startswith("tribrach: ")
    assert not any(tmp_path.iterdir())


def test_markup_in_names_is_text(shared_data: Path) -> None:
    result = RUN.invoke(app, ["info", str(shared_data / "faults" / "misc" / "markup.e57")])
    assert result.exit_code == 0
    assert "[/red]" in result.output
