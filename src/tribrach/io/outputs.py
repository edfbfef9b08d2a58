"""Files that are either whole or not there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from tribrach.errors import InputError

__all__ = ["write_text"]


def write_text(path: Path, text: str) -> Path:
    """Write UTF-8 text under a temporary name and rename it; folders are made as needed.

    Raises
    ------
    InputError : the folder or file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({error.strerror})", file=path, cure="check the folder"
        ) from error
    return path
