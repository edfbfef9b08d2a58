"""The version of the code that makes a result: a digest of its source.

The version of some modules is a digest of their own source, of the source of all modules of this
package that they import, directly and through others, and of the versions of the libraries that
all of these import. It is taken from the text, before anything is imported:

* imports inside functions count; those under ``if TYPE_CHECKING`` do nothing and do not;
* ``import_module`` with a name that is put together stands for all modules of that package;
* comments count like everything else: no rule says which text of a module matters;
* of a library (numpy, numba, laspy, pye57, pyproj ...) the version counts, not its source, and the
  grids that somebody has installed for PROJ do not.

Where the package has been installed without its source, its version stands for all of that.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

_PACKAGE = "tribrach"

#: the folder of the package
_ROOT = Path(__file__).resolve().parent

_UNUSED = re.compile(r"^if TYPE_CHECKING:\n(?:(?:[ \t]+.*)?\n)+", re.MULTILINE)
_FROM = re.compile(r"^[ \t]*from ([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*import ([^\n#]+)", re.MULTILINE)
_NAMED = re.compile(r'import_module\(\s*"([\w.]+)"')
_COMPUTED = re.compile(rf'import_module\(\s*f"({_PACKAGE}(?:\.\w+)*)\.\{{')

#: libraries whose distribution has another name
_DISTRIBUTIONS = {"PIL": "pillow"}


@dataclass(frozen=True)
class _Module:
    """Digest of a module's source, and the modules and libraries that it imports."""

    source: str
    modules: frozenset[str]
    libraries: frozenset[str]


def code_version(modules: Iterable[str]) -> str:
    """Digest of the sources and libraries that some modules of this package use."""
    return _version(frozenset(modules))


def reachable(modules: Iterable[str]) -> frozenset[str]:
    """Follow the imports of some modules; the modules of this package, they themselves included."""
    waiting, seen = [name for name in modules if _module(name) is not None], set[str]()
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            module = _module(name)
            waiting += module.modules if module is not None else ()
    return frozenset(seen)


@cache
def _version(modules: frozenset[str]) -> str:
    state = hashlib.blake2b(digest_size=20)
    if not (_ROOT / "__init__.py").is_file():
        state.update(f"{_PACKAGE} {metadata.version(_PACKAGE)}".encode())
        return state.hexdigest()
    libraries = set[str]()
    for name in sorted(reachable(modules)):
        module = _module(name)
        if module is not None:
            state.update(f"{name} {module.source}\n".encode())
            libraries |= module.libraries
    for name in sorted(libraries):
        state.update(f"{name} {_library(name)}\n".encode())
    return state.hexdigest()


@cache
def _module(name: str) -> _Module | None:
    """A module of this package; None if there is none of this name."""
    file = _file(name)
    if file is None:
        return None
    text = source_text(file)
    used = _UNUSED.sub("", text)
    modules, libraries = set[str](), set[str]()
    for origin, names in _FROM.findall(used):
        _sort(origin, re.findall(r"\w+", names), modules, libraries)
    for names in _IMPORT.findall(used):
        for one in names.split(","):
            _sort(one.split()[0], (), modules, libraries)
    for origin in _NAMED.findall(used):
        _sort(origin, (), modules, libraries)
    for package in _COMPUTED.findall(used):
        modules |= {name for name in _files() if name.rpartition(".")[0] == package}
    digest = hashlib.blake2b(text.encode(), digest_size=20).hexdigest()
    return _Module(digest, frozenset(modules), frozenset(libraries))


def _sort(origin: str, names: Iterable[str], modules: set[str], libraries: set[str]) -> None:
    """Add what an import statement names to the modules of this package or to the libraries."""
    first = origin.partition(".")[0]
    if first != _PACKAGE:
        if first not in sys.stdlib_module_names:
            libraries.add(first)
        return
    modules |= {one for one in (origin, *(f"{origin}.{n}" for n in names)) if _file(one)}


def _file(name: str) -> Path | None:
    """The source of a module of this package; None if there is none of this name."""
    return _files().get(name)


@cache
def _files() -> dict[str, Path]:
    """The sources of all modules of this package by their names, without the package itself."""
    out = {}
    for folder, _, names in os.walk(_ROOT):
        place = Path(folder)
        package = ".".join((_PACKAGE, *place.relative_to(_ROOT).parts))
        for name in names:
            stem, suffix = os.path.splitext(name)
            if suffix == ".py" and (stem != "__init__" or place != _ROOT):
                out[package if stem == "__init__" else f"{package}.{stem}"] = place / name
    return out


def source_text(file: Path) -> str:
    """Read the source of a module."""
    return file.read_text(encoding="utf-8")


@cache
def _library(name: str) -> str:
    """The version of an installed library; "none" where an optional one is absent."""
    try:
        installed = metadata.distribution(_DISTRIBUTIONS.get(name, name))
    except metadata.PackageNotFoundError:
        return "none"
    # without reading the long description, which takes most of the time
    line = re.search(r"^Version: *(.*)$", installed.read_text("METADATA") or "", re.MULTILINE)
    return line[1] if line else installed.version
