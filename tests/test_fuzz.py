"""Mutated files end in a sentence or are read, for every reader; and the means to find that out."""

import importlib.util
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz import watch
from fuzz.readers import READERS, SEEDS, Reader
from fuzz.record import Record, table
from fuzz.watch import Limits, input_of, read_inputs

from tribrach.errors import InputError
from tribrach.io.scans.formats import READERS as SCANS
from tribrach.io.survey.formats import FORMATS
from tribrach.io.totalstation.formats import READERS as RAW
from tribrach.io.totalstation.formats import format_of, recognised

ROOT = Path(__file__).parents[1]
#: of all readers, at every check and before a release; the long run is made by hand
#: (python -m fuzz --inputs 1000000)
INPUTS = [5_000, pytest.param(20_000, marks=pytest.mark.slow)]
NEEDED = {"rinex, packed": "hatanaka"}
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="workers are watched through /proc")


def test_every_reader_has_seeds_and_every_format_a_reader() -> None:
    folders = {name.replace(", ", "-").replace(" ", "-") for name in READERS}
    assert folders == {entry.name for entry in SEEDS.iterdir()}
    raw = {format_of(path) for path in SEEDS.glob("*/*") if path.is_file() and recognised(path)}
    lacking = RAW.keys() - raw
    assert not lacking, f"no file in fuzz/seeds is a {' or a '.join(lacking)}: add a small one"
    assert FORMATS.keys() - {"totalstation", "gnss"} <= READERS.keys()
    assert set(SCANS.values()) <= READERS.keys()


def test_an_input_is_the_same_again() -> None:
    for name in ("gsi", "las", "gama", "project", "sp3"):
        first = [input_of(name, k)[1] for k in range(20)]
        assert first == [input_of(name, k)[1] for k in range(20)]
        assert len(set(first)) > 10


@LINUX
@pytest.mark.parametrize("inputs", INPUTS)
def test_mutated_files_are_read_or_refused(tmp_path: Path, inputs: int) -> None:
    """In a process of its own: what threads this one has begun is lost in workers."""
    names = [
        name
        for name in READERS
        if name not in NEEDED or importlib.util.find_spec(NEEDED[name]) is not None
    ]
    words = ["--reader", "/".join(names), "--inputs", str(inputs), "--out", str(tmp_path)]
    done = _run("fuzz", *words, timeout=1500)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    record = Record(tmp_path)
    for name in names:
        figures = record.of(name)
        assert figures["done"] >= inputs // len(READERS)
        assert figures["read"] > 0, name
        assert figures["refused"] > 0, name
        assert not record.findings(name)


def _run(module: str, *words: str, timeout: float) -> subprocess.CompletedProcess[str]:
    """Run a module of the project in a process of its own."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    environment |= {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    command = [sys.executable, "-m", module, *words]
    return subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=timeout,
        check=False,
    )  # fmt: skip


def _raised(paths: list[Path]) -> None:
    raise ZeroDivisionError("once")


def _killed(paths: list[Path]) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def _slow(paths: list[Path]) -> None:
    end = time.process_time() + 1.3
    while time.process_time() < end:
        pass


def _endless(paths: list[Path]) -> None:
    while True:
        pass


def _greedy(paths: list[Path]) -> None:
    np.ones(12_000_000)


def _noisy(paths: list[Path]) -> None:
    os.write(2, b"thread '<unnamed>' panicked at 7\n")


def _warned(paths: list[Path]) -> None:
    warnings.warn("overflow", RuntimeWarning, stacklevel=1)


def _nameless(paths: list[Path]) -> None:
    raise InputError("something is wrong")


@LINUX
@pytest.mark.parametrize(
    ("read", "kind"),
    [
        (_raised, "traceback"),
        (_killed, "abort"),
        (_slow, "time"),
        (_endless, "time"),
        (_greedy, "memory"),
        (_noisy, "output"),
        (_warned, "warning"),
        (_nameless, "sentence"),
    ],
    ids=lambda given: given if isinstance(given, str) else given.__name__[1:],
)
def test_the_watchdog_sees_it(
    read: Callable[[list[Path]], Any], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Input 2 of 4 behaves so; the others are read."""

    def one(paths: list[Path]) -> None:
        if watched.number == 2:
            read(paths)

    watched = _Watched()
    monkeypatch.setitem(READERS, "truth", Reader(one, "keyed"))
    original = watch._read_one

    def noted(batch: Any, number: int, *rest: Any) -> None:
        watched.number = number
        original(batch, number, *rest)

    monkeypatch.setattr(watch, "_read_one", noted)
    batch = read_inputs("truth", 0, 4, Limits(cpu=1.0, megabytes=50.0, patience=1.0))
    assert {finding.kind for finding in batch.findings} == {kind}
    assert {finding.number for finding in batch.findings} == {2}
    assert batch.done == 4


class _Watched:
    number = -1


@LINUX
def test_a_run_goes_on_where_it_was_and_tells_what_it_did(tmp_path: Path) -> None:
    record = Record(tmp_path)
    record.add(read_inputs("mesh", 0, 40))
    again = Record(tmp_path)
    assert again.done("mesh") == 40
    again.add(read_inputs("mesh", 40, 20))
    whole = read_inputs("mesh", 0, 60)
    figures = Record(tmp_path).of("mesh")
    assert (figures["read"], figures["refused"]) == (whole.read, whole.refused)
    row = next(line for line in table(again).splitlines() if line.startswith("| mesh"))
    assert row.split("|")[2:5] == [" 60 ", f" {whole.read} ", f" {whole.refused} "]


@pytest.mark.skipif(importlib.util.find_spec("atheris") is None, reason="atheris is not installed")
@pytest.mark.parametrize("name", ["gsi", "sp3", "las"])
def test_guided_targets_run(name: str) -> None:
    done = _run("fuzz.guided", name, "-runs=200", "-seed=1", timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "DONE" in done.stderr


@pytest.mark.skipif(
    importlib.util.find_spec("hypofuzz") is None, reason="hypofuzz is not installed"
)
def test_properties_can_be_fuzzed(tmp_path: Path) -> None:
    """Hypofuzz finds the property tests and begins with them."""
    command = "from hypothesis.extra.cli import main; main()"
    words = [sys.executable, "-c", command, "fuzz", "--no-dashboard", "-n", "1", "--"]
    said = tmp_path / "said"
    with said.open("wb") as file:
        process = subprocess.Popen(
            [*words, "tests/test_units.py"], cwd=ROOT, stdout=file, stderr=file,
            start_new_session=True,
        )  # fmt: skip
        end = time.monotonic() + 60
        while process.poll() is None and time.monotonic() < end:
            if b"to fuzz 1 test" in said.read_bytes():
                break
            time.sleep(0.5)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=30)
    assert b"to fuzz 1 test" in said.read_bytes(), said.read_text()
