"""A run that is killed or meets a full disk leaves nothing wrong behind; another run is whole."""

import random
import subprocess
import sys
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


def counted(project: Path, folder: Path) -> tuple[int, int]:
    """Names that an undisturbed run gives, and writes that it makes."""
    done = strike(copied(project, folder), "count", 0)
    assert done.returncode == 0, done.stderr
    names, writes = done.stdout.split()
    return int(names), int(writes)


def checked(project: Path, folder: Path, whole: dict[str, bytes], what: str, number: int) -> None:
    """Strike once, look at what is left, run again: everything is as if nothing had happened."""
    disturbed = copied(project, folder)
    done = strike(disturbed, what, number)
    if what == "full":
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        assert "No space left on device" in done.stderr
        assert "tribrach: a file" not in done.stderr
        assert not list(disturbed.parent.rglob("*.part"))
    else:
        assert done.returncode == -9, (done.stdout, done.stderr)
    finish_here(disturbed)
    assert results(disturbed) == whole, (what, number)


def test_four_faults(job: Path, tmp_path: Path) -> None:
    undisturbed = copied(job, tmp_path / "whole")
    finish_here(undisturbed)
    whole = results(undisturbed)
    # the twentieth write is that of the list of what was written
    for what, number in (("before", 5), ("after", 12), ("full", 20), ("full", 90)):
        checked(job, tmp_path / f"{what}{number}", whole, what, number)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another survey, placed by resection; the project file."""
    folder = tmp_path_factory.mktemp("laboratory")
    return write_twin(build("newcastle-lab", 10_000, 1), folder, truth=0)


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
    names, _ = counted(project, tmp_path / "counted")
    for number in range(1, names + 1):
        for what in ("before", "after"):
            checked(project, tmp_path / f"{what}{number}", whole, what, number)


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
    _, writes = counted(project, tmp_path / "counted")
    numbers = set(range(1, min(20, writes) + 1))
    numbers |= set(random.Random(kind).sample(range(1, writes + 1), min(100, writes)))
    for number in sorted(numbers):
        checked(project, tmp_path / str(number), whole, "full", number)
