"""A project run by workers leaves what one process leaves, byte by byte, whatever befalls them."""

import os
import pickle
import re
import signal
import threading
from dataclasses import dataclass, field
from pathlib import Path

import psutil
import pytest

from tests.job.test_killed import copied, finish_here, job, results
from tests.tasks.workers import MAY_BE_RESET, workers
from tribrach._types import Progress
from tribrach.comparison import tiles
from tribrach.demo import write_project
from tribrach.errors import InputError
from tribrach.io.twins import write_twin
from tribrach.job import clouds
from tribrach.job.cloud_file import open_cloud
from tribrach.job.compare import compare_clouds
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.simulate.twins import build
from tribrach.tasks.cluster import local_workers
from tribrach.tasks.engine import HERE, Engine

__all__ = ["job", "workers"]  # fixtures

pytestmark = MAY_BE_RESET


def silent(what: str, done: int, total: int | None) -> None:
    pass


@dataclass
class Killing:
    """Kills a worker at the beginning of every stage, so long after its first task was begun [s].

    of_clouds : names of clouds, whose progress has no other word; most : stages, from the first.
    """

    after: float
    of_clouds: set[str]
    most: int = 100
    stages: set[str] = field(default_factory=set)
    killed: int = 0

    def __call__(self, what: str, done: int, total: int | None) -> None:
        words = re.match(r"(\w+) of |(.+) against ", what)
        stage = "cloud" if what in self.of_clouds else words and (words[1] or "comparison")
        if stage and stage not in self.stages and len(self.stages) < self.most:
            self.stages.add(stage)
            threading.Timer(self.after, self.kill).start()

    def kill(self) -> None:
        """SIGKILL for one worker; those of the engine are the children that were spawned."""
        for child in psutil.Process().children():
            try:
                if "spawn_main" in " ".join(child.cmdline()):
                    os.kill(child.pid, signal.SIGKILL)
                    self.killed += 1
                    return
            except psutil.NoSuchProcess:
                continue


def worked(project: Path, engine: Engine, progress: Progress = silent) -> dict[str, bytes]:
    """What is left by a run of an engine."""
    run(Project.load(project), progress=progress, engine=engine)
    return results(project)


def test_workers_leave_what_one_process_leaves(
    job: Path, tmp_path: Path, workers: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even where some of them die; and then one process has nothing more to do."""
    alone, together = copied(job, tmp_path / "a"), copied(job, tmp_path / "b")
    finish_here(alone)
    whole, killing = results(alone), Killing(0.0, {"S1", "S2"}, most=2)
    assert worked(together, workers, killing) == whole
    assert killing.killed == len(killing.stages) == 2
    monkeypatch.setattr(clouds, "CloudProduct", None)
    assert worked(together, HERE) == whole


def test_workers_compare_tiles_as_one_process_does(
    job: Path, tmp_path: Path, workers: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    cloud = open_cloud(job.parent / "scans" / "S1-targets.laz", None)
    monkeypatch.setattr(tiles, "SIZE", 2000)
    said: list[str] = []
    alone = compare_clouds(cloud, cloud, limit=0.1)
    together = compare_clouds(
        cloud, cloud, limit=0.1, engine=workers, progress=lambda what, *_: said.append(what)
    )
    for what in ("distances on all", "normals", "distances along normals"):
        assert said.count(what) > 2
    assert pickle.dumps(together) == pickle.dumps(alone)


@pytest.mark.slow
def test_a_scan_that_kills_its_workers_is_named(
    job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was ready is kept; the run goes on from there once the scan is read elsewhere."""
    project = copied(job, tmp_path / "a")
    reader = tmp_path / "deadly"
    reader.mkdir()
    (reader / "sitecustomize.py").write_text(DEADLY)
    paths = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(reader), *paths]))
    with local_workers(2) as engine, pytest.raises(InputError) as refused:
        run(Project.load(project), engine=engine)
    assert re.match(
        r".*S2-targets\.laz: \w.*: every worker that began with this died", str(refused.value)
    )
    kept = [path.name for path in (project.parent / "out" / ".tribrach").glob("*.json")]
    assert any(name.startswith("targets-S1") for name in kept)
    assert not [name for name in kept if name.startswith("targets-S2")]
    assert not list((project.parent / "out").rglob("*made-*"))


#: opening the points of a scan of this name ends the process
DEADLY = """
import os, signal
import importlib.abc, sys

class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "tribrach.job.visits":
            sys.meta_path.remove(self)
            from tribrach.io.scans import las
            real = las.LasScan.stored
            def stored(scan, *more, **other):
                if scan.path.name == "S2-targets.laz":
                    os.kill(os.getpid(), signal.SIGKILL)
                return real(scan, *more, **other)
            las.LasScan.stored = stored
        return None

sys.meta_path.insert(0, Finder())
"""


def courtyard(folder: Path) -> Path:
    return write_twin(build("sphere-courtyard", 40_000, 1), folder, truth=0)


def facade(folder: Path) -> Path:
    return write_project(folder, 40_000, lambda *_: None)


def yards(folder: Path) -> Path:
    """Stations tied by targets, planes and clouds."""
    project = courtyard(folder)
    text = project.read_text()
    project.write_text(text + '\n[registration]\nby = ["targets", "planes", "clouds"]\n')
    return project


@pytest.mark.slow
@pytest.mark.parametrize("made", [facade, courtyard, yards])
def test_whole_projects_with_a_worker_killed_in_every_stage(made, tmp_path: Path) -> None:
    project = made(tmp_path / "job")
    alone, together = copied(project, tmp_path / "a"), copied(project, tmp_path / "b")
    finish_here(alone)
    whole = results(alone)
    names = {path.name.split(".")[0] for path in (alone.parent / "out" / "clouds").iterdir()}
    killing = Killing(0.2, names | {name.replace("_", " ") for name in names})
    with local_workers(2) as engine:
        assert worked(together, engine, killing) == whole
    assert killing.killed == len(killing.stages) >= 4
