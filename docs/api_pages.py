"""Pages of the API reference, made when the site is built: one for each room of ``src/tribrach``.

A room is a package. Its page holds the modules in it that have public names; rooms within a room
have pages of their own beneath it. No module is listed here, so one that moves is followed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import get_plugin_logger
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "tribrach"
#: rooms that are used by commands and not by names to import
PROGRAMS = {"cli"}
#: whatever a page would load from the network; the site is read where there is none
FOREIGN = re.compile(r"<(?:script|img|iframe|link)\b[^>]*\b(?:src|href)=[\"'](?:https?:)?//[^>]*")

log = get_plugin_logger("api")


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the pages of all rooms, and a section of the contents that lists them."""
    assert config.nav is not None
    pages = {page_name(room): page_text(room) for room in rooms(PACKAGE)}
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    config.nav.append({"API": contents(PACKAGE)})
    return files


def on_post_page(output: str, *, page: Page, config: MkDocsConfig) -> str:
    """Warn of pages that load anything from the network."""
    for element in FOREIGN.findall(output):
        log.warning("%s loads from the network: %s", page.file.src_uri, element)
    return output


def rooms(room: Path) -> Iterator[Path]:
    """A package and all packages in it that hold public names, from the outside in."""
    if any(public_names(path) for path in room.rglob("*.py")):
        yield room
        for inner in sorted(room.iterdir()):
            if (inner / "__init__.py").is_file() and inner.name not in PROGRAMS:
                yield from rooms(inner)


def contents(room: Path) -> list[Any]:
    """Entries of the contents: the page of a room, then the rooms in it."""
    entries: list[Any] = [{dotted(room): page_name(room)}]
    for inner in rooms(room):
        if inner.parent == room:
            below = contents(inner)
            entries.append(
                {inner.name: below} if len(below) > 1 else {inner.name: page_name(inner)}
            )
    return entries


def page_name(room: Path) -> str:
    """Where the page of a room lies among the sources of the site."""
    return "/".join(("api", *room.relative_to(PACKAGE.parent).parts)) + ".md"


def page_text(room: Path) -> str:
    """Markdown of the page of a room: what it is for, names it passes on, its modules."""
    summary = (ast.get_docstring(tree(room / "__init__.py")) or "").split("\n\n")[0]
    parts = [f"# {dotted(room)}", summary, passed_on(room)]
    for path in sorted(room.glob("*.py")):
        own = public_names(path)
        if path.name == "__init__.py":
            parts += [f"::: {dotted(room)}.{name}" for name in own]
        elif own:
            parts.append(f"::: {dotted(path)}")
    return "\n\n".join(part for part in parts if part) + "\n"


def passed_on(room: Path) -> str:
    """Links to names of other modules that a package offers as its own."""
    names = listed_names(room / "__init__.py")
    homes = {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in ast.walk(tree(room / "__init__.py"))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    lines = [f"* `{dotted(room)}.{n}`: [{homes[n]}][]" for n in names if n in homes]
    return "\n".join(lines)


@cache
def public_names(path: Path) -> list[str]:
    """Names that a module defines and offers: its ``__all__``, or those without underscore."""
    if path.stem.startswith("_") and path.stem != "__init__":
        return []
    own = {
        name
        for node in tree(path).body
        for name in (
            [getattr(node, "name", "")]
            + [getattr(target, "id", "") for target in getattr(node, "targets", [])]
            + [getattr(getattr(node, "target", None), "id", "")]
        )
    }
    listed = listed_names(path)
    if listed or path.stem == "__init__":
        return [name for name in listed if name in own]
    return sorted(
        node.name
        for node in tree(path).body
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_")
    )


@cache
def listed_names(path: Path) -> list[str]:
    """What stands in ``__all__``; nothing if a module has none."""
    for node in tree(path).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__":
            return [str(name) for name in ast.literal_eval(node.value)]
    return []


def dotted(path: Path) -> str:
    """The name by which a module or package is imported."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)


def tree(path: Path) -> ast.Module:
    """Syntax of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))
