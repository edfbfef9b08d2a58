"""The library that reads and writes E57, missed in one sentence where a machine has no wheel of it.

There are none for Linux and Windows on ARM and for Intel Macs.
"""

from __future__ import annotations

from typing import Any, NoReturn

from tribrach.errors import InputError


class _Missing:
    """Takes the place of the library: whatever is asked of it is refused."""

    def __getattr__(self, name: str) -> NoReturn:
        raise InputError(
            "E57 takes the package pye57, which is not installed; some machines have no wheel",
            cure="build it with pip install pye57 (it takes a compiler and Xerces-C), or take LAZ "
            "or PTX",
        )


def _library() -> Any:
    """The library, or what refuses in its place."""
    try:
        from pye57 import libe57
    except ImportError:
        return _Missing()
    return libe57


libe57 = _library()
