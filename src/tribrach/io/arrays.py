"""Arrays in files of numpy: sets of named ones (``.npz``), and covariance matrices (``.npy``).

Nothing is unpickled, and the header of a matrix is checked before memory is taken for it.
"""

from __future__ import annotations

import io
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.keeping import keep

#: deflate packs nothing more tightly than this; bytes of the header of an array
_DEFLATED, _HEADER = 1040, 10_000
#: what reading a damaged archive raises
_DAMAGE = (
    ValueError, KeyError, EOFError, NotImplementedError, RuntimeError, SyntaxError, MemoryError,
    struct.error, TypeError, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def read_named(path: Path, *needed: str) -> dict[str, NDArray[Any]]:
    """All arrays of an ``.npz`` file by name."""
    cure = "make the file again"
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = {m.filename.removesuffix(".npy"): _array(archive, m) for m in archive.filelist}
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror or error})", file=path, cure=cure
        ) from error
    except _DAMAGE as error:
        raise InputError(
            "the file is no set of arrays, or damaged", file=path, cure=cure
        ) from error
    for name in needed:
        if name not in arrays:
            raise InputError(f"the file has no array {name}", file=path, cure=cure)
    return arrays


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """One array of an archive; memory is taken for what its bytes can hold, not what it says."""
    if member.file_size > _DEFLATED * member.compress_size + _HEADER:
        raise ValueError("more than the bytes can hold")
    with archive.open(member) as file:
        if np.lib.format.read_magic(file) != (1, 0):
            raise ValueError("version")
        shape, fortran, kind = _header(file, _HEADER)
        size = math.prod(shape) * kind.itemsize
        if kind.hasobject or min(shape, default=0) < 0 or size != member.file_size - file.tell():
            raise ValueError("shape")
        data = file.read(size + 1)
    if len(data) != size:
        raise ValueError("length")
    flat = np.frombuffer(bytearray(data), kind) if size else np.empty(math.prod(shape), kind)
    return flat.reshape(shape, order="F" if fortran else "C")


def _header(file: IO[bytes], largest: int) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, order and kind of an array; numpy reads them as Python, which warns of odd texts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.lib.format.read_array_header_1_0(file, max_header_size=largest)


def joint_covariance_bytes(covariance: Array) -> bytes:
    """Content of an ``.npy`` file with a joint covariance (q, q)."""
    buffer = io.BytesIO()
    np.save(buffer, covariance, allow_pickle=False)
    return buffer.getvalue()


def read_joint_covariance(path: Path, stations: int, effects: int = 0) -> Array:
    """The joint covariance (6n + k, 6n + k) of the poses of n stations and of k effects."""
    n = 6 * stations + effects
    return read_covariance_rows(path, n, n, f"joint covariance of {stations} stations")


def read_covariance_rows(
    path: Path, rows: int, columns: int, what: str = "joint covariance of the points"
) -> Array:
    """Rows (k, n) of a joint covariance."""
    cure = "run the project again"
    keep([path])
    try:
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            if version != (1, 0):
                raise ValueError("version")
            shape, fortran, kind = _header(file, 1000)
            if shape != (rows, columns) or fortran or kind != np.dtype("<f8"):
                raise ValueError("shape")
            values = np.frombuffer(file.read(8 * rows * columns), "<f8").reshape(shape)
    except OSError as error:
        raise InputError(
            f"the {what} cannot be read ({error.strerror})",
            file=path,
            cure=cure,
        ) from error
    except _DAMAGE as error:
        raise InputError(f"the file is no {what}", file=path, cure=cure) from error
    if not np.isfinite(values).all():
        raise InputError("the joint covariance has a value that is no number", file=path, cure=cure)
    return np.array(values, dtype=np.float64)
