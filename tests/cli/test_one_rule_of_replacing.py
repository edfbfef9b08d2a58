"""A file is replaced only by the command that wrote it, as the same kind of result."""

import os
import shutil
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_bad_scans import RUN
from tests.cli.test_nothing_is_lost import digests
from tribrach.cli import app
from tribrach.io import keeping as keeping_module
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.keeping import STATE_FOLDER, keeping
from tribrach.io.outputs import write_text
from tribrach.io.poses.names import JOINT, POSES

#: commands with the option that takes the name of a file; what they read stands in the job
COMMANDS: dict[str, tuple[str, ...]] = {
    "adjust --json": ("adjust", "net.toml", "--json"),
    "adjust --html": ("adjust", "net.toml", "--html"),
    "adjust --text": ("adjust", "net.toml", "--text"),
    "adjust --epoch": ("adjust", "net.toml", "--epoch"),
    "plan --json": ("plan", "calibrate.toml", "--json"),
    "calibrate --json": ("calibrate", "calibrate.toml", "--json"),
    "calibrate --out": ("calibrate", "calibrate.toml", "--out"),
    "check --html": ("check", "calibrate.toml", "--html"),
    "noise --out": ("noise", "cloud.ply", "--out"),
    "complete --json": ("complete", "cloud.ply", "--json"),
    "compare --png": ("compare", "cloud.ply", "other.ply", "--png"),
    "compare --json": ("compare", "cloud.ply", "other.ply", "--json"),
    "epochs --map": ("epochs", "net.toml", "net.toml", "--map"),
    "diff --json": ("diff", "out/result.json", "out/result.json", "--json"),
    "regress --json": ("regress", "cloud.ply", "--json"),
    "targets --json": ("targets", "cloud.ply", "--sphere-radius-mm", "70", "--json"),
    "register --json": ("register", "cloud.ply", "other.ply", "--out", "placed", "--json"),
    "series --alarms": ("series", "net.toml", "--alarms"),
    "transform fit --json": ("transform", "fit", "a.csv", "b.csv", "--json"),
    "transform apply": ("transform", "apply", "t.json", "a.csv"),
    "info --json": ("info", "cloud.ply", "--json"),
    "convert": ("convert", "cloud.ply"),
    "export": ("export", "net.toml", "--to", "gkf", "--out"),
    "init": ("init", ".", "--yes", "--out"),
}
#: files that none of them may take: what simulate and init wrote, results of runs and of others
FOREIGN = (
    "newcastle-lab.toml",
    "calibrate.toml",
    "control.csv",
    "check.csv",
    "scans/S1.laz",
    "truth/truth.json",
    "out/result.json",
    "out/clouds/S1.laz",
    f"out/clouds/{JOINT}",
    "mine.txt",
    "of-view.json",
)
#: of clouds that lie in the folder as well
PLAIN = "point,x_m,y_m,z_m\nA,0,0,0\nB,10,0,0\nC,0,10,1\nD,5,5,2\n"
NET = """\
title = "Net"
[site]
kind = "flat"
[instruments.level]
levelling_mm_per_sqrt_km = 1.0
[[points]]
file = "heights.csv"
role = "control"
[[observations]]
file = "levelling.csv"
instrument = "level"
"""


def cloud(path: Path, xyz: np.ndarray) -> Path:
    with create(path, CloudHeader(path.stem, (), step=1e-4)) as writer:
        writer.write(xyz, {})
    return path


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What simulate, a run and others wrote, and inputs of every command."""
    folder = tmp_path_factory.mktemp("rule")
    with keeping((), folder, command="simulate", kind="newcastle-lab --seed 1 with 9 rays"):
        for name in FOREIGN[:6]:
            write_text(folder / name, "title = 'simulated'\n")
    rng = np.random.default_rng(1)
    for name in ("cloud.ply", "other.ply"):
        cloud(folder / name, rng.uniform(-1, 1, (50, 3)))
    (folder / "net.toml").write_text(NET)
    (folder / "heights.csv").write_text("point,u_m,sigma_u_mm\nA,10,1\nB,11,1\n")
    (folder / "levelling.csv").write_text(
        "from,to,height_difference_m,length_m\nA,B,1.0003,100\nB,C,0.5,100\nC,A,-1.5,100\n"
    )
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text(PLAIN)
    (folder / "mine.txt").write_text("mine")
    with keeping((), folder / "out", command="run"):
        for name in ("result.json", "clouds/S1.laz", f"clouds/{POSES}", f"clouds/{JOINT}"):
            write_text(folder / "out" / name, "{}")
    with keeping(command="view"):
        write_text(folder / "of-view.json", "{}")
    return folder


@pytest.fixture
def here(job: Path) -> Iterator[Path]:
    """The job as the folder in which commands run."""
    before = Path.cwd()
    os.chdir(job)
    yield job
    os.chdir(before)


@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_foreign_is_replaced(here: Path, command: str) -> None:
    before = digests(here)
    for name in FOREIGN:
        result = RUN.invoke(app, [*COMMANDS[command], name])
        assert result.exit_code == 2, (name, result.output)
        assert digests(here) == before, name


def test_the_same_command_replaces_the_same_kind(here: Path, tmp_path: Path) -> None:
    file = tmp_path / "result"
    for command in ("adjust --json", "info --json", "adjust --text", "adjust --json"):
        file.unlink(missing_ok=True)
        for _ in range(2):
            assert RUN.invoke(app, [*COMMANDS[command], str(file)]).exit_code == 0
        for other in ("adjust --html", "adjust --epoch"):
            assert RUN.invoke(app, [*COMMANDS[other], str(file)]).exit_code == 2
    # somebody may say so
    words = [*COMMANDS["adjust --html"], str(file), "--overwrite"]
    assert RUN.invoke(app, words).exit_code == 0
    assert RUN.invoke(app, [*COMMANDS["adjust --json"], str(file)]).exit_code == 2


def test_a_file_that_a_project_names_is_an_input(here: Path, tmp_path: Path) -> None:
    for name in ("heights.csv", "levelling.csv"):
        shutil.copy(here / name, tmp_path)
    words = ["transform", "fit", "a.csv", "b.csv", "--json", str(tmp_path / "t.json")]
    assert RUN.invoke(app, words).exit_code == 0
    assert RUN.invoke(app, words).exit_code == 0
    (tmp_path / "net.toml").write_text(NET.replace("heights.csv", "./t.json"))
    assert RUN.invoke(app, words).exit_code == 2
    assert RUN.invoke(app, [*words, "--overwrite"]).exit_code == 0
    deep = tmp_path / "lists" / "t.json"
    deep.parent.mkdir()
    words[-1] = str(deep)
    assert [RUN.invoke(app, words).exit_code for _ in range(2)] == [0, 0]
    (tmp_path / "net.toml").write_text(NET.replace("heights.csv", "lists/../lists/t.json"))
    assert RUN.invoke(app, words).exit_code == 2


def test_a_run_replaces_no_run_of_another_project(here: Path, tmp_path: Path) -> None:
    for name in ("heights.csv", "levelling.csv", "net.toml"):
        shutil.copy(here / name, tmp_path)
    shutil.copy(here / "net.toml", tmp_path / "other.toml")
    words = [["run", str(tmp_path / name), "-q"] for name in ("net.toml", "other.toml")]
    assert [RUN.invoke(app, words[0]).exit_code for _ in range(2)] == [0, 0]
    before = digests(tmp_path / "out")
    assert RUN.invoke(app, words[1]).exit_code == 2
    assert digests(tmp_path / "out") == before
    assert RUN.invoke(app, [*words[1], "--overwrite"]).exit_code == 0


def test_one_digit_changed_and_the_date_kept(here: Path, tmp_path: Path) -> None:
    file = tmp_path / "t.txt"
    words = [*COMMANDS["adjust --text"], str(file)]
    assert RUN.invoke(app, words).exit_code == 0
    status = file.stat()
    text = file.read_text()
    file.write_text(text.replace("1", "2", 1))
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert RUN.invoke(app, words).exit_code == 2
    assert file.read_text() != text


@pytest.mark.parametrize(
    "words", [("retaining-wall",), ("newcastle-lab", "--seed", "2"), ("demo",)]
)
def test_a_folder_holds_one_simulated_job(job: Path, tmp_path: Path, words: tuple[str]) -> None:
    folder = tmp_path / "job"
    shutil.copytree(job, folder)
    before = digests(folder)
    call = ["demo"] if words == ("demo",) else ["simulate", *words]
    result = RUN.invoke(app, [*call, "--points", "10000", "--out", str(folder), "-q"])
    assert result.exit_code == 2
    assert digests(folder) == before


def test_what_belongs_to_clouds_is_never_replaced(here: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    files = [str(cloud(tmp_path / f"{n}.ply", rng.uniform(-1, 1, (50, 3)))) for n in "ab"]
    for name in (POSES, JOINT):
        (tmp_path / name).write_text("{}")
        for words in (
            ("register", *files, "--out", str(tmp_path / "out"), "--json"),
            ("compare", *files, "--html"),
            ("info", *files, "--json"),
            ("noise", *files, "--json"),
        ):
            result = RUN.invoke(app, [*words, str(tmp_path / name), "--overwrite"])
            assert result.exit_code == 2, (name, words, result.output)
            assert (tmp_path / name).read_text() == "{}"


#: what is open for reading while a command runs; a hook cannot be taken away, only silenced
_OPENED: list[set[Path]] = []


def _hook(event: str, args: tuple[object, ...]) -> None:
    if not _OPENED or event != "open" or not isinstance(args[0], str | bytes | Path):
        return
    made = isinstance(args[2], int) and args[2] & os.O_CREAT
    if args[1] in ("r", "rb", None) and not made:
        _OPENED[-1].add(Path(os.fsdecode(args[0])).resolve())


@cache
def _hooked() -> None:
    """Listen to what is opened."""
    sys.addaudithook(_hook)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_file_that_is_opened_is_claimed(
    here: Path, tmp_path: Path, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _hooked()
    claimed: set[Path] = set()
    add = keeping_module._Scope.add

    def adding(self: object, inputs: list[Path]) -> None:
        inputs = list(inputs)
        claimed.update(path.resolve() for path in inputs)
        add(self, inputs)

    monkeypatch.setattr(keeping_module._Scope, "add", adding)
    _OPENED.append(set())
    try:
        RUN.invoke(app, [*COMMANDS[command], str(tmp_path / "x.laz")])
    finally:
        opened = _OPENED.pop()
    mine = {
        path
        for path in opened
        if path.is_relative_to(here) and path.is_file() and STATE_FOLDER not in path.parts
    }
    projects = {path for path in mine if path.suffix == ".toml"} if command == "init" else set()
    assert mine - claimed - projects == set()
