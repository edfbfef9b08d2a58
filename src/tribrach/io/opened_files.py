"""Bytes of files that are opened once, however many readers look at them.

A raw file is looked at before its reader is chosen, and the first file of points gives the centre
of the site before it gives the points. Within :func:`opened_once` these looks share one opening.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from tribrach.io.keeping import keep

#: larger files are no survey files and are not kept [bytes]
_LARGEST = 200_000_000
#: what was opened, and the size of the largest file that is kept
_KEPT: ContextVar[tuple[dict[Path, bytes], int] | None] = ContextVar("opened", default=None)


def contents(path: Path, most: int | None = None) -> bytes:
    """Return the bytes of a file, from memory where it was opened before."""
    kept, largest = _KEPT.get() or ({}, -1)
    keep([path])
    # what comes through a pipe has no size
    if path not in kept and not (path.is_file() and path.stat().st_size <= largest):
        with path.open("rb") as file:
            return file.read(-1 if most is None else most)
    if path not in kept:
        with path.open("rb") as file:
            kept[path] = file.read(largest + 1)
    return kept[path][:most]


@contextmanager
def opened_once(kept: dict[Path, bytes], largest: int = _LARGEST) -> Iterator[None]:
    """Open each file up to a size at most once within a block."""
    token = _KEPT.set((kept, largest))
    try:
        yield
    finally:
        _KEPT.reset(token)


def lines_of(text: str) -> list[str]:
    """The lines of a text as editors count them: nothing but line feeds and returns ends one."""
    lines = re.split(r"\r*\n|\r", text)
    return lines if lines[-1] else lines[:-1]


def text_of_bytes(data: bytes) -> str:
    """UTF-8, else as Windows writes it in western Europe, else a letter for each byte."""
    for encoding in ("utf-8-sig", "cp1252"):
        with suppress(UnicodeDecodeError):
            return data.decode(encoding)
    return data.decode("latin-1")
