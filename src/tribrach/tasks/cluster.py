"""Tasks on other processes and machines, by the scheduler of Dask.

Workers read what they work on themselves, from folders that all of them see under one name; values
and small results travel. Two ways lead there (:func:`local_workers`, :func:`remote_workers`).

A worker may die at any moment: what it was doing is done again. A task whose worker dies again and
again is at last done with nothing beside it; only if its worker dies then as well is it said that
the task is to blame. A scheduler that is lost ends the work; what was ready until then is with the
caller.
"""

from __future__ import annotations

import logging
import os
import platform
import signal
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib import metadata
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

from tribrach._types import Progress
from tribrach.code_version import code_version
from tribrach.errors import InputError, TribrachError
from tribrach.scratch import scratch_folder
from tribrach.tasks.engine import Call, Engine

if TYPE_CHECKING:
    from distributed import Client, Future

R = TypeVar("R")

#: a task is begun so often beside others before it has to show with nothing beside it whether it
#: kills its worker
_BESIDE_OTHERS = 2
#: so long a scheduler may take to answer [s]
_ANSWER = 15.0
#: so long there may be no worker at all: those of this machine are started again by themselves,
#: which takes a minute where it has other work [s]
_NO_WORKERS, _NO_LOCAL_WORKERS = 60.0, 300.0
#: between two looks at whether there are workers, and two words of a task on how far it is [s]
_LOOK, _WORD = 1.0, 0.5
#: libraries whose versions a worker has to share with the caller, for equal results
_LIBRARIES = ("numpy", "scipy", "numba")
#: compiled loops and the decoder of LAZ share their work between threads without a trace in results
_COMPILED = ("NUMBA_NUM_THREADS", "RAYON_NUM_THREADS")
#: the last digits of sums in these depend on their number
_SUMS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def local_workers(count: int, threads: int | None = None) -> Iterator[Engine]:
    """Do tasks in processes of this machine, which end with the block.

    They are started when first something is to be done. They listen on this machine alone, and
    only to who has the key that is made for them.
    """
    _refuse_missing()
    with ExitStack() as stack:
        yield _Cluster(
            lambda: stack.enter_context(_local(count, threads or max(1, _processors() // count))),
            f"{count} workers of this machine",
            _NO_LOCAL_WORKERS,
            "take fewer, or none: there may be too little memory for so many",
        )


@contextmanager
def remote_workers(address: str) -> Iterator[Engine]:
    """Do tasks on the workers of a scheduler that is running already."""
    _refuse_missing()
    with ExitStack() as stack:
        yield _Cluster(
            lambda: stack.enter_context(_connected(address)),
            address,
            _NO_WORKERS,
            "start some with: dask worker ADDRESS --nthreads 1",
        )


def _processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _refuse_missing() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"workers need Dask, which is not installed ({error})",
            cure='pip install "tribrach[cluster]"',
        ) from error


@contextmanager
def _local(count: int, threads: int) -> Iterator[Client]:
    """A client of processes of this machine."""
    import dask
    from distributed import Client, LocalCluster, Security
    from distributed.gc import disable_gc_diagnosis

    quiet = {"distributed": "critical", "distributed.worker": "critical", "tornado": "critical"}
    settings = {
        "logging": quiet,
        # no pages of its own for anybody on the network or this machine
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        # how often a task is tried is decided below
        "distributed.scheduler.allowed-failures": 0,
        # a worker that waits for memory which no other task gives back would wait for ever
        "distributed.worker.memory.target": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.pause": False,
        # one that is not there again by then is given up for good, and a busy machine takes long
        "distributed.deploy.lost-worker-timeout": "1 day",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(_SUMS, "1"),
    }
    with scratch_folder() as folder, dask.config.set(settings), _silent():
        with _no_interruptions():
            cluster = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                security=Security.temporary(),
                local_directory=str(folder),
                silence_logs=logging.CRITICAL,
                env=dict.fromkeys(_COMPILED, str(threads)),
            )
        # an interruption that comes while it looks at collected garbage would be lost
        disable_gc_diagnosis()
        with cluster, Client(cluster) as client:
            yield client


@contextmanager
def _no_interruptions() -> Iterator[None]:
    """A block whose threads, and the processes that they start, are deaf to Ctrl-C.

    It is for this process, which then ends the others; in this thread it is heard when the block
    ends.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # it would let them hear again where it is started by the first process
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """A client of a scheduler."""
    from distributed import Client

    with _silent():
        try:
            client = Client(address, timeout=_ANSWER, name="tribrach")
        except (OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
            raise InputError(
                f"no scheduler of Dask answers at {address} ({str(error) or type(error).__name__})",
                cure="start one with: dask scheduler",
            ) from error
        with client:
            yield client


@contextmanager
def _silent() -> Iterator[None]:
    """A block in which Dask says nothing of workers that come and go; the caller says it."""
    loggers = [logging.getLogger(name) for name in ("distributed", "asyncio", "tornado")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


@dataclass(frozen=True)
class _Context:
    """What a worker needs to know besides the task.

    folder : that names of files are relative to; version : of the code of the task and of what it
    uses; topic : under which it says how far it is.
    """

    folder: str
    version: str
    topic: str


def _version(task: Callable[..., Any]) -> str:
    """The version of everything that the results of a task depend on."""
    libraries = (f"{name} {metadata.version(name)}" for name in _LIBRARIES)
    python = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    return ", ".join((python, *libraries, f"code {code_version({task.__module__})}"))


def _perform(task: Callable[..., R], values: tuple[Any, ...], context: _Context) -> R:
    """Do a task in a worker."""
    own = _version(task)
    if own != context.version:
        raise InputError(
            f"the worker on {platform.node()} would give other results: it has {own}; here is "
            f"{context.version}",
            cure="install the same versions everywhere",
        )
    try:
        os.chdir(context.folder)
    except OSError as error:
        raise InputError(
            f"the worker on {platform.node()} does not see this folder",
            file=context.folder,
            cure="work in a folder that all workers see under the same name",
        ) from error
    return task(*values, progress=_Telling(context.topic))


class _Telling:
    """Progress of a task in a worker, told to the caller now and then."""

    def __init__(self, topic: str) -> None:
        self._topic, self._said = topic, -_WORD

    def __call__(self, what: str, done: int, total: int | None) -> None:
        """Say how far it is, if that was not said just now."""
        from distributed import get_worker

        now = time.monotonic()
        if now - self._said >= _WORD or done == total:
            self._said = now
            get_worker().log_event(self._topic, [what, done, total])


class _Cluster:
    """Does tasks on workers; see :class:`tribrach.tasks.engine.Engine`."""

    def __init__(
        self, connect: Callable[[], Client], where: str, patience: float, cure: str
    ) -> None:
        self._connect, self._where = connect, where
        self._patience, self._cure = patience, cure
        self._known: Client | None = None

    def client(self) -> Client:
        """The client of the scheduler, connected when it is first asked for."""
        if self._known is None:
            self._known = self._connect()
        return self._known

    def completed(
        self, task: Callable[..., R], calls: Sequence[Call], progress: Progress
    ) -> Iterator[tuple[int, R]]:
        """Do a task for each call; results as they come."""
        if not calls:
            return
        work = _Work(self.client(), task, calls, progress, self._where)
        try:
            yield from work.results(self._patience, self._cure)
        finally:
            work.end()


class _Work:
    """Calls of one task on their way; see :meth:`tribrach.tasks.engine.Engine.completed`."""

    def __init__(
        self,
        client: Client,
        task: Callable[..., Any],
        calls: Sequence[Call],
        progress: Progress,
        where: str,
    ) -> None:
        self.client, self.task, self.calls = client, task, calls
        self.progress, self.where = progress, where
        self.run = uuid.uuid4().hex[:12]
        self.context = _Context(os.getcwd(), _version(task), f"tribrach-{self.run}")
        order = sorted(range(len(calls)), key=lambda k: -calls[k].cost)
        self.waiting, self.alone = order, list[int]()
        self.begun: dict[int, Future[Any]] = {}
        self.tries, self.deaths = Counter[int](), Counter[int]()
        self.failed: dict[int, BaseException] = {}
        self.done = 0
        # of all workers, and when they were asked last
        self.threads, self.asked = 0, -_LOOK
        # everything that other threads have to say comes through here
        self.news: SimpleQueue[tuple[int, Any]] = SimpleQueue()
        self.client.subscribe_topic(self.context.topic, self._heard)

    def _heard(self, event: tuple[float, Any]) -> None:
        """Take what a task says, in a thread of Dask."""
        self.news.put((-1, event[1]))

    def end(self) -> None:
        """Leave nothing behind at the scheduler."""
        with suppress(Exception):
            self.client.unsubscribe_topic(self.context.topic)
            if self.begun:
                self.client.cancel(list(self.begun.values()), force=True)

    def results(self, patience: float, cure: str) -> Iterator[tuple[int, Any]]:
        """Yield numbers of calls and results until all are done or none of the rest matters.

        patience : so long there may be no worker at all [s]; cure : what to do then.
        """
        alive = time.monotonic()
        while self.waiting or self.alone or self.begun:
            if self._begin():
                alive = time.monotonic()
            elif time.monotonic() - alive > patience:
                raise InputError(
                    f"there has been no worker for {patience:.0f} s at {self.where}", cure=cure
                )
            try:
                number, said = self.news.get(timeout=_LOOK)
            except Empty:
                continue
            if number < 0:
                self.progress(*said)
            elif self.begun.get(number) is said:
                future = self.begun.pop(number)
                if future.status == "finished":
                    # the worker goes on while the caller looks at the result
                    self._begin()
                yield from self._ended(number, future)
        if self.failed:
            raise self.failed[min(self.failed)]

    def _begin(self) -> bool:
        """Give the workers as much as they have threads for; True if there are workers."""
        if time.monotonic() - self.asked > _LOOK:
            try:
                self.threads = sum(self.client.nthreads().values())
            except (OSError, TimeoutError, CancelledError, RuntimeError) as error:
                raise self._lost() from error
            self.asked = time.monotonic()
        threads = self.threads
        # one that is suspected of killing workers gets all of them for itself
        if self.alone and not self.waiting:
            if not self.begun and threads:
                self._submit(self.alone.pop(0))
            return bool(threads)
        while self.waiting and len(self.begun) < threads:
            self._submit(self.waiting.pop(0))
        return bool(threads)

    def _submit(self, number: int) -> None:
        call = self.calls[number]
        self.tries[number] += 1
        future = self.client.submit(
            _perform,
            self.task,
            call.values,
            self.context,
            key=f"tribrach-{self.run}-{number}-{self.tries[number]}",
            pure=False,
        )
        self.begun[number] = future
        self.progress(call.what, 0, None)
        future.add_done_callback(lambda ended: self.news.put((number, future)))

    def _ended(self, number: int, future: Future[Any]) -> Iterator[tuple[int, Any]]:
        """The result of a call if it has one; else what follows is noted."""
        from distributed.scheduler import KilledWorker

        status = future.status
        if status == "finished":
            try:
                result = future.result(timeout=_ANSWER)
            except TimeoutError:
                status = "lost"
            except (OSError, CancelledError) as error:
                raise self._lost() from error
            else:
                self.done += 1
                yield number, result
                return
        if status in ("lost", "pending") and self.client.status == "running":
            # its worker died before anybody had the result, which is made again
            self.client.cancel([future], force=True)
            self.waiting.insert(0, number)
            return
        if status != "error":
            raise self._lost()
        failure = future.exception()
        if isinstance(failure, KilledWorker):
            self._died(number)
        else:
            self._fails(number, self._told(failure))

    def _died(self, number: int) -> None:
        """Do a task again whose worker died, and say at last that it is to blame."""
        self.deaths[number] += 1
        if self.deaths[number] < _BESIDE_OTHERS:
            self.waiting.insert(0, number)
        elif self.deaths[number] == _BESIDE_OTHERS:
            self.alone.append(number)
        else:
            call = self.calls[number]
            error = InputError(
                f"{call.what}: every worker that began with this died, "
                f"{self.deaths[number]} in all, the last one with nothing beside it",
                file=call.file,
                cure="it may need more memory than a worker has: take fewer workers, or none",
            )
            self._fails(number, error)

    def _fails(self, number: int, error: BaseException) -> None:
        """Note a failure; only what comes before it is still of interest."""
        self.failed[number] = error
        first = min(self.failed)
        self.waiting = [k for k in self.waiting if k < first]
        self.alone = [k for k in self.alone if k < first]
        late = [k for k in self.begun if k > first]
        futures = [self.begun.pop(k) for k in late]
        if futures:
            self.client.cancel(futures, force=True)

    def _told(self, error: BaseException) -> BaseException:
        """An error of a task; one of a worker that cannot load the task is a sentence."""
        if isinstance(error, TribrachError) or "deserializ" not in str(error):
            return error
        cause = error.__cause__ or error
        return InputError(
            f"a worker at {self.where} cannot load what it should do ({cause})",
            cure="install the same version of this program there",
        )

    def _lost(self) -> InputError:
        return InputError(
            f"the scheduler at {self.where} is lost; {self.done} of {len(self.calls)} tasks were "
            "done and are kept",
            cure="run the command again when it is back, or without it",
        )
