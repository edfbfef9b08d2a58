"""The picture in the head of reports."""

from __future__ import annotations

import base64
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.keeping import keep

#: a larger one makes every report as large
_MOST = 1_000_000
_SORTS = {
    b"\x89PNG\r\n\x1a\n": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"<svg": "image/svg+xml",
    b"<?xml": "image/svg+xml",
}


def read_logo(path: Path | None) -> str:
    """A picture as an address that holds all of it.

    ``path``: PNG, JPEG or SVG of one megabyte at most; None where there is none. Returns the
    source of an image in a page, where a drawing can run nothing; "" without one.
    """
    if path is None:
        return ""
    keep([path])
    try:
        with path.open("rb") as file:
            data = file.read(_MOST + 1)
    except OSError as error:
        raise InputError(
            f"the logo cannot be read ({error.strerror})", file=path, cure="check the name"
        ) from error
    if len(data) > _MOST:
        raise InputError("the logo is larger than 1 MB", file=path, cure="make it smaller")
    sort = next((kind for begin, kind in _SORTS.items() if data.startswith(begin)), None)
    if sort is None:
        raise InputError(
            "the logo is no PNG, JPEG or SVG", file=path, cure="save it as one of these"
        )
    return f"data:{sort};base64,{base64.b64encode(data).decode('ascii')}"
