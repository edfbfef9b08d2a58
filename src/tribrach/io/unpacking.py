"""Packed files, unpacked in one place and within bounds: gzip, xz, bzip2, compress, Hatanaka.

A few kilobytes can stand for gigabytes. What a file becomes is bounded by its own size, with more
room than any survey data need, and nothing is unpacked beyond the bound to find that out.
"""

from __future__ import annotations

import bz2
import gzip
import importlib
import io
import lzma
import subprocess
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any, BinaryIO, cast

from tribrach.errors import InputError
from tribrach.io.keeping import keep

#: unpacked files above this are refused: a day of four systems at 1 s has about 700 MB
MAX_BYTES = 1_000_000_000
#: a file may become so many times as large (RINEX packed twice: 100; a scan of mostly sky: 50) ...
_EXPANSION = 300
#: ... and so many bytes are never too many
_FREE = 1 << 24
#: bytes that are unpacked at a time
_CHUNK = 1 << 20
#: how to unpack a file, by its first bytes
_STREAMS: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"\xfd7zXZ\x00": lzma.open,
    b"BZh": bz2.open,
}
_COMPRESS = b"\x1f\x9d"
_HATANAKA = b"COMPACT RINEX FORMAT"
#: what unpacking damaged data raises
_DAMAGE = (EOFError, lzma.LZMAError, zlib.error, gzip.BadGzipFile)
_AGAIN = "download, transfer or copy it again"


class _Bound:
    """How much a file may become.

    ``most``: so many bytes [bytes] are too many for any file.
    """

    def __init__(self, path: Path, size: int, most: int | None = None) -> None:
        self.path, own = path, _FREE + _EXPANSION * size
        self.most = own if most is None else min(own, most)

    def check(self, total: int) -> None:
        """Refuse a total of unpacked bytes that no file of this size stands for."""
        if total > self.most:
            large = self.most == MAX_BYTES
            raise InputError(
                f"unpacked, the file has more than {self.most / 1e6:.0f} MB",
                file=self.path,
                cure="thin it out to fewer epochs or points"
                if large
                else "unpack it yourself if it is what you think it is",
            )


class _BoundedStream:
    """A stream that ends in a refusal where its bound is."""

    def __init__(self, stream: Any, bound: _Bound) -> None:
        self._stream, self._bound = stream, bound

    def read(self, size: int = -1) -> bytes:
        room = self._bound.most + 1 - self._stream.tell()
        data: bytes = self._stream.read(room if size < 0 else min(size, max(room, 1)))
        self._bound.check(self._stream.tell())
        return data

    def seek(self, offset: int, whence: int = 0) -> int:
        self._bound.check(offset)
        return int(self._stream.seek(offset, whence))

    def __iter__(self) -> Iterator[bytes]:
        while line := self._stream.readline(self._bound.most):
            self._bound.check(self._stream.tell())
            yield line


class _BoundedSink(io.RawIOBase):
    """Takes what is unpacked until that is too much."""

    def __init__(self, bound: _Bound) -> None:
        self._bound, self.parts, self._total = bound, list[bytes](), 0

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self._total += len(data)
        self._bound.check(self._total)
        self.parts.append(bytes(data))
        return len(data)


@contextmanager
def unpacked(path: Path) -> Iterator[BinaryIO]:
    """A file for reading, unpacked on the way if it is gzip, xz or bzip2."""
    keep([path])
    try:
        with path.open("rb") as file:
            magic = file.read(6)
            size = file.seek(0, io.SEEK_END)
            file.seek(0)
            for start, unpack in _STREAMS.items():
                if magic.startswith(start):
                    with unpack(file) as stream:
                        yield cast(BinaryIO, _BoundedStream(stream, _Bound(path, size)))
                    return
            yield file
    except _DAMAGE as error:
        raise InputError(
            f"the packed data are damaged or end too soon ({error})", file=path, cure=_AGAIN
        ) from error
    except OSError as error:
        words = error.strerror or error
        raise InputError(f"the file cannot be read ({words})", file=path, cure=_AGAIN) from error


def unpacked_bytes(path: Path) -> bytes:
    """The whole content of a file, unpacked as often as it is packed, and not empty."""
    with unpacked(path) as file:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"the file has more than {MAX_BYTES / 1e6:.0f} MB",
                file=path,
                cure="thin it out to fewer epochs or points",
            )
        bound = _Bound(path, size, MAX_BYTES)
        sink = _BoundedSink(bound)
        for part in iter(lambda: file.read(_CHUNK), b""):
            sink.write(part)
    data = b"".join(sink.parts)
    if data.startswith(_COMPRESS):
        data = _uncompressed(bound, data)
    if not data.strip():
        raise InputError("the file is empty", file=path, cure=_AGAIN)
    if _HATANAKA in data[:2000]:
        data = _without_hatanaka(bound, data)
    return data


def _uncompressed(bound: _Bound, data: bytes) -> bytes:
    """Content of a file of Unix compress."""
    sink = _BoundedSink(bound)
    try:
        _package(bound.path, "ncompress").decompress(data, sink)
    except (ValueError, OSError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "the compressed data are damaged or end too soon", file=bound.path, cure=_AGAIN
        ) from error
    return b"".join(sink.parts)


def _without_hatanaka(bound: _Bound, data: bytes) -> bytes:
    """RINEX out of Compact RINEX, by the program of its author.

    The package gives everything at once, however much it is; so its program is run here and what
    it writes is counted.
    """
    _package(bound.path, "hatanaka")
    folder = files("hatanaka.bin")
    names = ("crx2rnx", "crx2rnx.exe")
    program = next((str(folder / name) for name in names if (folder / name).is_file()), names[0])
    sink = _BoundedSink(bound)
    with tempfile.TemporaryFile() as source, tempfile.TemporaryFile() as said:
        source.write(data)
        source.seek(0)
        with subprocess.Popen(
            [program, "-"], stdin=source, stdout=subprocess.PIPE, stderr=said
        ) as process:
            try:
                for part in iter(lambda: process.stdout.read(_CHUNK), b""):  # type: ignore[union-attr]
                    sink.write(part)
            except BaseException:
                process.kill()
                raise
        said.seek(0)
        words = said.read(10_000)
    # status 2: warnings; of what is skipped nothing is left
    if process.returncode not in (0, 2) or b"skip" in words:
        raise InputError(
            "the compact RINEX is damaged or ends too soon", file=bound.path, cure=_AGAIN
        )
    return b"".join(sink.parts)


def _package(path: Path, name: str) -> Any:
    """A package that is installed on wish; ncompress comes with hatanaka."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise InputError(
            "reading Hatanaka or .Z files needs the package hatanaka",
            file=path,
            cure="install tribrach[gnss], or unpack the file with crx2rnx",
        ) from error
