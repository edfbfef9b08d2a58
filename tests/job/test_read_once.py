"""What is remembered is read once a run, and what a run makes itself is never read."""

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from tribrach.cloud.shared_part import SharedPart
from tribrach.io.keeping import MANIFEST, STATE_FOLDER
from tribrach.io.twins import write_twin
from tribrach.job import steps
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.simulate.twins import build

#: told of every file that is opened, and how; hooks of Python stay until it ends
_HEARD: list[Callable[[str, bool], None]] = []


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and isinstance(arguments[0], str):
        reads = not arguments[2] & (os.O_WRONLY | os.O_RDWR)
        for heard in _HEARD:
            heard(arguments[0], reads)


@contextmanager
def reads_of_state(project: Project) -> Iterator[Counter[str]]:
    """How often files of what is remembered are opened to be read, by name.

    Clouds are looked through for their digest before they get their names, and notes of clouds for
    those of earlier runs: both are no products that are handed on.
    """
    counts, folder = Counter[str](), str(project.results / STATE_FOLDER)

    def heard(path: str, reads: bool) -> None:
        name = os.path.basename(path)
        if reads and path.startswith(folder) and not name.startswith(("made-", "file-cloud-")):
            counts[name] += 1

    _HEARD.append(heard)
    try:
        yield counts
    finally:
        _HEARD.remove(heard)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Two small scans of spheres in a courtyard, by their targets and planes."""
    sys.addaudithook(_hook)
    twin = build("sphere-courtyard", 10_000, 1)
    stations = [station for station in twin.stations if station.name in ("S1", "S2")]
    scans = [one for one in twin.scans if one.name in ("S1-targets", "S2-targets")]
    by = '[registration]\nby = ["targets", "planes"]\n'
    small = replace(twin, stations=stations, scans=scans, project=f"{twin.project}\n{by}")
    return Project.load(write_twin(small, tmp_path_factory.mktemp("job"), truth=0))


def test_a_run_reads_nothing_that_it_makes_and_a_later_one_reads_all_once(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = list[SharedPart]()
    original = steps.shared_part

    def counted(*given: Any, **more: Any) -> SharedPart:
        built.append(original(*given, **more))
        return built[-1]

    monkeypatch.setattr(steps, "shared_part", counted)
    with reads_of_state(project) as first:
        run(project)
    assert first == {}
    assert len(built) == 1
    with reads_of_state(project) as second:
        run(project)
    assert len(built) == 2
    state = project.results / STATE_FOLDER
    digests = {path.name for path in state.glob("file-*.json") if "cloud" not in path.name}
    assert len(digests) >= 2
    assert {MANIFEST, *digests, "targets-S1.json", "planes-S1.json", "surface-S1.json"} <= set(
        second
    )
    assert {name: count for name, count in second.items() if count > 1} == {}
