"""Tasks on workers: the results of this process, whatever happens to the workers."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import Client
from typer.testing import CliRunner

from tests.tasks import errands
from tests.tasks.workers import MAY_BE_RESET, workers
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.tasks import cluster
from tribrach.tasks.cluster import local_workers, remote_workers
from tribrach.tasks.engine import HERE, Call, Engine

__all__ = ["workers"]  # a fixture

pytestmark = MAY_BE_RESET
ROOT = Path(__file__).resolve().parents[2]
#: nothing takes longer, even on a busy machine [s]
PATIENCE = 240.0


def done(
    engine: Engine,
    task: Callable[..., Any],
    *values: Any,
    said: list[str] | None = None,
    results: dict[int, Any] | None = None,
    then: Callable[[int], None] = lambda count: None,
) -> dict[int, Any]:
    """Results by the numbers of the calls; ``then`` is told how many there are."""
    calls = [
        Call(f"errand {k}", value if isinstance(value, tuple) else (value,), Path(f"{k}.laz"))
        for k, value in enumerate(values)
    ]
    words: list[str] = [] if said is None else said
    out: dict[int, Any] = {} if results is None else results
    for number, result in engine.completed(task, calls, lambda what, *_: words.append(what)):
        out[number] = result
        then(len(out))
    return out


def test_results_and_words_of_tasks_are_those_of_this_process(workers: Engine) -> None:
    numbers = (1.0, 2.5, 1 / 3)
    here: list[str] = []
    there: list[str] = []
    assert done(workers, errands.squared, *numbers, said=there) == done(
        HERE, errands.squared, *numbers, said=here
    )
    assert set(there) <= set(here)
    assert {f"errand {k}" for k in range(3)} <= set(there)


def test_nothing_is_started_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_local", None)
    with local_workers(2) as engine:
        assert done(engine, errands.squared) == {}


def test_the_first_failure_is_told_whoever_fails_first(workers: Engine) -> None:
    for _ in range(3):
        with pytest.raises(InputError) as refused:
            done(workers, errands.positive, 1.0, -1.0, -2.0, 3.0)
        assert str(refused.value) == "numbers.csv:3: -1.0 is negative; drop the sign."
        assert refused.value.cure == "drop the sign"


def test_a_task_whose_worker_dies_is_done_again(workers: Engine, tmp_path: Path) -> None:
    values = [(float(k), tmp_path / "flag" if k == 1 else None) for k in range(4)]
    assert done(workers, errands.killed_once, *values) == {0: 0.0, 1: 1.0, 2: 4.0, 3: 9.0}
    assert (tmp_path / "flag").exists()


def test_a_result_that_dies_with_its_worker_is_made_again(
    workers: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The task was done, and nobody had its result yet."""
    monkeypatch.setattr(cluster, "_ANSWER", 0.5)
    real, killed = cluster._Work._ended, []

    def late(work: Any, number: int, future: Any) -> Iterator[tuple[int, Any]]:
        if not killed:
            killed.append(number)
            done_by = workers.client().who_has([future])[future.key]
            for address, pid in workers.client().run(os.getpid).items():
                if address in done_by:
                    os.kill(pid, signal.SIGKILL)
        yield from real(work, number, future)

    monkeypatch.setattr(cluster._Work, "_ended", late)
    assert done(workers, errands.slept, 0.6, 0.6, 0.6) == {0: 0.6, 1: 0.6, 2: 0.6}
    assert killed


def test_a_task_that_always_kills_its_worker_is_named_and_no_other(workers: Engine) -> None:
    results: dict[int, float] = {}
    with pytest.raises(InputError) as refused:
        done(workers, errands.killing, 0.0, 1.0, 2.0, 3.0, results=results)
    # what comes before it is done all the same
    assert {number: results[number] for number in (0, 1)} == {0: 0.0, 1: 1.0}
    assert str(refused.value).startswith("2.laz: errand 2: every worker that began with this died")
    assert "3 in all, the last one with nothing beside it" in str(refused.value)
    assert done(workers, errands.squared, 3.0) == {0: 9.0}


def test_a_worker_with_other_code_is_refused(
    workers: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "_version", lambda task: "Python 3.99")
    with pytest.raises(InputError, match=r"would give other results: it has Python 3\.\d+, numpy"):
        done(workers, errands.squared, 1.0)


def test_a_worker_that_does_not_see_the_folder_is_refused(
    workers: Engine, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(os, "getcwd", lambda: str(tmp_path / "elsewhere"))
    with pytest.raises(InputError, match="does not see this folder"):
        done(workers, errands.squared, 1.0)


def test_workers_share_the_processors(workers: Engine) -> None:
    own = max(1, cluster._processors() // 2)
    assert done(workers, errands.threads, 0) == {0: {"compiled": own, "sums": "1"}}


def test_ctrl_c_is_for_the_command_alone(workers: Engine) -> None:
    """A terminal sends it to workers as well, which would say a hundred lines each."""
    assert done(workers, errands.deaf, 0) == {0: True}
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == set()


def test_nobody_else_reaches_the_workers(workers: Engine) -> None:
    """They listen on this machine alone, and take nothing from whoever has no key."""
    done(workers, errands.squared, 1.0)
    doors = []
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        # one that another test killed may end while it is asked
        with suppress(psutil.NoSuchProcess):
            connections = process.net_connections("inet")
            doors += [one.laddr for one in connections if one.status == psutil.CONN_LISTEN]
    assert doors
    assert {door.ip for door in doors} == {"127.0.0.1"}
    scheduler = workers.client().scheduler.address
    assert scheduler.startswith("tls://127.0.0.1:")
    silent = "no scheduler of Dask answers at tcp"
    other = remote_workers(scheduler.replace("tls", "tcp"))
    with other as engine, pytest.raises(InputError, match=silent):
        done(engine, errands.squared, 1.0)


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler and one worker of it, as somebody would start them."""
    note = tmp_path / "scheduler.json"
    start = [sys.executable, "-m", "dask"]
    paths = os.pathsep.join([str(ROOT), str(ROOT / "src")])
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet |= {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": paths}}
    file = ["--scheduler-file", str(note), "--no-dashboard", "--host", "127.0.0.1"]
    first = subprocess.Popen([*start, "scheduler", *file, "--port", "0"], **quiet)
    second = subprocess.Popen([*start, "worker", *file, "--nthreads", "1", "--no-nanny"], **quiet)
    try:
        until = time.monotonic() + PATIENCE
        # it is there before it is written
        while (
            not (note.exists() and note.read_text().rstrip().endswith("}"))
            and time.monotonic() < until
        ):
            time.sleep(0.05)
        with Client(scheduler_file=str(note)) as client:
            client.wait_for_workers(1, timeout=PATIENCE)
            address = client.scheduler.address
        yield address, first
    finally:
        for process in (second, first):
            process.kill()
            process.wait()


def test_a_lost_scheduler_is_a_sentence(scheduler: tuple[str, subprocess.Popen[bytes]]) -> None:
    address, process = scheduler
    results: dict[int, float] = {}

    def lose(count: int) -> None:
        if count == 2:
            process.kill()
            process.wait()

    lost = "is lost; 2 of 5 tasks were done and are kept; run the command again"
    with remote_workers(address) as engine, pytest.raises(InputError, match=lost):
        done(engine, errands.slept, *(0.3,) * 5, results=results, then=lose)
    assert results == {0: 0.3, 1: 0.3}


def test_no_scheduler_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_ANSWER", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1"):
        silent = pytest.raises(InputError, match="no scheduler of Dask answers at")
        with remote_workers(address) as engine, silent:
            done(engine, errands.squared, 1.0)


def test_without_dask_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    missing = r'pip install "tribrach\[cluster\]"'
    with pytest.raises(InputError, match=missing), local_workers(2):
        pass


def test_both_options_are_refused(tmp_path: Path) -> None:
    project = tmp_path / "project.toml"
    project.write_text('title = "x"\n')
    result = CliRunner().invoke(
        app, ["run", str(project), "--workers", "2", "--scheduler", "tcp://127.0.0.1:9"]
    )
    assert result.exit_code == 2
    assert "give --workers or --scheduler" in result.output
