"""Small TOML files of ours: texts in them, and models whose complaints become sentences."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.xml_file import read_bytes
from tribrach.units import LARGEST

#: a comment, behind texts that may hold its sign
_COMMENT = re.compile(r"""(?:[^"'#]|"(?:\\.|[^"\\])*"|'[^']*')*(#.*)$""")
#: what earlier files began with
_HEADS = frozenset(
    {"# Decisions by hand; run and adjust obey them. Comments are not kept by the workbench."}
)

Model = TypeVar("Model", bound=BaseModel)


def read_model(path: Path, model: type[Model], cure: str) -> Model:
    """A file as an instance of a model."""
    try:
        document = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
        _check_numbers(path, document, ())
        return model.model_validate(document)
    except UnicodeDecodeError as error:
        raise InputError(
            "the file is not UTF-8 text", file=path, cure="save it as UTF-8"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"this is not TOML: {error}", file=path) from error
    except ValidationError as error:
        refused = RefusalCollector()
        for detail in error.errors():
            key = ".".join(str(part) for part in detail["loc"])
            words = f"{key}: {detail['msg'][:1].lower()}{detail['msg'][1:]}"
            refused.add(InputError(words, file=path, cure=cure))
        raise refused.error() from error


def read_text(path: Path) -> str:
    """The text of a file that was read as TOML."""
    return read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")


def with_comments(head: str, tables: Sequence[str], old: str) -> str:
    """A file of tables that keeps comments, and the words of tables that stay, of an older text.

    ``tables``: tables, in order, as they would be written without the older text. Returns the head,
    further comments that belong to no table that stays, and the tables, those that stay with what
    stood above and in them.
    """
    kept: dict[str, list[str]] = {}
    for block in _blocks(old):
        with suppress(tomllib.TOMLDecodeError):
            kept.setdefault(repr(tomllib.loads(block)), []).append(block.strip("\n") + "\n")
    blocks = []
    for table in tables:
        same = kept.get(repr(tomllib.loads(table)))
        blocks.append(same.pop(0) if same else table)
    body = "\n".join(blocks)
    there = {*_comments(head), *_comments(body)}
    others = [c for c in dict.fromkeys(_comments(old)) if c not in there and c not in _HEADS]
    return "\n".join(
        [head, *([*others, ""] if others else []), body] if blocks or others else [head]
    )


def _blocks(text: str) -> list[str]:
    """Tables of a text, each with the comments right above it."""
    starts, above = [], None
    lines = text.splitlines(keepends=True)
    for number, line in enumerate(lines):
        if line.startswith("[["):
            starts.append(number if above is None else above)
        above = (number if above is None else above) if line.startswith("#") else None
    ends = [*starts[1:], len(lines)]
    if not starts:
        return []
    return ["".join(lines[a:b]) for a, b in zip(starts, ends, strict=True)]


def _comments(text: str) -> list[str]:
    """Comments of a text, in order."""
    return [found[1].rstrip() for found in map(_COMMENT.match, text.splitlines()) if found]


def quoted(text: str) -> str:
    """A text as a basic string of TOML, whatever is in it."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    safe = "".join(ch if ch.isprintable() else f"\\U{ord(ch):08x}" for ch in plain)
    return f'"{safe}"'


def _check_numbers(path: Path, value: Any, keys: tuple[str, ...]) -> None:
    """Refuse numbers of a document that are beyond any measurement, or none: true and false."""
    if isinstance(value, dict):
        for key, one in value.items():
            _check_numbers(path, one, (*keys, key))
    elif isinstance(value, list):
        for one in value:
            _check_numbers(path, one, keys)
    elif isinstance(value, bool):
        raise InputError(
            f"{'.'.join(keys)} is true or false, and no key of such a file is", file=path
        )
    elif isinstance(value, int | float) and not abs(value) < LARGEST:
        raise InputError(f"{'.'.join(keys)} is beyond any measurement", file=path)
