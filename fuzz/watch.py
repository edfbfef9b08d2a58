"""A process of its own for the readers, and a watchdog that outlives it.

The worker notes which input it is at in shared memory before it reads it. If it dies, or takes far
too long, the watchdog knows the input, notes it and starts another worker behind it.
"""

from __future__ import annotations

import faulthandler
import mmap
import os
import pickle
import re
import resource
import select
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzz.mutators import STYLES
from fuzz.readers import READERS, Seed, seeds_of
from tribrach.errors import InputError, Refusals, TribrachError

__all__ = ["LIMITS", "Batch", "Finding", "input_of", "read_inputs"]


@dataclass(frozen=True)
class Limits:
    """What an input may take.

    Attributes
    ----------
    cpu
        Processor time [s].
    megabytes
        Memory over what was there before.
    patience
        Time [s] after which a worker is ended.
    start
        The same for its start, in which it loads and compiles what the reader needs.
    reserve
        Addresses [bytes] that a worker may take besides those it has, so that a reader without
        bounds takes itself down and not the machine.
    """

    cpu: float = 2.0
    megabytes: float = 300.0
    patience: float = 15.0
    start: float = 600.0
    reserve: int = 6 << 30


LIMITS = Limits()


@dataclass(frozen=True)
class Finding:
    """An input that was neither read nor refused as it should be.

    Attributes
    ----------
    reader, number
        Which input.
    kind
        ``traceback``, ``abort``, ``time``, ``memory``, ``output``, ``warning`` or ``sentence``.
    place
        Where, the same for inputs that fail alike.
    text
        What was said.
    """

    reader: str
    number: int
    kind: str
    place: str
    text: str


@dataclass
class Batch:
    """What became of consecutive inputs of a reader."""

    reader: str
    first: int
    done: int = 0
    read: int = 0
    refused: int = 0
    cpu: float = 0.0
    longest: float = 0.0
    most: float = 0.0
    findings: list[Finding] = field(default_factory=list)


def input_of(name: str, number: int) -> tuple[Seed, bytes]:
    """An input by its number: the same on every machine."""
    rng = Random(f"{name}:{number}")
    seeds = _seeds(name)
    seed = rng.choice(seeds)
    others = [s.files[s.mutated] for s in seeds]
    data = STYLES[READERS[name].style](seed.files[seed.mutated], rng, others)
    return seed, data


_SEEDS: dict[str, list[Seed]] = {}


def _seeds(name: str) -> list[Seed]:
    if name not in _SEEDS:
        _SEEDS[name] = seeds_of(name)
    return _SEEDS[name]


def read_inputs(name: str, first: int, count: int, limits: Limits = LIMITS) -> Batch:
    """Read inputs of a reader, in workers that may die."""
    batch = Batch(name, first)
    while batch.done < count:
        _one_worker(batch, count, limits)
    return batch


#: number of the input, and when it was begun
_NOTE = struct.Struct("<qd")


def _one_worker(batch: Batch, count: int, limits: Limits) -> None:
    """Start a worker and listen to it until it has done all or is gone."""
    note = mmap.mmap(-1, mmap.PAGESIZE)
    _NOTE.pack_into(note, 0, -1, time.monotonic())
    source, sink = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # workers never return into our threads
        child = os.fork()
    if child == 0:
        os.close(source)
        status = 1
        try:
            _work(batch.reader, batch.first + batch.done, batch.first + count, note, sink, limits)
            status = 0
        finally:
            os._exit(status)
    os.close(sink)
    slow = False
    with os.fdopen(source, "rb") as pipe:
        for message in _messages(pipe, child, note, limits):
            if message is None:
                slow = True
                os.kill(child, signal.SIGKILL)
                break
            _add(batch, message)
    _, status = os.waitpid(child, 0)
    at, _ = _NOTE.unpack_from(note)
    if slow or status != 0:
        if at < 0:
            raise RuntimeError(f"the seeds of {batch.reader} cannot be read")
        # what the worker had not told is lost, and is read again by the next one
        if batch.first + batch.done < at:
            _add(batch, read_again(batch, at, limits))
        ended = f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"exit {status >> 8}"
        kind, place = ("time", "never ends") if slow else ("abort", ended)
        batch.findings.append(Finding(batch.reader, at, kind, place, ""))
        batch.done += 1


def read_again(batch: Batch, end: int, limits: Limits) -> dict[str, Any]:
    """What a worker that died had done before."""
    first = batch.first + batch.done
    return vars(read_inputs(batch.reader, first, end - first, limits))


def _add(batch: Batch, told: dict[str, Any]) -> None:
    for name in ("done", "read", "refused", "cpu"):
        setattr(batch, name, getattr(batch, name) + told[name])
    batch.longest = max(batch.longest, told["longest"])
    batch.most = max(batch.most, told["most"])
    batch.findings += told["findings"]


def _messages(
    pipe: Any, child: int, note: mmap.mmap, limits: Limits
) -> Iterator[dict[str, Any] | None]:
    """What a worker tells; None once if it is at one input for too long."""
    since, spent = 0.0, 0.0
    while True:
        ready, _, _ = select.select([pipe], [], [], 1.0)
        if ready:
            try:
                yield pickle.load(pipe)
            except EOFError:
                return
            continue
        at, begun = _NOTE.unpack_from(note)
        if begun != since:
            since, spent = begun, _cpu(child)
        # on a busy machine a worker may wait for long; one that waits for nothing never ends
        waited = time.monotonic() - begun
        busy = _cpu(child) - spent > limits.cpu
        patience = limits.start if at < 0 else limits.patience * (1 if busy else 10)
        if waited > patience:
            yield None
            return


def _cpu(process: int) -> float:
    """Processor time of a process [s]."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def _work(name: str, first: int, end: int, note: mmap.mmap, sink: int, limits: Limits) -> None:
    """Read inputs and tell what became of them."""
    shared = Path("/dev/shm")
    place = shared if shared.is_dir() and os.access(shared, os.W_OK) else None
    with (
        tempfile.TemporaryDirectory(prefix="tribrach-fuzz-", dir=place) as folder,
        tempfile.TemporaryFile(dir=place) as said,
        os.fdopen(sink, "wb") as pipe,
    ):
        faulthandler.disable()  # a worker that dies is told of by the watchdog
        os.dup2(said.fileno(), 2)
        os.dup2(said.fileno(), 1)
        sys.stderr = sys.__stderr__ = os.fdopen(2, "w", closefd=False)  # type: ignore[misc]
        here = Path(folder)
        # twice: what is loaded and compiled on the way is no need of an input
        for seed in [*_seeds(name), *_seeds(name)]:
            _NOTE.pack_into(note, 0, -1, time.monotonic())
            READERS[name].read(seed.write(here, seed.files[seed.mutated]))
        addresses = int(Path("/proc/self/statm").read_text().split()[0]) * mmap.PAGESIZE
        most = addresses + limits.reserve
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for start in range(first, end, 100):
            batch = Batch(name, start)
            for number in range(start, min(start + 100, end)):
                seed, data = input_of(name, number)
                paths = seed.write(here, data)
                _NOTE.pack_into(note, 0, number, time.monotonic())
                _read_one(batch, number, paths, said, limits)
            pickle.dump(vars(batch), pipe)
            pipe.flush()


def _read_one(batch: Batch, number: int, paths: list[Path], said: Any, limits: Limits) -> None:
    """Read one input and judge it."""
    reader = READERS[batch.reader]

    def found(kind: str, place: str, text: str = "") -> None:
        batch.findings.append(Finding(batch.reader, number, kind, place, text[:300]))

    before, highest = _memory()
    if highest - before > _STALE:
        _reset_peak()
        before, highest = _memory()
    begun = time.process_time()
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            reader.read(paths)
            batch.read += 1
        except TribrachError as error:
            batch.refused += 1
            _judge(error, paths, found)
        except reader.errors:
            batch.refused += 1
        except BaseException as error:
            found("traceback", f"{type(error).__name__} in {_place(error)}", str(error))
    for warning in warned:
        if not issubclass(warning.category, ResourceWarning):
            place = f"{Path(warning.filename).name}:{warning.lineno}"
            found("warning", f"{warning.category.__name__} in {place}", str(warning.message))
    took, after = time.process_time() - begun, _memory()[1]
    more = after - before if after > highest else 0.0
    batch.done += 1
    batch.cpu += took
    batch.longest, batch.most = max(batch.longest, took), max(batch.most, more)
    if took > limits.cpu:
        found("time", "too long", f"{took:.1f} s")
    if more > limits.megabytes:
        found("memory", "too much", f"{more:.0f} MB")
    sys.stderr.flush()
    if os.fstat(said.fileno()).st_size:
        said.seek(0)
        text = said.read(2000).decode("utf-8", "replace")
        said.truncate(0)
        said.seek(0)
        found("output", re.sub(r"\d+", "n", text.splitlines()[0] if text else "")[:80], text)


def _judge(error: TribrachError, paths: list[Path], found: Any) -> None:
    """A refusal is a sentence that names the file."""
    parts = error.errors if isinstance(error, Refusals) else (error,)
    for part in parts:
        text = str(part)
        where = _place(error)
        named = any(path.name in text for path in paths) or "/network/" in _file(error)
        if isinstance(part, InputError) and part.file is None and not named:
            found("sentence", f"no file, in {where}", text)
        elif "\n" in text or "\r" in text or len(text) > 3000 or " at 0x7f" in text:
            found("sentence", f"no sentence, in {where}", text)
        elif any(ord(c) < 32 and c != "\t" for c in text):
            found("sentence", f"control characters, in {where}", repr(text))


def _place(error: BaseException) -> str:
    """The innermost line of ours that an exception came through."""
    last = _frame(error)
    return f"{Path(last.filename).name}:{last.name}:{last.lineno}"


def _file(error: BaseException) -> str:
    """The file of that line. What a network lacks is said of all its files together."""
    return _frame(error).filename


def _frame(error: BaseException) -> traceback.FrameSummary:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/tribrach/" in f.filename and "site-packages" not in f.filename]
    return ours[-1] if ours else frames[-1]


#: an old peak may stand this far over what is used now [MB]; to reset it costs a millisecond
_STALE = 30.0


def _reset_peak() -> None:
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def _memory() -> tuple[float, float]:
    """Memory now, and the most since the last reset [MB]."""
    with open("/proc/self/status", "rb") as file:
        text = file.read()
    most, now = (re.search(rb"Vm" + key + rb":\s+(\d+)", text) for key in (b"HWM", b"RSS"))
    return (int(now.group(1)) / 1024, int(most.group(1)) / 1024) if now and most else (0.0, 0.0)
