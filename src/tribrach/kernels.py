"""Loops that are compiled: declared as for numba, which is loaded when the first of them is called.

Loading numba takes as long as loading numpy and all sparse matrices, and a network of ten
observations or a list of commands calls no such loop. Kernels are declared with :func:`njit` of
this module; it is that of numba from the first call on, in every kernel that it calls as well.

What can be shared among processors is a loop over a range ``(first, last)`` of its rounds, which
:func:`in_threads` calls in several threads: numba's own parallel loops take twice as long to
compile.

A kernel that was compiled by an earlier process is loaded without what numba needs to compile,
which takes ten times as long to load as the kernel: see :func:`_without_compiler`.

Where two processes need the same kernel, one compiles it and the other waits for what it stores:
see :func:`_in_turn`. That is what lets a second process compile ahead of a command
(:mod:`tribrach.compiling_ahead`).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from threading import RLock
from types import CodeType
from typing import Any

#: parts of the rounds for each thread: the threads end together, though rounds differ
_PARTS = 8
#: one thread at a time declares kernels to numba
_DECLARING = RLock()
#: held while a kernel is stored: numba writes what there is before the code itself, and a process
#: that ended in between would leave a name that means older code
STORING = RLock()
#: so long a process waits for another that compiles the kernel that it needs [s]; the largest
#: takes 6 s. Who waited in vain once does not wait again
_PATIENCE = 20.0


class Kernel:
    """A function that numba compiles when it is first called.

    Other kernels that it calls are names of its module; the options are those of ``numba.njit``.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func = function
        self.options = options
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self.__qualname__ = function.__qualname__
        self.__module__ = function.__module__
        self._dispatcher: Any = None

    def __call__(self, *args: Any) -> Any:
        """Call the compiled function."""
        return (self._dispatcher or self.declared())(*args)

    def declared(self) -> Any:
        """The dispatcher of numba, which compiles for the types that it is called with.

        Names of kernels in the function mean those of numba from here on, as numba looks them up
        when it compiles.
        """
        with _DECLARING:
            if self._dispatcher is None:
                numba = import_module("numba")
                dispatcher = numba.njit(**self.options)(self.py_func)
                _keep_if_possible(dispatcher)
                _without_compiler(dispatcher, numba.version_info[:2])
                _in_turn(dispatcher)
                names = self.py_func.__globals__
                for name in _names(self.py_func.__code__):
                    meant = names.get(name)
                    if isinstance(meant, Kernel) and meant is not self:
                        names[name] = meant.declared()
                    elif meant is self:
                        names[name] = dispatcher
                # last, so that no other thread calls it before its names are numba's
                self._dispatcher = dispatcher
            return self._dispatcher


def _keep_if_possible(dispatcher: Any) -> None:
    """Let a kernel that cannot be stored be compiled again next time, as numba fails instead.

    A disk that is full is no reason to lose the work of hours for a few kilobytes of machine code.
    """
    save = dispatcher._cache.save_overload

    def saved(signature: Any, data: Any) -> None:
        with STORING, suppress(OSError):
            save(signature, data)

    dispatcher._cache.save_overload = saved


#: versions of numba in which loading was read and tried
_LOADED_ALONE = ((0, 68),)


def _without_compiler(dispatcher: Any, version: tuple[int, int]) -> None:
    """Let a kernel that is stored be loaded without the tables that only compiling needs.

    Before numba looks for a stored kernel it loads all that it knows of types and functions, some
    250 modules, and has it ready for what may have to be compiled; what is compiled asks for it
    again by itself. Machine code only needs the symbols that it calls: those of the interpreter are
    there as soon as numba is, and those of memory are added here. Symbols of hashes are not, and no
    kernel has sets or dictionaries.
    """
    cache = dispatcher._cache
    if version not in _LOADED_ALONE or not hasattr(cache, "_load_overload"):
        return

    def loaded(signature: Any, context: Any) -> Any:
        import_module("numba.core.runtime").rtsys.initialize(context)
        with cache._guard_against_spurious_io_errors():
            return cache._load_overload(signature, context)

    cache.load_overload = loaded


class _Turn:
    """Which process compiles a kernel, for whatever types: the one that holds a file's lock.

    The system gives the lock back when a process ends, however it ends. Where files cannot be
    locked every process compiles for itself.
    """

    #: of this process, for all kernels together
    patience = _PATIENCE

    def __init__(self, path: Path) -> None:
        self.path = path
        self.in_vain = False
        self._lock: Any = None

    def take(self) -> None:
        """Wait until no other process compiles the kernel, but not for ever."""
        if self._lock is not None or self.in_vain:
            return
        filelock = import_module("filelock")
        lock = filelock.FileLock(self.path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=_Turn.patience, poll_interval=0.01)
        except filelock.Timeout:
            # stopped, or starved by others; that it is so again for each kernel would add up
            self.in_vain, _Turn.patience = True, 0.0
        except (OSError, NotImplementedError):
            pass
        else:
            self._lock = lock

    def give(self) -> None:
        """Let another process have it."""
        lock, self._lock, self.in_vain = self._lock, None, False
        if lock is not None:
            lock.release()

    def is_others(self) -> bool:
        """Has another process taken it just now?"""
        if self._lock is not None:
            return False
        patience, _Turn.patience = _Turn.patience, 0.0
        try:
            self.take()
            return self.in_vain
        finally:
            _Turn.patience = patience
            self.give()


def _in_turn(dispatcher: Any) -> None:
    """Let one process compile a kernel that is not stored, while others wait for it.

    Two that stored it at the same time for different types could both take the same file of code.
    Who has waited in vain compiles the kernel for itself and leaves the storing to the other.
    """
    cache = dispatcher._cache
    index = getattr(getattr(cache, "_cache_file", None), "_index_path", None)
    if index is None:  # it is not to be stored
        return
    turn = _Turn(Path(index).with_suffix(".lock"))
    # one thread at a time compiles; in that one, a kernel may need itself for other types
    compiling = import_module("numba.core.compiler_lock").global_compiler_lock
    load, save, compiled = cache.load_overload, cache.save_overload, dispatcher.compile
    depth = 0

    def load_or_wait(signature: Any, context: Any) -> Any:
        found = load(signature, context)
        if found is None:
            turn.take()
            found = load(signature, context)
        return found

    def save_in_turn(signature: Any, data: Any) -> None:
        if not turn.in_vain:
            save(signature, data)

    def compile_in_turn(signature: Any) -> Any:
        nonlocal depth
        with compiling:
            depth += 1
            try:
                return compiled(signature)
            finally:
                depth -= 1
                if not depth:
                    turn.give()

    cache.load_overload, cache.save_overload = load_or_wait, save_in_turn
    cache.turn, dispatcher.compile = turn, compile_in_turn


def is_being_compiled(dispatcher: Any) -> bool:
    """Is another process compiling a kernel just now, for whatever types?"""
    turn = getattr(dispatcher._cache, "turn", None)
    return turn is not None and turn.is_others()


def _names(code: CodeType) -> set[str]:
    """Global names that a function uses, also within its comprehensions."""
    inner = (const for const in code.co_consts if isinstance(const, CodeType))
    return set(code.co_names).union(*(_names(const) for const in inner))


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Declare a compiled loop."""
    return lambda function: Kernel(function, options)


def in_threads(kernel: Callable[..., None], rounds: int, *args: Any, least: int = 4096) -> None:
    """Share the rounds of a loop among threads, as many as numba would take.

    The kernel, called as ``kernel(first, last, *args)``, does the rounds from ``first`` to before
    ``last`` without the interpreter's lock (``nogil``). No round may depend on another, so that
    results are the same in any number of threads. ``least`` rounds are worth a thread.
    """
    threads = 1
    if rounds >= 2 * least:
        threads = min(rounds // least, import_module("numba").config.NUMBA_NUM_THREADS)
    if threads < 2:
        kernel(0, rounds, *args)
        return
    parts = min(rounds // least, _PARTS * threads)
    ends = [rounds * part // parts for part in range(parts + 1)]
    # loaded here, as most commands share nothing
    with import_module("concurrent.futures").ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(kernel, *both, *args) for both in pairwise(ends)]:
            done.result()


def blas_in_one_thread() -> AbstractContextManager[Any]:
    """A block in which products of matrices are computed by one thread.

    For loops of thousands of small products, as sparse factors are made of: in these the threads of
    BLAS wait for each other, which takes up to twice the seconds of the processors and saves none
    by the clock, whatever the size of the network; and sums are the same with any number of
    processors. It holds for the whole process as long as the block lasts.
    """
    # loaded here, as small networks have no such loops
    limits: AbstractContextManager[Any] = import_module("threadpoolctl").threadpool_limits(
        limits=1, user_api="blas"
    )
    return limits
