"""Clouds of an earlier grouping or format give way to those that hold the same scans now.

A file is removed only if its record says that it was written here, its size and date are still
those of then, and every scan in it is in the clouds of this run. What anybody else put there or
changed stays, and so does the cloud of a scan that the project has no longer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.stages.scans import StationScan
from tribrach.stages.state import State, digest

__all__ = ["note_written", "remove_superseded"]

#: records of files hold paths and dates, and so are apart from those of what was made
_NOTE = "file-cloud-"


def note_written(state: State, path: Path, scans: Sequence[StationScan]) -> None:
    """Note what a cloud just written is, so that it can be removed later."""
    facts = {"file": path.name, "date": path.stat().st_mtime_ns, "scans": _marks(scans)}
    state.remember(_NOTE + path.name, "", facts, path)


def remove_superseded(
    state: State, folder: Path, current: Sequence[Path], scans: Sequence[StationScan]
) -> list[str]:
    """Remove clouds that others have taken the place of; the names of their files.

    current : the clouds of this run, all of them written; scans : what they hold.

    Raises
    ------
    InputError : a file cannot be removed.
    """
    held, gone = set(_marks(scans)), []
    for record, data in state.records(_NOTE):
        path = _own(folder, data)
        if path is None or not set(data["facts"]["scans"]) <= held:
            continue
        if any(path.name == now.name or _same(path, now) for now in current):
            continue
        try:
            path.unlink()
            state.forget(f"cloud-{path.name}")
            record.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"this cloud of an earlier run cannot be removed ({error.strerror})",
                file=path,
                cure="close it elsewhere, or take another folder with --out",
            ) from error
        gone.append(path.name)
    return gone


def _own(folder: Path, data: Mapping[str, Any]) -> Path | None:
    """The file that a record tells of, if it is untouched since; names lead nowhere else."""
    facts, sizes = data.get("facts"), data.get("files")
    if not isinstance(facts, dict) or not isinstance(sizes, list) or len(sizes) != 1:
        return None
    name, date, marks = (facts.get(key) for key in ("file", "date", "scans"))
    if not isinstance(name, str) or not isinstance(marks, list) or not marks:
        return None
    path = folder / name
    if name in ("", ".", "..") or path.name != name or path.parent != folder:
        return None
    try:
        found = path.lstat()
    except (OSError, ValueError):
        return None
    untouched = found.st_mtime_ns == date and found.st_size == sizes[0]
    return path if untouched and path.is_file() and not path.is_symlink() else None


def _marks(scans: Sequence[StationScan]) -> list[str]:
    """A mark for each scan: its file and its number there."""
    return [digest(str(s.scan.path.resolve()), s.scan.index) for s in scans]


def _same(one: Path, other: Path) -> bool:
    """One file under two names, where a file system knows no capitals."""
    try:
        return one.samefile(other)
    except OSError:
        return False
