"""Files that a file names: beside it or below, and never anywhere else."""

from __future__ import annotations

from pathlib import Path

from tribrach.errors import InputError


def named_file(name: str, folder: Path, root: Path | None = None) -> Path:
    """Path of a file that another file names."""
    shown = name.replace("\\", "/")
    try:
        path = (folder / shown).resolve()
        within = path.is_relative_to((folder if root is None else root).resolve())
        there = path.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"no file can be named {shown!r}", cure="check the name") from error
    if not within:
        raise InputError(f"{shown} is outside the folder of the data", cure="put it beside them")
    if not there:
        raise InputError(f"there is no file {shown}", cure="check the name")
    return path
