"""Pictures of one byte a pixel as small files that keep every pixel."""

from __future__ import annotations

import io
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["grey_file", "grey_picture"]


def grey_file(grey: NDArray[np.uint8]) -> bytes:
    """Pack a picture.

    Parameters
    ----------
    grey : array (rows, columns)
        Its pixels, 0 to 255.

    Returns
    -------
    bytes
        A WebP file without loss.
    """
    out = io.BytesIO()
    _images().fromarray(grey).save(out, "WEBP", lossless=True, quality=50, method=2)
    return out.getvalue()


def grey_picture(packed: bytes, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Unpack a picture.

    Parameters
    ----------
    packed
        What :func:`grey_file` gave.
    shape
        Rows and columns that it must have; a file of another size is not decoded.

    Returns
    -------
    array (rows, columns)
        Its pixels.

    Raises
    ------
    ValueError
        The file is damaged or of another size.
    """
    try:
        with _images().open(io.BytesIO(packed), formats=["WEBP"]) as picture:
            if picture.size != shape[::-1]:
                raise ValueError(f"the picture has {picture.size} pixels, not {shape[::-1]}")
            return np.array(picture.convert("L"))
    except (OSError, SyntaxError) as error:
        raise ValueError("the packed picture is damaged") from error


def _images() -> Any:
    """Pillow, which is loaded with the first picture."""
    return import_module("PIL.Image")
