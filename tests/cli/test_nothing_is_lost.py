"""No command replaces a file that it reads, or one that this program did not write."""

import hashlib
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN, end
from tribrach.cli import app
from tribrach.io.keeping import MANIFEST, STATE_FOLDER, is_read, keeping, refuse_loss
from tribrach.io.outputs import write_text
from tribrach.io.twins import write_twin
from tribrach.project import Project
from tribrach.simulate.twins import build

CONTROL = "point,x,y,z\nA,0,0,0\nB,100,0,0\nC,0,100,0\n"


def digests(folder: Path) -> dict[str, str]:
    """Contents of all files below a folder, by name."""
    return {
        path.relative_to(folder).as_posix(): hashlib.blake2b(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and STATE_FOLDER not in path.parts
    }


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("laboratory")
    write_twin(build("newcastle-lab", 10_000), folder)
    return folder


def test_scans_in_the_folder_of_clouds_stay(laboratory: Path, tmp_path: Path) -> None:
    job = tmp_path / "job"
    shutil.copytree(laboratory, job, ignore=shutil.ignore_patterns(STATE_FOLDER))
    (job / "scans").rename(job / "clouds")
    file = job / "newcastle-lab.toml"
    text = file.read_text().replace("scans/", "clouds/")
    file.write_text(re.sub(r'folder = "\w+"', 'folder = "."', text))
    before = digests(job)
    said = end("run", file, "-q", "--overwrite")
    assert "take the place of a file that is read" in said
    assert digests(job) == before


@pytest.mark.parametrize("command", ["adjust", "calibrate", "check", "plan"])
@pytest.mark.parametrize("option", ["--json", "--html"])
def test_files_that_a_project_names_stay(
    laboratory: Path, tmp_path: Path, command: str, option: str
) -> None:
    job = tmp_path / "job"
    shutil.copytree(laboratory, job)
    file = job / "newcastle-lab.toml"
    before = digests(job)
    others = [job / "control.csv", job / "scans" / "S1.laz", file]
    os.link(others[0], tmp_path / "hard.csv")
    (tmp_path / "soft.csv").symlink_to(others[0])
    for other in (*others, tmp_path / "hard.csv", tmp_path / "soft.csv"):
        said = end(command, file, option, other, "--overwrite")
        assert "take the place of a file that is read" in said
    assert digests(job) == before


def test_every_file_of_a_project_is_known(laboratory: Path) -> None:
    project = Project.load(laboratory / "newcastle-lab.toml")
    named = {path.relative_to(laboratory).as_posix() for path in project.inputs()}
    used = {entry.file for entry in (*project.points, *project.scans)}
    assert used | {"truth/truth.json", "newcastle-lab.toml"} == named


def test_links_below_the_results_are_not_followed(laboratory: Path, tmp_path: Path) -> None:
    job, out, elsewhere = tmp_path / "job", tmp_path / "out", tmp_path / "elsewhere"
    shutil.copytree(laboratory, job)
    elsewhere.mkdir()
    out.mkdir()
    (out / "clouds").symlink_to(elsewhere)
    said = end("run", job / "newcastle-lab.toml", "--out", out, "-q", "--overwrite")
    assert "results are not written through links" in said
    assert not any(elsewhere.iterdir())
    (out / "clouds").unlink()
    (out / "report.html").symlink_to(elsewhere / "report.html")
    said = end("run", job / "newcastle-lab.toml", "--out", out, "-q", "--overwrite")
    assert "results are not written through links" in said
    assert not any(elsewhere.iterdir())


def test_files_of_others_stay_until_they_may_go(tmp_path: Path) -> None:
    with keeping((), tmp_path):
        write_text(tmp_path / "report.txt", "ours")
        write_text(tmp_path / "report.txt", "ours again")
    (tmp_path / "notes.txt").write_text("mine")
    with keeping((), tmp_path), pytest.raises(Exception, match=r"did not write.*--overwrite"):
        write_text(tmp_path / "notes.txt", "theirs")
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with keeping((), tmp_path, overwrite=True):
        write_text(tmp_path / "notes.txt", "theirs")
    assert (tmp_path / "notes.txt").read_text() == "theirs"


def test_results_that_somebody_changed_stay_until_they_may_go(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    with keeping((), tmp_path):
        write_text(file, "A,1\n")
    # the date alone is no change: folders are copied
    os.utime(file, ns=(1, 1))
    with keeping((), tmp_path):
        write_text(file, "A,2\n")
    date = file.stat().st_mtime_ns
    file.write_text("A,3\n")
    with keeping((), tmp_path), pytest.raises(Exception, match="was changed after this program"):
        write_text(file, "A,4\n")
    assert file.read_text() == "A,3\n"
    # back as it was, it is ours again
    file.write_text("A,2\n")
    os.utime(file, ns=(date, date))
    with keeping((), tmp_path):
        write_text(file, "A,4\n")
    file.write_text("A,5\n")
    with keeping((), tmp_path, overwrite=True):
        write_text(file, "A,6\n")
    with keeping((), tmp_path):
        write_text(file, "A,7\n")


def test_a_run_killed_before_a_file_got_its_name_is_no_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "points.csv"
    with keeping((), tmp_path):
        write_text(file, "A,1\n")

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    for text in ("A,2\n", "A,3\n"):
        # the list is written under its own name, then the file would get its
        with monkeypatch.context() as patch, keeping((), tmp_path):
            patch.setattr("tribrach.io.outputs.os.replace", _second(os.replace, killed))
            with pytest.raises(KeyboardInterrupt):
                write_text(file, text)
        assert file.read_text() == "A,1\n"
    with keeping((), tmp_path):
        write_text(file, "A,4\n")
    assert file.read_text() == "A,4\n"


def _second(first: Callable[..., None], then: Callable[..., None]) -> Callable[..., None]:
    """One function at the first call and another at the second."""
    calls = iter((first, then))
    return lambda *args: next(calls)(*args)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"written": 3}', '{"written": {"a": "x"}}'])
def test_a_damaged_list_gives_nothing_away(tmp_path: Path, text: str) -> None:
    (tmp_path / STATE_FOLDER).mkdir()
    (tmp_path / STATE_FOLDER / MANIFEST).write_text(text)
    (tmp_path / "a").write_text("mine")
    with keeping((), tmp_path), pytest.raises(Exception, match="did not write"):
        write_text(tmp_path / "a", "theirs")


def test_simulations_replace_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "control.csv").write_text(CONTROL)
    said = end("simulate", "newcastle-lab", "--points", 10_000, "--out", tmp_path, "-q")
    assert "did not write" in said
    assert digests(tmp_path).keys() == {"control.csv"}
    call = ["simulate", "newcastle-lab", "--points", "10000", "--out", str(tmp_path), "-q"]
    assert RUN.invoke(app, [*call, "--overwrite"]).exit_code == 0
    assert (tmp_path / "control.csv").read_text() != CONTROL
    # the same job goes on, another one asks for a folder of its own
    assert RUN.invoke(app, call).exit_code == 0
    assert RUN.invoke(app, [*call, "--seed", "2"]).exit_code == 2
    assert RUN.invoke(app, [*call, "--seed", "2", "--overwrite"]).exit_code == 0


def test_the_rules_end_with_the_work(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("mine")
    with keeping([file]):
        assert is_read(file)
        with keeping((), tmp_path):
            assert is_read(file)
        with pytest.raises(Exception, match="is read"):
            refuse_loss(file)
    assert not is_read(file)
    refuse_loss(file)
