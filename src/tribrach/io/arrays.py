"""Arrays in files of numpy: sets of named ones (``.npz``), and covariance matrices (``.npy``).

Nothing is unpickled, and the header of a matrix is checked before memory is taken for it.
"""

from __future__ import annotations

import io
import tokenize
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError

__all__ = ["joint_covariance_bytes", "named_bytes", "read_joint_covariance", "read_named"]


def named_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Content of an ``.npz`` file with these arrays, compressed."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **dict(arrays))
    return buffer.getvalue()


def read_named(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of an ``.npz`` file by name.

    Raises
    ------
    OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile
        The file cannot be read or is damaged; callers know what to do about it.
    """
    with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def joint_covariance_bytes(covariance: Array) -> bytes:
    """Content of an ``.npy`` file with a joint covariance (6n, 6n)."""
    buffer = io.BytesIO()
    np.save(buffer, covariance, allow_pickle=False)
    return buffer.getvalue()


def read_joint_covariance(path: Path, stations: int) -> Array:
    """The joint covariance (6n, 6n) of the poses of n stations.

    Parameters
    ----------
    path
        An ``.npy`` file.
    stations
        Their number.

    Raises
    ------
    InputError
        The file cannot be read, is no matrix of this size, or has values that are no numbers.
    """
    n = 6 * stations
    cure = "run the project again"
    try:
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            if version != (1, 0):
                raise ValueError("version")
            shape, fortran, kind = np.lib.format.read_array_header_1_0(file, max_header_size=1000)
            if shape != (n, n) or fortran or kind != np.dtype("<f8"):
                raise ValueError("shape")
            values = np.frombuffer(file.read(8 * n * n), "<f8").reshape(n, n)
    except OSError as error:
        raise InputError(
            f"the joint covariance of the poses cannot be read ({error.strerror})",
            file=path,
            cure=cure,
        ) from error
    except (ValueError, SyntaxError, EOFError, tokenize.TokenError) as error:
        what = f"the file is no joint covariance of {stations} stations"
        raise InputError(what, file=path, cure=cure) from error
    if not np.isfinite(values).all():
        raise InputError("the joint covariance has a value that is no number", file=path, cure=cure)
    return np.array(values, dtype=np.float64)
