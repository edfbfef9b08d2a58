"""The demonstration: a whole job whose report agrees with the truth; nothing simulated twice."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.demo_twin import BOARDS, few_boards
from tribrach import demo
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.io.twins import write_twin
from tribrach.simulate.twin import Twin
from tribrach.simulate.twins import build

RUN = CliRunner()
SCAN = "scans/S2-targets.laz"


@pytest.fixture(scope="module", autouse=True)
def small() -> object:
    """Makes the demonstration a small one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "build", few_boards)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the demonstration, run; its output in ``said.txt``."""
    place = tmp_path_factory.mktemp("demo") / "demo"
    result = RUN.invoke(app, ["demo", "--out", str(place)])
    assert result.exit_code == 0, result.output
    (place / "said.txt").write_text(result.output)
    return place


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    """A copy of the demonstration to spoil."""
    return shutil.copytree(folder, tmp_path / "demo")


def stamps(folder: Path) -> dict[str, int]:
    """When each file of the project was written, results left out."""
    files = [
        p for p in folder.rglob("*") if p.is_file() and not {"out", ".tribrach"} & set(p.parts)
    ]
    return {str(p.relative_to(folder)): p.stat().st_mtime_ns for p in files}


def again(folder: Path, *, overwrite: bool = False) -> set[str]:
    """Call again; names of the files of the project that were written."""
    before = stamps(folder)
    demo.write_project(folder, overwrite=overwrite)
    return {name for name, when in stamps(folder).items() if before.get(name) != when}


def test_the_twin_is_that_of_the_facades_with_a_million_points() -> None:
    twin = build(demo.TWIN, demo.POINTS, 1)
    assert twin.name == "hanoi-facade"
    assert len(twin.stations) == 4
    assert demo.POINTS == 1_000_000


def test_the_run_agrees_with_the_truth(folder: Path) -> None:
    text = (folder / "out" / "report.txt").read_text()
    table = text.split("Against the truth\n", 1)[1].split("\n\n", 1)[0]
    assert "not so" not in table
    # the station, marks A to E, fourteen boards, all of them jointly, two of the cloud, targets
    assert table.count("as stated") > 10
    assert f"of {len(BOARDS)} in clear sight none missed" in table
    points = json.loads((folder / "out" / "result.json").read_text())["points"]
    truth = json.loads((folder / "truth" / "truth.json").read_text())["points"]
    for name in ("A", "B", "C", "D", "E", *BOARDS):
        for k in range(3):
            sigma = points[name]["covariance"][k][k] ** 0.5
            assert abs(points[name]["xyz"][k] - truth[name][k]) < 4 * sigma


def test_it_says_where_the_report_is(folder: Path) -> None:
    said = (folder / "said.txt").read_text()
    assert f"report: {folder / 'out' / 'report.html'}" in said
    assert f"clouds: {folder / 'out' / 'clouds'}" in said
    assert (folder / "out" / "report.html").is_file()
    assert len(list((folder / "out" / "clouds").glob("*.laz"))) == 1


def test_what_is_there_and_whole_stays(copy: Path) -> None:
    # what a user has edited stays as well
    with (copy / "hanoi-facade.toml").open("a") as file:
        file.write("# my own remark\n")
    assert again(copy) == set()
    result = RUN.invoke(app, ["demo", "--out", str(copy), "-q"])
    assert (result.exit_code, result.output) == (0, "")
    assert "my own remark" in (copy / "hanoi-facade.toml").read_text()


def test_a_table_that_is_gone_comes_back(copy: Path) -> None:
    (copy / "control.csv").unlink()
    assert again(copy) == {"control.csv"}


@pytest.mark.parametrize("harm", ["cut", "changed", "gone", "no truth", "bad truth"])
def test_a_damaged_scan_is_simulated_again(copy: Path, harm: str) -> None:
    scan, truth = copy / SCAN, copy / "truth" / "truth-S2.npz"
    whole = scan.read_bytes()
    if harm == "cut":
        scan.write_bytes(whole[:-1])
    elif harm == "changed":
        scan.write_bytes(whole[:-100] + bytes(100))
    elif harm == "gone":
        scan.unlink()
    elif harm == "no truth":
        truth.unlink()
    else:
        truth.write_bytes(truth.read_bytes()[:1000])
    (copy / "scans" / ".S2-targets.laz.part").write_bytes(b"half")
    if harm in ("cut", "changed", "bad truth"):
        # somebody may have cut it on purpose
        with pytest.raises(InputError, match="was changed after this program wrote it"):
            again(copy)
    assert again(copy, overwrite=True) >= {SCAN, "hanoi-facade.toml", "control.csv"}
    assert scan.read_bytes() == whole
    assert not list(copy.rglob("*.part"))


def test_other_wishes_make_another_project(copy: Path) -> None:
    twin = few_boards("hanoi-facade", 10_000, 2)
    before = (copy / SCAN).read_bytes()
    with pytest.raises(InputError, match="--overwrite"):
        write_twin(twin, copy)
    assert (copy / SCAN).read_bytes() == before
    assert json.loads((copy / "truth" / "truth.json").read_text())["seed"] == 1


def test_an_interrupted_simulation_leaves_no_project(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twin = few_boards("hanoi-facade", 10_000, 3)
    shutil.rmtree(copy)

    def interrupted(self: Twin, number: int) -> object:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Twin, "measure", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_twin(twin, copy)
    assert not (copy / "hanoi-facade.toml").exists()
    assert not list(copy.rglob("*.part"))
    path = write_twin(twin, copy)
    assert path.is_file()


@pytest.mark.parametrize("points", ["9999", "0", "many", "200000001"])
def test_numbers_of_points_that_make_no_sense(tmp_path: Path, points: str) -> None:
    result = RUN.invoke(app, ["demo", "--out", str(tmp_path / "d"), "--points", points])
    assert result.exit_code == 2
    assert "--points" in result.output
    assert not (tmp_path / "d").exists()
