"""Products of earlier runs, remembered with a digest of what they were made from.

Beside the results lies a folder of small JSON files, one for each product. Each holds the key of
the product: a digest of everything that it depends on. If the key is unchanged and the product is
whole, it is not made again.

A product that is made or recalled in this run goes on as the object that it is. Its record is
written beside it for later runs, by the type hints of the product (:mod:`tribrach.job.memo`).

The key is taken from the function that makes the product and from its arguments
(:meth:`Remembered.key`): from the code of the function and of all that it uses, from every field of
every argument, and from the contents of the files that they name. So nobody keeps a list of what
matters: what is no argument cannot change the product, and what is one is in the key. Therefore
functions take narrow arguments; a setting that they do not get makes nothing anew.

A field of a dataclass can be left out only with a reason that stands beside it:
``field(metadata={"not_in_digest": "filled from the others when first needed"})``.

Digests are of contents (BLAKE2b), not of dates; those of large files are remembered with size and
date so that a second run does not read them again.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from tribrach.code_version import code_version
from tribrach.io.json_text import json_text, restored
from tribrach.io.keeping import STATE_FOLDER, hold
from tribrach.io.outputs import write_text
from tribrach.job.memo import put_together, settled, taken_apart
from tribrach.tasks.engine import HERE, Engine

#: key of the metadata of a field that is left out of digests; its value says why
NOT_IN_DIGEST = "not_in_digest"

#: folders of results besides the clouds: what was found in scans, and pictures of it
FOUND, PICTURES = "targets", "pictures"

T = TypeVar("T")

_BLOCK = 1 << 22

#: state files beyond this size are not read
_MOST_BYTES = 200_000_000


def digest(*parts: Any) -> str:
    """Take the digest of values, exact in every bit.

    Numbers, strings, arrays, dates, enums, functions, dataclasses and pydantic models, and
    mappings, sequences and sets of them.
    """
    reader = _Digest(None)
    reader.add(list(parts))
    return reader.state.hexdigest()


class _Digest:
    """A digest that grows by values, and the modules of the classes and functions among them.

    ``contents`` gives the digest of a file's contents; None if there should be no paths.
    """

    def __init__(self, contents: Callable[[Path], str] | None) -> None:
        self.state = hashlib.blake2b(digest_size=20)
        self.modules = set[str]()
        self._contents = contents

    def add(self, part: Any) -> None:
        """Add one value and everything in it."""
        match part:
            case np.generic() | np.ndarray():
                self._array(np.asarray(part))
            case np.dtype():
                self._words("dtype", repr(part.descr))
            case Enum():
                self._words("enum", self._name(type(part)), part.name)
                self.add(part.value)
            case None | bool() | int() | float() | complex():
                self._words(type(part).__name__, repr(part))
            case str():
                self._words("str", part)
            case bytes():
                self._words("bytes", part.hex())
            case datetime.date() | datetime.time():
                self._words(type(part).__name__, part.isoformat())
            case Path():
                self._file(part)
            case BaseModel():
                self._words("model", self._name(type(part)))
                self._mapping({name: getattr(part, name) for name in type(part).model_fields})
            case Mapping():
                self._mapping(part)
            case list() | tuple():
                self._words("list", str(len(part)))
                for item in part:
                    self.add(item)
            case set() | frozenset():
                self._words("set", *sorted(digest(item) for item in part))
            case FunctionType():
                self._function(part)
            case np.ufunc():
                self._words("ufunc", part.__name__)
            case BuiltinFunctionType() | type():
                self._words("named", self._name(part))
            case CodeType():
                self._words("code", part.co_code.hex(), *part.co_names, *part.co_varnames)
                self.add(part.co_consts)
            case _ if is_dataclass(part):
                self._words("dataclass", self._name(type(part)))
                kept = [item for item in fields(part) if not _left_out(item)]
                self._mapping({item.name: getattr(part, item.name) for item in kept})
            case _:
                raise TypeError(f"no digest is defined for {type(part).__qualname__}: {part!r:.80}")

    def _words(self, *words: str) -> None:
        """Add words, each with its length, so that two never read like one."""
        for word in words:
            data = word.encode("utf-8", "surrogatepass")
            self.state.update(b"%d:" % len(data) + data)

    def _name(self, thing: Any) -> str:
        """The full name of a class or function, whose module is noted."""
        module = thing.__module__ or ""
        self.modules.add(module)
        return f"{module}.{thing.__qualname__}"

    def _array(self, part: np.ndarray[Any, Any]) -> None:
        if part.dtype.hasobject:
            raise TypeError("no digest is defined for arrays of objects")
        self._words("array", repr(part.dtype.descr), repr(part.shape))
        self.state.update(np.ascontiguousarray(part).tobytes())

    def _mapping(self, part: Mapping[Any, Any]) -> None:
        self._words("mapping", str(len(part)))
        for key in sorted(part, key=lambda key: (type(key).__name__, key)):
            self.add(key)
            self.add(part[key])

    def _file(self, part: Path) -> None:
        """The contents of a file and its name, of which results may speak, but not its folder."""
        if self._contents is None:
            raise TypeError(f"the contents of {part} are not known here: use Remembered.key")
        self._words("file", part.name, self._contents(part))

    def _function(self, part: FunctionType) -> None:
        """A function: what it does, and the values that it was made with."""
        self._words("function", self._name(part))
        self.add(part.__code__)
        self.add([part.__defaults__, part.__kwdefaults__])
        self.add([cell.cell_contents for cell in part.__closure__ or ()])


def _left_out(item: Field[Any]) -> bool:
    """Is a field left out of digests? Only with a reason."""
    if NOT_IN_DIGEST not in item.metadata:
        return False
    reason = item.metadata[NOT_IN_DIGEST]
    if not isinstance(reason, str) or not reason.strip():
        raise TypeError(f"field {item.name} is left out of digests without a reason")
    return True


class Remembered:
    """Products of earlier runs that still hold; ``engine`` makes the others."""

    #: files in the folder that begin so are on their way to their places
    MADE = "made-"

    def __init__(self, results: Path, engine: Engine = HERE) -> None:
        self.folder, self.engine = results / STATE_FOLDER, engine
        self._at_hand: dict[str, tuple[str, Any]] = {}
        self._digests: dict[str, str] = {}

    def key(self, maker: Callable[..., Any], *arguments: Any) -> str:
        """Take the digest of everything that a product depends on."""
        reader = _Digest(self.file_digest)
        reader.add([maker.__module__, maker.__qualname__, *arguments])
        return digest(reader.state.hexdigest(), code_version({maker.__module__, *reader.modules}))

    def known(self, product: str, key: str, form: type[T]) -> bool:
        """Tell if :meth:`recall` would give a product; it is in memory until it is recalled."""
        value = self.recall(product, key, form)
        if value is not None:
            self.hand_on(product, key, value)
        return value is not None

    def hand_on(self, product: str, key: str, value: Any) -> None:
        """Keep a product in memory for the one who recalls it next."""
        self._at_hand[product] = key, value

    def recall(self, product: str, key: str, form: type[T], *files: Path) -> T | None:
        """A remembered product of the same key, if its files are whole."""
        found: T | None
        held, found = self._at_hand.pop(product, ("", None))
        if held == key:
            return found
        record = self._read(self._place(product))
        if record is None or record.get("key") != key:
            return None
        if record.get("files") != [_size(file) for file in files]:
            return None
        try:
            found = put_together(form, record.get("facts"))
        except ValueError:
            return None
        return found

    def remember(self, product: str, key: str, value: T, *files: Path) -> T:
        """Note a product that was made; its files are already in place."""
        value = settled(value)
        sizes = [_size(file) for file in files]
        record = {"key": key, "files": sizes, "facts": taken_apart(value)}
        text = json_text(record, sort_keys=True, restorable=True)
        write_text(self._place(product), text)
        return value

    def once(self, product: str, key: str, form: type[T], make: Callable[[], T]) -> T:
        """A remembered product without files, or a new one."""
        known = self.recall(product, key, form)
        return self.remember(product, key, make()) if known is None else known

    def forget(self, product: str) -> None:
        """Take a product for one that was never made."""
        self._place(product).unlink(missing_ok=True)

    def records(self, prefix: str, form: type[T]) -> Iterator[tuple[Path, T, list[int]]]:
        """Records of all products whose names begin so, in order: file, product, sizes of files."""
        for path in sorted(self.folder.glob(f"{prefix}*.json")) if self.folder.is_dir() else ():
            record = self._read(path) or {}
            with suppress(ValueError):
                product = put_together(form, record.get("facts"))
                yield path, product, put_together(list[int], record.get("files"))

    def file_digest(self, path: Path) -> str:
        """Digest of a file's contents.

        It is read again where anything of its size, place and dates is not as it was. Dates are
        never compared by which is later, so that a clock that was set back changes nothing; the
        date of its last change (``st_ctime``) is among them since programs that copy or edit a
        file may give it the date of writing that it had.
        """
        stamp = path.stat()
        key = digest(
            str(path.resolve()),
            stamp.st_size,
            stamp.st_mtime_ns,
            stamp.st_ctime_ns,
            stamp.st_ino,
        )
        if key not in self._digests:
            name = f"file-{digest(str(path.resolve()))[:16]}"
            self._digests[key] = self.once(name, key, str, lambda: _contents(path))
        return self._digests[key]

    def sweep(self, *folders: Path) -> None:
        """Remove what killed runs left half-written among the results and in further folders.

        Those are files whose names begin with a dot and end in ``.part``, and those that never got
        to their places. Another run that is still writing has such files too, so the folder is held
        first.
        """
        hold(self.folder)
        self.drop(self.MADE)
        results = self.folder.parent
        for folder in (self.folder, results, results / FOUND, results / PICTURES, *folders):
            for path in folder.glob(".*.part") if folder.is_dir() else ():
                path.unlink(missing_ok=True)

    def drop(self, mark: str) -> None:
        """Remove files that never got to their places, whole or not."""
        for pattern in (f"{mark}*", f".{mark}*.part"):
            for path in self.folder.glob(pattern) if self.folder.is_dir() else ():
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
            record = json.loads(path.read_text(encoding="utf-8"), object_hook=restored)
        except (OSError, ValueError, RecursionError):
            return None
        return record if isinstance(record, dict) else None


def _contents(path: Path) -> str:
    """The digest of a file's contents."""
    state = hashlib.blake2b(digest_size=20)
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            state.update(block)
    return state.hexdigest()


def _size(path: Path) -> int:
    """Size of a file in bytes, -1 if it is not there."""
    try:
        return os.stat(path).st_size
    except OSError:
        return -1
