"""The file of a sealed job: a bag after RFC 8493 (BagIt 1.0) in a zip, written and read safely.

Its payload stands in ``data`` with the names that the files have beside each other, so that a
project in it finds its scans and observations. ``manifest-sha256.txt`` lists their digests,
``tagmanifest-sha256.txt`` those of the lists and of ``seal.json``; a signature is of the latter.
A file by reference stands in ``fetch.txt``, named by its digest (RFC 6920).
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Literal

from tribrach.errors import InputError
from tribrach.io.json_text import json_text
from tribrach.io.outputs import destination, reason, take_over

#: what may be wrong with a file
Wrong = Literal["changed", "missing", "not listed"]
#: what the seal says of itself, what is signed, and the signature
ABOUT, SIGNED, SIGNATURE = "seal.json", "tagmanifest-sha256.txt", "signature.p7s"
_MANIFEST, _FETCH, _PAYLOAD = "manifest-sha256.txt", "fetch.txt", "data/"
_DECLARATION = "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n"
_CHUNK = 1 << 20
#: the most files of a bag; its largest list [bytes]
_FILES, _LIST = 100_000, 50_000_000
#: so many times smaller a file that is larger than the second [bytes] may be once it is packed
_PACKED, _LARGE = 200, 10_000_000
_DATE = (1980, 1, 1, 0, 0, 0)
_LINE = re.compile(r"([0-9a-fA-F]{64})\s+\*?(\S.*)")
_CURE = "take the seal again from where it came from"


def digest_of(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return _digest(iter(partial(file.read, _CHUNK), b""))


def _digest(chunks: Iterable[bytes]) -> str:
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(chunk)
    return digest.hexdigest()


def files_below(folder: Path) -> dict[str, Path]:
    """Files of a folder and of those in it, by their names from there."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path for path in files}


def copied(source: Path, target: Path, digest: str) -> None:
    """Copy a file that has this digest."""
    if digest_of(source) != digest:
        raise InputError(
            "this is not the file that was sealed",
            file=source,
            cure="give the folder of the files that were sealed",
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)


def write_bag(
    path: Path,
    root: str,
    payload: Mapping[str, Path],
    digests: Mapping[str, str],
    absent: Collection[str],
    about: Mapping[str, Any],
    info: Mapping[str, str],
    sign: Callable[[bytes], bytes] | None = None,
) -> tuple[str, int]:
    """Write a bag.

    payload : files by their names in it; those that are ``absent`` are only named by their digest.
    sign : makes the signature of the lists.

    Returns the digest of what is signed, and the size of the file [bytes].
    """
    seen = set[str]()
    for name, place in payload.items():
        if _leaves(name) or name.casefold() in seen:
            what = "a name with : or \\, or the same as another but for capitals, is not sealed"
            raise InputError(what, file=place, cure="rename the file; others could not unpack it")
        seen.add(name.casefold())
    sizes = {name: payload[name].stat().st_size for name in payload}
    tags = _tags(sizes, digests, absent, about, info)
    listed = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in tags.items()}
    signed = "".join(f"{digest}  {name}\n" for name, digest in sorted(listed.items()))
    texts: dict[str, str | bytes] = {**tags, SIGNED: signed}
    if sign is not None:
        texts[SIGNATURE] = sign(signed.encode())
    place = destination(path)
    handle, part = tempfile.mkstemp(prefix=f".{place.name}.", suffix=".part", dir=place.parent)
    os.close(handle)
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
            for name, text in texts.items():
                archive.writestr(_entry(f"{root}/{name}"), text)
            for name in (name for name in payload if name not in absent):
                entry = _entry(f"{root}/{_PAYLOAD}{name}")
                entry.file_size = sizes[name]  # decides on zip64 before anything is written
                if sizes[name] > _LARGE:  # scans are packed already, and nothing here is a bomb
                    entry.compress_type = zipfile.ZIP_STORED
                with payload[name].open("rb") as given, archive.open(entry, "w") as packed:
                    shutil.copyfileobj(given, packed, _CHUNK)
        os.chmod(part, 0o644)
        take_over(Path(part), path)
    except OSError as error:
        what = f"the file cannot be written ({reason(error)})"
        raise InputError(what, file=path, cure="check the folder") from error
    finally:
        Path(part).unlink(missing_ok=True)
    return hashlib.sha256(signed.encode()).hexdigest(), path.stat().st_size


def _tags(
    sizes: Mapping[str, int],
    digests: Mapping[str, str],
    absent: Collection[str],
    about: Mapping[str, Any],
    info: Mapping[str, str],
) -> dict[str, str]:
    """The lists of a bag, by name."""
    oxum = f"{sum(sizes.values())}.{len(sizes)}"
    known = {"Bagging-Date": datetime.now(UTC).date().isoformat(), "Payload-Oxum": oxum}
    tags = {
        "bagit.txt": _DECLARATION,
        "bag-info.txt": "".join(
            f"{key}: {' '.join(text.split())}\n" for key, text in {**info, **known}.items()
        ),
        ABOUT: json_text(dict(about), indent=1) + "\n",
        _MANIFEST: "".join(f"{digests[name]}  {_PAYLOAD}{_quoted(name)}\n" for name in sizes),
    }
    if absent:
        tags[_FETCH] = "".join(
            f"ni:///sha-256;{_base64url(digests[name])} {sizes[name]} {_PAYLOAD}{_quoted(name)}\n"
            for name in absent
        )
    return tags


def _entry(name: str) -> zipfile.ZipInfo:
    """A member that is the same whenever it is written."""
    entry = zipfile.ZipInfo(name, _DATE)
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    return entry


def _quoted(name: str) -> str:
    """A name as lists of bags have it."""
    return name.replace("%", "%25").replace("\n", "%0A").replace("\r", "%0D")


def _plain(name: str) -> str:
    for code, sign in (("%0A", "\n"), ("%0a", "\n"), ("%0D", "\r"), ("%0d", "\r"), ("%25", "%")):
        name = name.replace(code, sign)
    return name


def _base64url(digest: str) -> str:
    return base64.urlsafe_b64encode(bytes.fromhex(digest)).decode().rstrip("=")


@dataclass(frozen=True)
class Bag:
    """A bag that is open, and safe to unpack."""

    path: Path
    archive: zipfile.ZipFile
    root: str
    about: Mapping[str, Any]  #: what the seal says of itself
    #: digests of the payload and of the lists, as they are stated
    payload: Mapping[str, str]
    tags: Mapping[str, str]
    absent: frozenset[str]  #: payload that is only named

    def read(self, name: str) -> bytes | None:
        """A file of the bag beside the payload; None if it is missing."""
        return _read(self.archive, f"{self.root}/{name}", self.path)

    def differing(self) -> dict[str, Wrong]:
        """Faults of files, by name."""
        found: dict[str, Wrong] = {}
        there = {info.filename for info in self.archive.infolist() if not info.is_dir()}
        wanted = dict(self.tags)
        wanted |= {_PAYLOAD + name: digest for name, digest in self.payload.items()}
        for name, digest in wanted.items():
            member = f"{self.root}/{name}"
            if member not in there:
                if name.removeprefix(_PAYLOAD) not in self.absent:
                    found[name] = "missing"
            elif self._digest(member) != digest:
                found[name] = "changed"
        free = {f"{self.root}/{name}" for name in (*wanted, SIGNED, SIGNATURE)}
        for member in there - free:
            found[member.removeprefix(f"{self.root}/")] = "not listed"
        return found

    def _digest(self, member: str) -> str:
        """Digest of a member, "" where it is damaged."""
        try:
            with self.archive.open(member) as file:
                return _digest(iter(partial(file.read, _CHUNK), b""))
        except (zipfile.BadZipFile, OSError, EOFError, ValueError, zlib.error):
            return ""

    def unpack(self, name: str, place: Path) -> None:
        """Write a file of the payload; a damaged one is refused."""
        place.parent.mkdir(parents=True, exist_ok=True)
        try:
            member = f"{self.root}/{_PAYLOAD}{name}"
            with self.archive.open(member) as file, place.open("wb") as out:
                shutil.copyfileobj(file, out, _CHUNK)
        except (zipfile.BadZipFile, EOFError, ValueError, zlib.error) as error:
            what = "a file in it is damaged"
            raise InputError(what, file=self.path, record=name, cure=_CURE) from error

    def holds(self, name: str) -> bool:
        """Is the file inside?"""
        return f"{self.root}/{_PAYLOAD}{name}" in self.archive.NameToInfo


@contextmanager
def opened_bag(path: Path) -> Iterator[Bag]:
    """A bag, once its names, sizes and lists were found safe."""
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        what = getattr(error, "strerror", None) or "it is no zip file, or it ends too soon"
        raise InputError(f"this is no sealed job ({what})", file=path, cure=_CURE) from error
    with archive:
        root = _root(path, archive)
        about = _read(archive, f"{root}/{ABOUT}", path)
        lists = [_listed(path, archive, f"{root}/{name}") for name in (_MANIFEST, SIGNED)]
        if about is None:
            raise InputError("there is no seal.json in it", file=path, cure=_CURE)
        try:
            said = json.loads(about)
            if not isinstance(said, dict):
                raise ValueError("it is no object")
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"its seal.json cannot be read ({error})", file=path, cure=_CURE
            ) from error
        payload = {
            name.removeprefix(_PAYLOAD): digest
            for name, digest in lists[0].items()
            if name.startswith(_PAYLOAD)
        }
        fetch = (_read(archive, f"{root}/{_FETCH}", path) or b"").decode("utf-8", "replace")
        named = {
            _plain(parts[2]).removeprefix(_PAYLOAD)
            for line in fetch.splitlines()
            if len(parts := line.split(maxsplit=2)) == 3
        }
        for name in (*payload, *named):
            _refuse_name(path, name)
        yield Bag(path, archive, root, said, payload, lists[1], frozenset(named & payload.keys()))


def _root(path: Path, archive: zipfile.ZipFile) -> str:
    """The one folder in which everything is; what is unsafe is refused."""
    members = archive.infolist()
    if len(members) > _FILES:
        raise InputError(f"it holds more than {_FILES} files", file=path, cure=_CURE)
    names, packed = set[str](), 0
    for one in members:
        _refuse_name(path, one.filename)
        if stat.S_ISLNK(one.external_attr >> 16):
            what = "it holds a link, which could lead out of the folder"
            raise InputError(what, file=path, record=one.filename, cure=_CURE)
        if one.flag_bits & 1:
            raise InputError(
                "a file in it is encrypted", file=path, record=one.filename, cure=_CURE
            )
        if one.filename.casefold() in names:
            raise InputError("it holds a name twice", file=path, record=one.filename, cure=_CURE)
        names.add(one.filename.casefold())
        packed += one.compress_size
        if one.file_size > max(_LARGE, _PACKED * one.compress_size):
            what = "a file in it unpacks to far more than it takes there"
            raise InputError(what, file=path, record=one.filename, cure=_CURE)
    if packed > path.stat().st_size:
        raise InputError("its files overlap", file=path, cure=_CURE)
    roots = {one.filename.split("/")[0] for one in members}
    if len(roots) != 1 or not all("/" in one.filename for one in members):
        raise InputError("this is no sealed job: a seal is one folder", file=path, cure=_CURE)
    return roots.pop()


def _leaves(name: str) -> bool:
    """Does a name leave its folder, or is it none, on any system?"""
    parts = name.rstrip("/").split("/")
    return any(sign in name for sign in "\\:\0") or bool({"", ".", ".."} & set(parts))


def _refuse_name(path: Path, name: str) -> None:
    """Refuse a name that leaves the folder on any system."""
    if _leaves(name):
        what = "a name in it leads out of its folder, or is none"
        raise InputError(what, file=path, record=name[:200], cure=_CURE)


def _read(archive: zipfile.ZipFile, member: str, path: Path) -> bytes | None:
    """A list of the bag."""
    info = archive.NameToInfo.get(member)
    if info is None:
        return None
    if info.file_size > _LIST:
        raise InputError("a list in it is too large", file=path, record=member, cure=_CURE)
    try:
        return archive.read(member)
    except (zipfile.BadZipFile, OSError, EOFError, ValueError, NotImplementedError) as error:
        raise InputError(
            f"it is damaged ({error})", file=path, record=member, cure=_CURE
        ) from error


def _listed(path: Path, archive: zipfile.ZipFile, member: str) -> dict[str, str]:
    """Digests of a list, by name."""
    text = _read(archive, member, path)
    if text is None:
        what = f"this is no sealed job: there is no {member.partition('/')[2]} in it"
        raise InputError(what, file=path, cure=_CURE)
    found: dict[str, str] = {}
    for number, line in enumerate(text.decode("utf-8", "replace").splitlines(), 1):
        row = _LINE.fullmatch(line)
        if row is None:
            raise InputError(
                f"line {number} of its {member.partition('/')[2]} is none of a list of digests",
                file=path,
                cure=_CURE,
            )
        found[_plain(row[2])] = row[1].lower()
    return found
