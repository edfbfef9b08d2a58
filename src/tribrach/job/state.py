"""What has been made already, and from which inputs?

Beside the results lies a folder of small JSON files, one for each product. Each holds the digest
of everything that the product depends on; if that is unchanged and the product is whole, it is not
made again. Digests are of contents (BLAKE2b), not of dates; those of large files are remembered
with size and date so that a second run does not read them again.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.io.outputs import write_text

__all__ = ["FOLDER", "Remembered", "digest"]

#: folder of the state inside that of the results
FOLDER = ".tribrach"


#: changes of how products are made make all of them anew
_VERSION = 1


_BLOCK = 1 << 22


#: state files beyond this size are not read
_MOST_BYTES = 200_000_000


def digest(*parts: Any) -> str:
    """Digest of numbers, strings, arrays, mappings and sequences of them, exact in every bit."""
    state = hashlib.blake2b(digest_size=20)
    _feed(state, [_VERSION, *parts])
    return state.hexdigest()


def _feed(state: hashlib.blake2b, part: Any) -> None:
    if isinstance(part, np.ndarray):
        state.update(f"array {part.dtype} {part.shape}:".encode())
        state.update(np.ascontiguousarray(part).tobytes())
    elif isinstance(part, Mapping):
        _feed(state, [[key, part[key]] for key in sorted(part)])
    elif isinstance(part, list | tuple):
        state.update(f"list {len(part)}:".encode())
        for item in part:
            _feed(state, item)
    else:
        state.update(f"{type(part).__name__} {part!r};".encode())


class Remembered:
    """The remembered products in a folder of results."""

    def __init__(self, results: Path) -> None:
        self.folder = results / FOLDER

    def recall(self, product: str, key: str, *files: Path) -> dict[str, Any] | None:
        """What was remembered of a product made from the same key, if its files are whole."""
        record = self._read(self._place(product))
        if record is None or record.get("key") != key:
            return None
        if record.get("files") != [_size(file) for file in files]:
            return None
        facts = record.get("facts")
        return facts if isinstance(facts, dict) else None

    def remember(self, product: str, key: str, facts: Mapping[str, Any], *files: Path) -> None:
        """Note that a product was made; its files are already in place."""
        record = {"key": key, "files": [_size(file) for file in files], "facts": facts}
        write_text(self._place(product), json.dumps(record, sort_keys=True))

    def forget(self, product: str) -> None:
        """Take a product for one that was never made."""
        self._place(product).unlink(missing_ok=True)

    def records(self, prefix: str) -> list[tuple[Path, dict[str, Any]]]:
        """Files and contents of all records of products whose names begin so, in order."""
        paths = sorted(self.folder.glob(f"{prefix}*.json")) if self.folder.is_dir() else []
        found = [(path, self._read(path)) for path in paths]
        return [(path, record) for path, record in found if record is not None]

    def file_digest(self, path: Path) -> str:
        """Digest of a file's contents."""
        stamp = path.stat()
        key = digest(str(path.resolve()), stamp.st_size, stamp.st_mtime_ns)
        name = f"file-{digest(str(path.resolve()))[:16]}"
        known = self.recall(name, key)
        if known is not None:
            return str(known["digest"])
        state = hashlib.blake2b(digest_size=20)
        with path.open("rb") as file:
            while block := file.read(_BLOCK):
                state.update(block)
        self.remember(name, key, {"digest": state.hexdigest()})
        return state.hexdigest()

    def sweep(self, *folders: Path) -> None:
        """Remove what killed runs left half-written among the results and in further folders.

        Those are files whose names begin with a dot and end in ``.part``.
        """
        for folder in (self.folder, self.folder.parent, *folders):
            for path in folder.glob(".*.part") if folder.is_dir() else ():
                path.unlink(missing_ok=True)

    def _place(self, product: str) -> Path:
        """The file of a product's record; names of scans come from files and may hold anything."""
        plain = re.sub(r"[^\w.-]", "_", product)[:80]
        name = plain if plain == product else f"{plain}-{digest(product)[:16]}"
        return self.folder / f"{name}.json"

    @staticmethod
    def _read(path: Path) -> dict[str, Any] | None:
        """A record, or None if there is none or it is damaged."""
        try:
            if path.stat().st_size > _MOST_BYTES:
                return None
            record = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return record if isinstance(record, dict) else None


def _size(path: Path) -> int:
    """Size of a file in bytes, -1 if it is not there."""
    try:
        return os.stat(path).st_size
    except OSError:
        return -1
