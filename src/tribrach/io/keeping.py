"""What may be replaced: never a file that is read, and nothing that this program did not write.

A command says what it reads before it writes anything (:func:`keeping`). From then on every file
that is written passes :func:`refuse_loss`, which knows three rules:

* no result takes the place of a file that is read, under whatever name: a link, a hard link and
  another spelling are the same file;
* below a folder of results nothing is written through a link;
* a file that is there is replaced only by what wrote it: the same command and the same kind of
  result. It is listed with size, digest, command and kind in ``.tribrach/written.json`` of the
  folder of results, or of that of a single file; its content is read, for its date may be kept by
  who changed it. A single result replaces no file that a project file beside or above it names.

The last rule is lifted by ``overwrite``, the first two are not.

Two more rules see to it that what is written belongs together: one run at a time writes into a
folder of results (:mod:`tribrach.io.folder_lock`), and no result gets its name once a file that was
read has changed or vanished (:func:`refuse_changes`).
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from filelock import FileLock, Timeout

from tribrach.errors import InputError
from tribrach.io.folder_lock import LOCK_FILE, FolderLock
from tribrach.io.json_text import json_text
from tribrach.scratch import is_scratch

#: folder of what the program keeps for itself inside a folder of results
STATE_FOLDER = ".tribrach"

#: file there that lists what the program wrote
MANIFEST = "written.json"

#: lists beyond this size are none of ours [bytes]
_LARGEST = 20_000_000

#: nor are project files [bytes]
_LARGEST_PROJECT = 5_000_000

#: folders around a file in which a project file may name it
_AROUND = 4

#: so long a command waits for another one that changes the same list [s]
_PATIENCE = 5.0


class _Stamp(NamedTuple):
    """Identity of a file: size, date and number."""

    number: tuple[int, int]  #: device and number of the file, the same for all hard links
    size: int
    date: int  #: of its last change [ns]


class _Content(NamedTuple):
    """What the program wrote into a file, by which command and as what."""

    size: int  #: in bytes
    digest: str  #: SHA-256 of the content
    command: str  #: words of the command, such as ``transform fit``
    #: kind of result: the option that names it, what was asked for, or the name of the project file
    kind: str

    @property
    def writer(self) -> tuple[str, str]:
        """Command and kind."""
        return self.command, self.kind


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


#: what the program wrote into a folder, by the names of files
_Written = dict[str, list[_Content]]


@dataclass
class _Scope:
    """Files that one piece of work reads, and places where it writes."""

    #: resolved files that are read, with size, date and number when they were first named; None for
    #: those that were not there
    stamps: dict[Path, _Stamp | None] = field(default_factory=dict)
    #: device and number of those files, the same for all hard links
    numbers: set[tuple[int, int]] = field(default_factory=set)
    folder: Path | None = None  #: folder of results, absolute; None for single files
    overwrite: bool = False  #: files of others may be replaced
    #: the command whose work it is, and what its results are where no option names them
    command: str = ""
    kind: str = ""
    #: kinds of single results, by their absolute paths
    kinds: dict[Path, str] = field(default_factory=dict)
    #: digests of files that were read for them
    digests: dict[_Stamp, str] = field(default_factory=dict)
    #: resolved files that belong to what is read, whether they are opened or not
    beside: set[Path] = field(default_factory=set)
    locks: list[FolderLock] = field(default_factory=list)
    #: what the program wrote into a folder, by the path of the list, and what told the list from
    #: others when it was last read or written
    lists: dict[Path, tuple[_Stamp | None, _Written]] = field(default_factory=dict)

    def add(self, inputs: Iterable[Path]) -> None:
        """Keep further files."""
        for path in inputs:
            if is_scratch(resolved := path.resolve()):
                continue  # results on their way, such as those of an engine
            stamp = _stamp(path)
            self.stamps.setdefault(resolved, stamp)
            if stamp is not None:
                self.numbers.add(stamp.number)

    def files(self) -> list[Path]:
        """The files that are read, resolved."""
        return [path for path, stamp in self.stamps.items() if stamp is not None]

    def reads(self, path: Path) -> bool:
        """Is this one of the files that are read?"""
        stamp = _stamp(path)
        same = stamp is not None and stamp.number in self.numbers
        return same or path.resolve() in self.stamps

    def writer(self, path: Path) -> tuple[str, str]:
        """Who writes a file, as what."""
        return self.command, self.kinds.get(_plain(path), self.kind)

    def holds(self, path: Path, content: _Content) -> bool:
        """Does a file hold this?"""
        stamp = _stamp(path)
        if stamp is None or stamp.size != content.size:
            return False
        if stamp not in self.digests:
            self.digests[stamp] = _digest(path)
        return self.digests[stamp] == content.digest

    def hold(self) -> None:
        """Take the lock of the folder of results."""
        if self.folder is None:
            return
        lock = FolderLock(self.folder / STATE_FOLDER)
        lock.take()
        self.locks.append(lock)


#: the pieces of work that are going on in this process, in all of its threads
_SCOPES: list[_Scope] = []
#: true in what only looks
_LOOKING: ContextVar[bool] = ContextVar("only looking", default=False)


@contextmanager
def keeping(
    inputs: Iterable[Path] = (),
    folder: Path | None = None,
    *,
    overwrite: bool = False,
    command: str = "",
    kind: str = "",
) -> Iterator[None]:
    """Write within these rules until the block ends.

    ``folder``: folder of results, where one list says what was written; ``overwrite``: files that
    others wrote may be replaced, those that are read may not; ``command``: words of the command
    whose work it is; that of the block around it if not given; ``kind``: what its results are,
    where no option names them.
    """
    around = _SCOPES[-1].command if _SCOPES else ""
    scope = _Scope(
        folder=None if folder is None else _plain(folder),
        overwrite=overwrite,
        command=command or around,
        kind=kind,
    )
    scope.add(inputs)
    _SCOPES.append(scope)
    try:
        yield
    finally:
        # blocks of several threads may end in another order than they began
        _SCOPES[:] = [other for other in _SCOPES if other is not scope]
        for lock in scope.locks:
            lock.give_back()


def keep(
    inputs: Iterable[Path] = (),
    folder: Path | None = None,
    *,
    overwrite: bool = False,
    kinds: Mapping[Path, str] | None = None,
    beside: Iterable[Path] = (),
    kind: str | None = None,
) -> None:
    """Add to the innermost block of :func:`keeping`; without a block nothing happens.

    ``folder``: folder of results, where the block has none; ``overwrite``: lifts the rule on files
    that others wrote; ``beside``: files that belong to what is read, such as the poses of clouds.
    Nothing takes their place but what wrote them. ``kind``: what the results are, where no option
    names them.
    """
    if not _SCOPES or _LOOKING.get():
        return
    scope = _SCOPES[-1]
    scope.add(inputs)
    scope.overwrite |= overwrite
    scope.beside |= {path.resolve() for path in beside}
    scope.kinds |= {_plain(path): kind for path, kind in (kinds or {}).items()}
    if folder is not None:
        scope.folder = _plain(folder)
    if kind is not None:
        scope.kind = kind


@contextmanager
def looking() -> Iterator[None]:
    """A block that only looks: what is read in it may be replaced by work that goes on besides.

    A page that shows the results of the last run must not keep the next one from writing them.
    """
    token = _LOOKING.set(True)
    try:
        yield
    finally:
        _LOOKING.reset(token)


def hold(path: Path) -> None:
    """Let no other run write into the folder of results that a file is in, until the block ends."""
    scope = _scope_of(path)
    if scope is None or scope.folder is None or scope.locks:
        return
    if _plain(path).is_relative_to(scope.folder):
        scope.hold()


def refuse_changes() -> None:
    """Refuse to write anything once a file that was read is another one."""
    for scope in _SCOPES:
        for path, before in scope.stamps.items():
            if before is None:
                continue
            now = _stamp(path)
            if now != before:
                what = "vanished" if now is None else "changed"
                raise InputError(
                    f"this file {what} while it was worked with, so nothing more is written",
                    file=path,
                    cure="run the command again when it is at rest",
                )


@contextmanager
def rewriting(path: Path) -> Iterator[None]:
    """Take a file out of those that are read, to write it anew: decisions with one more."""
    stamp, resolved = _stamp(path), path.resolve()
    for scope in _SCOPES:
        scope.stamps.pop(resolved, None)
        if stamp is not None:
            scope.numbers.discard(stamp.number)
    with keeping(overwrite=True):
        yield


def is_read(path: Path) -> bool:
    """Is this one of the files that the work going on reads, under whatever name?"""
    return any(scope.reads(path) for scope in _SCOPES)


def refuse_loss(path: Path) -> None:
    """Refuse a file that may not be written, before anything is.

    ``path``: the file as it is named, links not yet followed.
    """
    scope = _scope_of(path)
    beside = scope is not None and any(path.resolve() in other.beside for other in _SCOPES)
    if is_read(path) or (scope and beside and path.is_file() and _why_not(path, scope)):
        raise InputError(
            "this result would take the place of a file that is read",
            file=path,
            cure="name another file or folder for results",
        )
    if scope is None:
        return
    if scope.folder is not None and _plain(path).is_relative_to(scope.folder):
        _refuse_links(path, scope.folder)
    if scope.overwrite or _own(path) or not path.is_file():
        return
    what = _why_not(path, scope)
    if what:
        raise InputError(
            what, file=path, cure="name another file, move it away, or replace it with --overwrite"
        )


def _why_not(path: Path, scope: _Scope) -> str:
    """Why a file that is there is not replaced unless somebody says so; "" if it is."""
    known = _written(_list_of(path, scope), scope).get(_name(path, scope), [])
    same = [content for content in known if scope.holds(path, content)]
    if not same:
        return (
            "this file was changed after this program wrote it"
            if known
            else "there is a file of this name that this program did not write there"
        )
    writer = scope.writer(path)
    if writer not in {content.writer for content in same}:
        by, mine = (" ".join(filter(None, who)) for who in (same[-1].writer, writer))
        return f"tribrach {by} wrote this file, and tribrach {mine} would replace it"
    if _root(path, scope) != scope.folder and (project := _project_that_names(path)) is not None:
        return f"the project file {project.name} names this file"
    return ""


def _project_that_names(path: Path) -> Path | None:
    """A project file of the folder, or of those around it, that names a file."""
    place = _plain(path)
    for folder in place.parents[:_AROUND]:
        for project in sorted(folder.glob("*.toml")):
            with suppress(OSError, ValueError, RecursionError):
                if project == place or project.stat().st_size > _LARGEST_PROJECT:
                    continue
                named = _strings(tomllib.loads(project.read_text(encoding="utf-8")))
                if any(n.endswith(path.name) and _plain(folder / n) == place for n in named):
                    return project
    return None


def _strings(value: object) -> Iterator[str]:
    """All texts in the values of a project file."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _strings(one)


def refuse_mixture(folder: Path) -> None:
    """Refuse a folder that holds what the command wrote as another kind, under whatever names."""
    scope = _scope_of(folder / MANIFEST)
    if scope is None or scope.overwrite:
        return
    mine = scope.command, scope.kind
    for name, known in _written(_list_of(folder / MANIFEST, scope), scope).items():
        writers = {content.writer for content in known}
        others = sorted(w for w in writers if w[0] == scope.command)
        if others and mine not in writers and (folder / name).is_file():
            raise InputError(
                f"this folder holds the job of tribrach {' '.join(others[0])}",
                file=folder,
                cure="name another folder, or replace its files with --overwrite",
            )


def note_written(files: Mapping[Path, Path]) -> None:
    """List files as written by this program, just before they get their names.

    ``files``: by the files as they are named their content, complete, under a temporary name.
    """
    by_list: dict[Path, tuple[_Scope, dict[Path, Path]]] = {}
    for path, part in files.items():
        scope = _scope_of(path)
        if scope is not None and not _own(path):
            by_list.setdefault(_list_of(path, scope), (scope, {}))[1][path] = part
    for place, (scope, some) in by_list.items():
        _add(place, scope, some)


def _add(place: Path, scope: _Scope, files: Mapping[Path, Path]) -> None:
    """Add files to the list of a folder."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with _alone(place.parent, scope):
            listed = dict(_written(place, scope))
            for path, part in files.items():
                name = _name(path, scope)
                content = _Content(part.stat().st_size, _digest(part), *scope.writer(path))
                # a run that is killed before the file gets its name leaves the one that was there
                there = [old for old in listed.get(name, []) if scope.holds(path, old)]
                listed[name] = [*(old for old in there if old != content), content]
            read = sorted(os.path.relpath(path, place.parent.parent) for path in scope.files())
            scope.lists[place] = _list(place, listed, read), listed
    except OSError as error:
        # a folder where only the file itself may be written: it will not be known as ours; on a
        # full disk a file that is not listed would stand in the way of the next run
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """A block in which no other process reads and replaces a file that people change together."""
    state = path.parent / STATE_FOLDER
    with suppress(OSError):  # where nothing can be written, the file is refused in its own words
        state.mkdir(parents=True, exist_ok=True)
    lock = FileLock(state / f"{path.name}.lock", timeout=_PATIENCE)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(
            "another session is writing this file", file=path, cure="try again in a moment"
        ) from None
    except OSError:
        pass  # a disk that knows no locks
    try:
        yield
    finally:
        lock.release()


@contextmanager
def _alone(state: Path, scope: _Scope) -> Iterator[None]:
    """A moment in which no other command changes the list of a folder."""
    lock = FileLock(state / LOCK_FILE, timeout=_PATIENCE)
    with suppress(Timeout):
        # a run that holds the folder for hours keeps nobody from writing a single file there
        if not scope.locks:
            lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _list(place: Path, written: _Written, read: list[str]) -> _Stamp | None:
    """Write the list of files written and last read, with what identifies them."""
    handle, part = tempfile.mkstemp(prefix=f".{MANIFEST}.", suffix=".part", dir=place.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(json_text({"read": read, "written": dict(sorted(written.items()))}))
        stamp = _stamp(Path(part))
        os.replace(part, place)
        return stamp
    finally:
        Path(part).unlink(missing_ok=True)


def _scope_of(path: Path) -> _Scope | None:
    """The innermost block whose folder holds the file, else the innermost block."""
    plain = _plain(path)
    for scope in reversed(_SCOPES):
        if scope.folder is not None and plain.is_relative_to(scope.folder):
            return scope
    return _SCOPES[-1] if _SCOPES else None


def _root(path: Path, scope: _Scope) -> Path:
    """The folder whose list names the file."""
    plain = _plain(path)
    if scope.folder is not None and plain.is_relative_to(scope.folder):
        return scope.folder
    return plain.parent


def _name(path: Path, scope: _Scope) -> str:
    return _plain(path).relative_to(_root(path, scope)).as_posix()


def _own(path: Path) -> bool:
    """Files of the state folder are ours by its name."""
    return path.parent.name == STATE_FOLDER


def _list_of(path: Path, scope: _Scope) -> Path:
    """The list that names a file."""
    return _root(path, scope) / STATE_FOLDER / MANIFEST


def _written(place: Path, scope: _Scope) -> _Written:
    """What a list says that the program wrote; it is read again where another command changed it.

    Whoever changes a list puts a new file in its place, so it never has the same stamp again.
    """
    stamp = _stamp(place)
    known = scope.lists.get(place)
    if known is None or known[0] != stamp:
        scope.lists[place] = known = stamp, {} if stamp is None else _read(place)
    return known[1]


def _read(place: Path) -> _Written:
    """A list from its file; empty where it is damaged."""
    try:
        if place.stat().st_size > _LARGEST:
            return {}
        listed = json.loads(place.read_text(encoding="utf-8"))["written"]
        return {name: [_Content(*content) for content in known] for name, known in listed.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def written_in(folder: Path, command: str) -> dict[str, bool]:
    """The files that a command wrote into a folder of results: is each still as it was written?"""
    scope, found = _Scope(command=command), dict[str, bool]()
    for name, known in _read(folder / STATE_FOLDER / MANIFEST).items():
        mine = [content for content in known if content.command == command]
        if mine and (folder / name).is_file():
            found[name] = any(scope.holds(folder / name, content) for content in mine)
    return found


def read_for(folder: Path) -> list[Path]:
    """The files that the last work read whose results are in a folder, as far as they are there."""
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        names = json.loads((folder / STATE_FOLDER / MANIFEST).read_text(encoding="utf-8"))["read"]
        paths = (_plain(folder / name) for name in names)
        return [path for path in paths if path.is_file()]
    return []


def _refuse_links(path: Path, folder: Path) -> None:
    """Refuse a link among the file and the folders between it and the folder of results."""
    place = _plain(path)
    while place != folder:
        if place.is_symlink():
            raise InputError(
                "this is a link, and results are not written through links",
                file=place,
                cure="remove the link, or name another folder for results",
            )
        place = place.parent


def _plain(path: Path) -> Path:
    """The absolute path without dots, links not followed."""
    return Path(os.path.abspath(path))


def _stamp(path: Path) -> _Stamp | None:
    """What tells a file from others, None if it is not there."""
    try:
        status = path.stat()
    except OSError:
        return None
    return _Stamp((status.st_dev, status.st_ino), status.st_size, status.st_mtime_ns)
