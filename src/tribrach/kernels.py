"""Loops that are compiled: declared as for numba, which is loaded when the first of them is called.

Loading numba takes as long as loading numpy and all sparse matrices, and a network of ten
observations or a list of commands calls no such loop. Kernels are declared with :func:`njit` of
this module; it is that of numba from the first call on, in every kernel that it calls as well.

What can be shared among processors is a loop over a range ``(first, last)`` of its rounds, which
:func:`in_threads` calls in several threads: numba's own parallel loops take twice as long to
compile.

A kernel that was compiled by an earlier process is loaded without what numba needs to compile,
which takes ten times as long to load as the kernel: see :func:`_without_compiler`.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from importlib import import_module
from itertools import pairwise
from threading import RLock
from types import CodeType
from typing import Any

__all__ = ["Kernel", "blas_in_one_thread", "in_threads", "njit"]

#: parts of the rounds for each thread: the threads end together, though rounds differ
_PARTS = 8
#: one thread at a time declares kernels to numba
_DECLARING = RLock()


class Kernel:
    """A function that numba compiles when it is first called.

    Parameters
    ----------
    function : Callable
        The loop, in what numba knows of Python. Other kernels that it calls are names of its
        module.
    options : dict
        Of ``numba.njit``.
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
        with suppress(OSError):
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


def _names(code: CodeType) -> set[str]:
    """Global names that a function uses, also within its comprehensions."""
    inner = (const for const in code.co_consts if isinstance(const, CodeType))
    return set(code.co_names).union(*(_names(const) for const in inner))


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Declare a compiled loop.

    Parameters
    ----------
    **options
        Those of ``numba.njit``, such as ``cache``, ``parallel`` and ``nogil``.

    Returns
    -------
    Callable
        What makes a :class:`Kernel` of a function.
    """
    return lambda function: Kernel(function, options)


def in_threads(kernel: Callable[..., None], rounds: int, *args: Any, least: int = 4096) -> None:
    """Share the rounds of a loop among threads, as many as numba would take.

    Parameters
    ----------
    kernel : Callable
        Called as ``kernel(first, last, *args)``, it does the rounds from ``first`` to before
        ``last`` without the interpreter's lock (``nogil``). No round may depend on another, so that
        results are the same in any number of threads.
    rounds : int
        How many there are.
    *args
        What the kernel works with; results go into arrays of these.
    least : int
        So many rounds are worth a thread.
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
