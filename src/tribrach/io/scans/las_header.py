"""What the header of a LAS file promises, checked against the size of the file before it is read.

laspy takes what is missing for zeros and believes every count, lazrs reserves memory for as many
chunks as a file names: a few wrong bytes would cost all memory. Positions are those of LAS 1.4 R15,
tables 3 (header), 6 (record headers), and of the chunk table of LASzip.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from tribrach.errors import InputError

__all__ = ["CURE", "check_header"]

CURE = "copy the file again from its source"
#: bytes of the header of a record in front of the points, and of one behind them
_RECORD, _EXTENDED = 54, 60
#: the shortest header, and that of LAS 1.4
_SHORTEST, _LONG = 227, 375
#: bit of the point format that says that points are compressed
_COMPRESSED = 0x80


def check_header(path: Path) -> None:
    """Refuse a header that promises more than its file can hold.

    Raises
    ------
    InputError : positions, numbers of records or of chunks lie outside of the file.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_LONG)
        if not head.startswith(b"LASF"):
            return
        if len(head) < _SHORTEST:
            raise _refused(f"the header has {_SHORTEST} bytes and the file has {size}", path)
        length, begin, records = struct.unpack_from("<HII", head, 94)
        if begin > size:
            raise _refused(f"the points begin at byte {begin} and the file has {size} bytes", path)
        if not _SHORTEST <= length <= begin:
            raise _refused(f"the header says that it has {length} bytes", path)
        if _RECORD * records > begin - length:
            raise _refused(f"the header names {records} records, more than fit", path)
        if head[25] >= 4 and length >= _LONG == len(head):
            _check_extended(file, head, size, path)
        if head[104] & _COMPRESSED:
            _check_chunks(file, begin, size, path)


def _check_extended(file: BinaryIO, head: bytes, size: int, path: Path) -> None:
    """Records behind the points: each lies in the file."""
    at, records = struct.unpack_from("<QI", head, 235)
    if records and at + _EXTENDED * records > size:
        raise _refused(f"the header names {records} records at byte {at}, more than fit", path)
    for end in _ends(file, at, records):
        if end > size:
            raise _refused(f"a record ends at byte {end} and the file has {size} bytes", path)


def _ends(file: BinaryIO, at: int, records: int) -> Iterator[int]:
    """Where each of the records behind the points ends."""
    for _ in range(records):
        file.seek(at)
        head = file.read(_EXTENDED)
        at += _EXTENDED + (struct.unpack_from("<Q", head, 20)[0] if len(head) == _EXTENDED else 0)
        yield at


def _check_chunks(file: BinaryIO, begin: int, size: int, path: Path) -> None:
    """Chunks of compressed points: no more than there are bytes for."""
    file.seek(begin)
    at = _integer(file)
    if at == -1:
        # written as a stream: the position stands at the end
        file.seek(size - 8)
        at = _integer(file)
    if at < begin + 8 or at + 8 > size:
        # a stream without a table is read in sequence, which needs no memory
        return
    file.seek(at + 4)
    chunks = int.from_bytes(file.read(4), "little")
    if chunks > size // 8:
        raise _refused(f"the points are said to lie in {chunks} chunks, more than fit", path)


def _integer(file: BinaryIO) -> int:
    return int.from_bytes(file.read(8), "little", signed=True)


def _refused(what: str, path: Path) -> InputError:
    return InputError(what, file=path, cure=CURE)
