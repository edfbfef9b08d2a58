"""A run that is killed or meets a full disk leaves nothing wrong behind; another run is whole."""

import random
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tests.job.test_killed import copied, finish_here, of_format, results
from tests.job.test_killed import job as job
from tribrach.io.twins import write_twin
from tribrach.simulate.twins import build

PATIENCE = 300.0


def strike(project: Path, what: str, number: int) -> subprocess.CompletedProcess[str]:
    """Run with a fault at a write."""
    command = [sys.executable, "-m", "tests.job.faults", str(project), what, str(number)]
    root = Path(__file__).parents[2]
    return subprocess.run(
        command, cwd=root, capture_output=True, text=True, timeout=PATIENCE, check=False
    )


def kept(project: Path, folder: Path) -> Path:
    """The project with what there is of results, in a folder of its own."""
    shutil.copytree(project.parent, folder)
    return folder / project.name


def counted(project: Path, folder: Path) -> tuple[int, int]:
    """Names that an undisturbed run gives, and writes that it makes."""
    done = strike(kept(project, folder), "count", 0)
    assert done.returncode == 0, done.stderr
    names, writes = done.stdout.split()
    return int(names), int(writes)


def struck(project: Path, folder: Path, what: str, number: int) -> Path:
    """A project whose run was disturbed once; nothing but a kill leaves something behind."""
    disturbed = kept(project, folder)
    done = strike(disturbed, what, number)
    if what == "full":
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        assert "No space left on device" in done.stderr
        assert "tribrach: a file" not in done.stderr
        assert not list(disturbed.parent.rglob("*.part"))
    else:
        assert done.returncode == -9, (done.stdout, done.stderr)
    return disturbed


def checked(project: Path, folder: Path, whole: dict[str, bytes], what: str, number: int) -> None:
    """Strike once, look at what is left, run again: everything is as if nothing had happened."""
    disturbed = struck(project, folder, what, number)
    finish_here(disturbed)
    assert results(disturbed) == whole, (what, number)


def searched(project: Path) -> int:
    """How many scans have been searched for targets."""
    return len(list(project.parent.glob("out/.tribrach/targets-*.json")))


@pytest.fixture(scope="module")
def whole(job: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What an undisturbed run leaves."""
    undisturbed = copied(job, tmp_path_factory.mktemp("whole") / "job")
    finish_here(undisturbed)
    return results(undisturbed)


# the twentieth write is that of the list of what was written
@pytest.mark.parametrize(
    ("what", "number"), [("before", 5), ("after", 12), ("full", 20), ("full", 90)]
)
def test_a_fault(
    job: Path, whole: dict[str, bytes], tmp_path: Path, what: str, number: int
) -> None:
    checked(job, tmp_path / "job", whole, what, number)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another survey, placed by resection on checkerboards; the project file."""
    twin = build("newcastle-lab", 10_000, 1)
    scans = [one for one in twin.scans if one.name.endswith("-targets")]
    return write_twin(replace(twin, scans=scans), tmp_path_factory.mktemp("laboratory"), truth=0)


#: surveys, and the formats of their clouds
KINDS = [("job", "laz"), ("job", "copc"), ("job", "ply"), ("job", "e57"), ("laboratory", "laz")]


@pytest.mark.slow
@pytest.mark.parametrize(("survey", "kind"), KINDS)
def test_killed_at_every_file(
    request: pytest.FixtureRequest, tmp_path: Path, survey: str, kind: str
) -> None:
    project = of_format(request.getfixturevalue(survey), tmp_path / "project", kind)
    undisturbed = copied(project, tmp_path / "whole")
    finish_here(undisturbed)
    whole = results(undisturbed)
    number = 0
    while searched(project) < searched(undisturbed):
        number += 1
        checked(project, tmp_path / f"before{number}", whole, "before", number)
        disturbed = struck(project, tmp_path / f"after{number}", "after", number)
        if searched(disturbed) == searched(undisturbed):
            # finding targets takes longest: the names after it are met by runs that begin here
            project = kept(disturbed, tmp_path / "searched")
        finish_here(disturbed)
        assert results(disturbed) == whole, ("after", number)
    names, _ = counted(project, tmp_path / "counted")
    for number in range(1, names + 1):
        for what in ("before", "after"):
            checked(project, tmp_path / f"later-{what}{number}", whole, what, number)


@pytest.mark.slow
@pytest.mark.parametrize(("survey", "kind"), KINDS)
def test_disk_full_at_many_writes(
    request: pytest.FixtureRequest, tmp_path: Path, survey: str, kind: str
) -> None:
    """At each of the first writes, and at a hundred of the others."""
    project = of_format(request.getfixturevalue(survey), tmp_path / "project", kind)
    undisturbed = copied(project, tmp_path / "whole")
    finish_here(undisturbed)
    whole = results(undisturbed)
    for number in range(1, 21):
        checked(project, tmp_path / str(number), whole, "full", number)
    scans = searched(undisturbed)
    project = struck(project, tmp_path / "searched", "searched", scans)
    _, writes = counted(project, tmp_path / "counted")
    # the last one gives the lock back, and nothing hangs on that
    for number in sorted(random.Random(kind).sample(range(1, writes), min(100, writes - 1))):
        checked(project, tmp_path / f"later{number}", whole, "full", number)
