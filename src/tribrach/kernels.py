"""Loops that are compiled: declared as for numba, which is loaded when the first of them is called.

Loading numba takes as long as loading numpy and all sparse matrices, and a network of ten
observations or a list of commands calls no such loop. Kernels are declared with :func:`njit` and
:data:`prange` of this module; both are those of numba from the first call on, in every kernel that
it calls as well.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from threading import RLock
from types import CodeType
from typing import Any

__all__ = ["Kernel", "njit", "prange"]

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

        Names of kernels and ``prange`` in the function mean those of numba from here on, as numba
        looks them up when it compiles.
        """
        with _DECLARING:
            if self._dispatcher is None:
                numba = import_module("numba")
                dispatcher = numba.njit(**self.options)(self.py_func)
                names = self.py_func.__globals__
                for name in _names(self.py_func.__code__):
                    meant = names.get(name)
                    if meant is prange:
                        names[name] = numba.prange
                    elif isinstance(meant, Kernel) and meant is not self:
                        names[name] = meant.declared()
                    elif meant is self:
                        names[name] = dispatcher
                # last, so that no other thread calls it before its names are numba's
                self._dispatcher = dispatcher
            return self._dispatcher


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


def prange(*limits: int) -> range:
    """``range`` whose rounds are shared among processors: in a kernel that of numba.

    Parameters
    ----------
    *limits
        As for ``range``.

    Returns
    -------
    range
        What uncompiled code goes through, one round after the other.
    """
    return range(*limits)
