"""The bytes of a RINEX file, unpacked and bounded in size.

Plain text, gzip and Unix compress, and Hatanaka compression (RINEX ``.crx``, ``.yyd``) with the
package ``hatanaka``. Formats: Gurtner and Estey, RINEX 2.11 and 3.05; Hatanaka (2008), Bull. GSI
55.
"""

from __future__ import annotations

import gzip
import importlib
import io
import zlib
from pathlib import Path

from tribrach.errors import InputError

__all__ = ["MAX_BYTES", "read_packed", "read_rinex"]

#: unpacked files above this are refused: a day of four systems at 1 s has about 700 MB
MAX_BYTES = 1_000_000_000
#: first bytes of packed files
_GZIP, _COMPRESS = b"\x1f\x8b", b"\x1f\x9d"
#: bytes that are unpacked at a time
_CHUNK = 1 << 22


def read_rinex(path: Path) -> bytes:
    """Plain RINEX text of a file that may be packed.

    Raises
    ------
    InputError
        The file cannot be read, is empty, too large, damaged or truncated, or not RINEX.
    """
    data = read_packed(path)
    if b"RINEX VERSION / TYPE" not in data[:400]:
        raise InputError(
            "this is no RINEX file: its first line does not say RINEX VERSION / TYPE",
            file=path,
            cure="give observation and navigation files in RINEX 2 or 3",
        )
    return data


def read_packed(path: Path) -> bytes:
    """Plain text of a file that may be packed.

    Raises
    ------
    InputError
        The file cannot be read, is empty, too large, damaged or truncated.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise _too_large(path)
        data = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error
    if data[:2] == _GZIP:
        data = _gunzip(path, data)
    elif data[:2] == _COMPRESS:
        data = _hatanaka(path, data)
    if not data.strip():
        raise InputError("the file is empty", file=path, cure="download or transfer it again")
    if b"COMPACT RINEX FORMAT" in data[:2000]:
        data = _hatanaka(path, data)
    return data


def _gunzip(path: Path, data: bytes) -> bytes:
    """Text out of gzip, in chunks so that its size is bounded."""
    out, total = [], 0
    try:
        with gzip.open(io.BytesIO(data)) as stream:
            while part := stream.read(_CHUNK):
                out.append(part)
                total += len(part)
                if total > MAX_BYTES:
                    raise _too_large(path)
    except EOFError as error:
        raise InputError(
            "the gzip file ends too early", file=path, cure="download or transfer it again"
        ) from error
    except (OSError, zlib.error) as error:
        raise InputError(
            "the gzip file is damaged", file=path, cure="download or transfer it again"
        ) from error
    return b"".join(out)


def _hatanaka(path: Path, data: bytes) -> bytes:
    """Text out of Hatanaka's or Unix compression."""
    try:
        hatanaka = importlib.import_module("hatanaka")
    except ImportError as error:
        raise InputError(
            "reading Hatanaka or .Z files needs the package hatanaka",
            file=path,
            cure="install tribrach[gnss], or unpack the file with crx2rnx",
        ) from error
    try:
        plain = hatanaka.decompress(data)
    except (hatanaka.HatanakaException, ValueError, OSError) as error:
        raise InputError(
            "the compressed RINEX is damaged or ends too early",
            file=path,
            cure="download or transfer it again",
        ) from error
    if len(plain) > MAX_BYTES:
        raise _too_large(path)
    return bytes(plain)


def _too_large(path: Path) -> InputError:
    return InputError(
        f"the file has more than {MAX_BYTES / 1e6:.0f} MB",
        file=path,
        cure="thin it out to fewer epochs",
    )
