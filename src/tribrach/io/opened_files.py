"""Bytes of files that are opened once, however many readers look at them.

A raw file is looked at before its reader is chosen, and the first file of points gives the centre
of the site before it gives the points. Within :func:`opened_once` these looks share one opening.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from tribrach.io.keeping import keep

__all__ = ["contents", "opened_once"]

_KEPT: ContextVar[dict[Path, bytes] | None] = ContextVar("files that were opened", default=None)


#: larger files are no survey files and are not kept [bytes]
_LARGEST = 200_000_000


def contents(path: Path, most: int | None = None) -> bytes:
    """Return the bytes of a file, from memory where it was opened before."""
    kept = _KEPT.get()
    keep([path])
    if kept is None or (path not in kept and path.stat().st_size > _LARGEST):
        with path.open("rb") as file:
            return file.read(-1 if most is None else most)
    if path not in kept:
        with path.open("rb") as file:
            kept[path] = file.read(_LARGEST + 1)
    return kept[path][:most]


@contextmanager
def opened_once(kept: dict[Path, bytes]) -> Iterator[None]:
    """Open each file at most once within a block."""
    token = _KEPT.set(kept)
    try:
        yield
    finally:
        _KEPT.reset(token)
