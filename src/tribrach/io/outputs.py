"""Writes files that are either whole or absent, several of them together."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.keeping import hold, note_written, refuse_changes, refuse_loss

#: of a file: text, bytes, or pieces of text
Content = str | bytes | Iterator[str]


def write_text(path: Path, text: str) -> Path:
    """Write UTF-8 text under a temporary name and rename it; folders are made as needed."""
    return write_texts({path: text})[0]


def write_bytes(path: Path, data: bytes) -> Path:
    """Write bytes under a temporary name and rename it; folders are made as needed."""
    return write_texts({path: data})[0]


def write_texts(texts: Mapping[Path, Content]) -> list[Path]:
    """Write several files of UTF-8 text or bytes; all get temporary names first, then their own.

    ``texts``: contents by path: text, bytes, or pieces of text that are written one by one, so that
    a long file is never in memory whole.
    """
    staged: dict[Path, str] = {}
    path = Path()
    try:
        for path, text in texts.items():
            staged[path] = _stage(path, text)
        refuse_changes()
        note_written({to: Path(name) for to, name in staged.items() if not special(to)})
        for path, name in staged.items():
            _put(name, path)
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({reason(error)})", file=path, cure="check the folder"
        ) from error
    finally:
        for name in staged.values():
            Path(name).unlink(missing_ok=True)
    return list(texts)


def take_over(made: Path, path: Path) -> Path:
    """Give a whole file, which somebody wrote for this program, the name of a result.

    ``made``: the file, on the disk of the result; it has that name no more afterwards.
    """
    try:
        place = destination(path)
        if special(place):
            raise OSError(22, "it is no ordinary file")
        refuse_changes()
        note_written({path: made})
        os.replace(made, place)
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({reason(error)})", file=path, cure="check the folder"
        ) from error
    return path


def copy_file(source: Path, path: Path) -> Path:
    """Copy a file of this program's under a temporary name and rename it."""
    name = ""
    try:
        place = destination(path)
        with source.open("rb") as given:
            handle, name = tempfile.mkstemp(
                prefix=f".{place.name}.", suffix=".part", dir=place.parent
            )
            with os.fdopen(handle, "wb") as file:
                shutil.copyfileobj(given, file)
        _open_to_others(name)
        return take_over(Path(name), path)
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({reason(error)})", file=path, cure="check the folder"
        ) from error
    finally:
        if name:
            Path(name).unlink(missing_ok=True)


def destination(path: Path) -> Path:
    """The path that is really written: the target of a link, in a folder that is made as needed."""
    if path.is_dir():
        raise IsADirectoryError(21, "it is a folder")
    if special(path):
        return path
    refuse_loss(path)
    hold(path)
    path = path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def reason(error: OSError) -> str:
    """Reason why a file cannot be written, in words."""
    if isinstance(error, FileExistsError | NotADirectoryError):
        return "its folder is a file"
    return str(error.strerror or error)


def special(path: Path) -> bool:
    """True for devices and pipes, which are written to and never replaced."""
    return path.exists() and not path.is_file()


def _put(name: str, path: Path) -> None:
    """Rename a temporary file; a device or pipe gets its content."""
    if special(path):
        with open(name, "rb") as source, path.open("wb") as target:
            shutil.copyfileobj(source, target)
    else:
        os.replace(name, path.resolve())


def _stage(path: Path, text: Content) -> str:
    """Write the content beside its destination."""
    place = destination(path)
    # beside a device or a pipe is no place for files
    folder = None if special(place) else place.parent
    handle, name = tempfile.mkstemp(prefix=f".{place.name}.", suffix=".part", dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            if isinstance(text, bytes):
                file.write(text)
            else:
                pieces = [text] if isinstance(text, str) else text
                file.writelines(piece.encode("utf-8") for piece in pieces)
        _open_to_others(name)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return name


def _open_to_others(name: str) -> None:
    """Give a temporary file, which is private, the rights of any other new file."""
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(name, 0o666 & ~mask)
