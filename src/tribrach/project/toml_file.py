"""Reading a project file so that whatever is wrong is said with its line.

``tomllib`` gives no lines of keys; they are found by walking the text along its table headers.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.opened_files import lines_of
from tribrach.io.xml_file import MAX_BYTES, read_bytes

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"""\s*("[^"]*"|'[^']*'|[\w.-]+(?:\s*\.\s*[\w-]+)*)\s*=""")

#: a number with a comma, and a word without quotation marks, as the value of a key
_COMMA = re.compile(r"=\s*([-+]?\d+),(\d+)\s*(?:#|$)")
_BARE = re.compile(r"\s*[\w.\"'-]+\s*=\s*(?!true\b|false\b|inf\b|nan\b)[A-Za-z]")
#: quotation marks of word processors
_TYPOGRAPHIC = "\u201c\u201d\u201e\u2018\u2019\u201a\u00ab\u00bb"
_NUL = re.compile(r"\\u0000|\\U00000000")


def load(path: Path, most: int = MAX_BYTES) -> tuple[dict[str, Any], str]:
    """Tables and text of a TOML file of at most so many bytes."""
    data = read_bytes(path, most)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "the file is not UTF-8 text",
            file=path,
            line=data[: error.start].count(b"\n") + 1,
            cure="save it as UTF-8",
        ) from error
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what = str(error)
        place = re.search(r"\(at line (\d+)", what)
        what = what.split(" (at ")[0]
        line = int(place.group(1)) if place else None
        row = lines_of(text)[line - 1 : line] if line else []
        raise InputError(
            f"this is not TOML: {what[:1].lower()}{what[1:]}",
            file=path,
            line=line,
            cure=_syntax_cure(what, "".join(row)),
        ) from error
    if _holds_nul(tables):
        # an escape is the only way to write it
        place = _NUL.search(text)
        line = None if place is None else text[: place.start()].count("\n") + 1
        raise InputError(
            "a text holds the character NUL, which no name has",
            file=path,
            line=line,
            cure="remove it",
        )
    return tables, text


def _syntax_cure(what: str, row: str) -> str | None:
    """What is to be written in a line that is not TOML, where it is one of the usual slips."""
    if "overwrite" in what or "declare" in what:
        return "a key is there twice, or [points] and [[points]] are mixed"
    if "\\" in row:
        return "write / in paths, or the path in single quotes"
    if comma := _COMMA.search(row):
        return f"write decimals with a point, {comma[1]}.{comma[2]}"
    if any(mark in row for mark in _TYPOGRAPHIC):
        return 'write plain quotation marks, "..."'
    if _BARE.match(row):
        return "put words into quotation marks"
    return None


def _holds_nul(value: Any) -> bool:
    """True if a text among nested tables holds the character NUL, keys included."""
    if isinstance(value, dict):
        return any(_holds_nul(item) for item in (*value, *value.values()))
    if isinstance(value, list):
        return any(_holds_nul(item) for item in value)
    return isinstance(value, str) and "\0" in value


def line_of(text: str, keys: Sequence[str | int]) -> int | None:
    """1-based line of a key, or of the innermost table around it that the text names."""
    wanted = [str(key) for key in keys]
    # a table alone where a list of tables is asked for has no number
    alone = [key for key in keys if not isinstance(key, int)]
    at: list[str] = []
    count: dict[str, int] = {}
    best, depth = None, 0
    for number, line in enumerate(lines_of(text), start=1):
        header, key = _HEADER.match(line), _KEY.match(line)
        if header:
            at = _parts(header.group(2))
            if header.group(1) == "[[":
                name = header.group(2)
                at.append(str(count.get(name, 0)))
                count[name] = count.get(name, 0) + 1
        here = at if header else [*at, *_parts(key.group(1))] if key else None
        if here and len(here) > depth and here in (wanted[: len(here)], alone[: len(here)]):
            best, depth = number, len(here)
    return best


def without(text: str, place: Sequence[str | int]) -> str:
    """A project file with blank lines in place of a key or a table, if ``place`` leads to one."""
    line = line_of(text, place)
    if line is None:
        return text
    lines = lines_of(text)
    header = _HEADER.match(lines[line - 1])
    if header is None:
        one = "\n".join(["" if k == line - 1 else row for k, row in enumerate(lines)])
        try:
            tomllib.loads(one)
        except tomllib.TOMLDecodeError:
            # the value goes over several lines: the table goes with it
            return without(text, place[:-1]) if len(place) > 1 else text
        return one
    own, end = _parts(header.group(2)), line
    while end < len(lines):
        other = _HEADER.match(lines[end])
        if other is not None:
            parts = _parts(other.group(2))
            if parts[: len(own)] != own or parts == own:
                break
        end += 1
    return "\n".join("" if line <= k + 1 <= end else row for k, row in enumerate(lines))


def _parts(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]


def refused(error: ValidationError, model: type[BaseModel], path: Path, text: str) -> InputError:
    """What a model refused, each in a sentence with its line, alternatives of a value only once."""
    refused = RefusalCollector()
    data = tomllib.loads(text)
    told = set()
    for detail in error.errors():
        place = [part for part in detail["loc"] if not str(part).startswith("function-")]
        value = typed(data, place)
        if detail["type"] == "missing" and len(value) == len(place) - 1:
            value = tuple(place)
        if value in told:
            continue
        told.add(value)
        if refused.full:
            refused.count += 1
            continue
        key = ".".join(str(part) for part in place if not isinstance(part, int))
        what, cure = _words(detail, model, key)
        refused.add(InputError(what, file=path, line=line_of(text, place), cure=cure))
    return refused.error()


def typed(data: Any, place: Sequence[int | str]) -> tuple[int | str, ...]:
    """The part of a place that leads to something in the file."""
    for depth, part in enumerate(place):
        if isinstance(part, int) and isinstance(data, dict):
            continue  # a table alone where a list of tables is asked for
        named = isinstance(data, dict) and part in data
        listed = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if not named and not listed:
            return tuple(place[:depth])
        data = data[part]
    return tuple(place)


def _words(detail: ErrorDetails, model: type[BaseModel], key: str) -> tuple[str, str | None]:
    """Fault of a key, and the cure."""
    if detail["type"] == "extra_forbidden":
        table, _, own = key.rpartition(".")
        near = difflib.get_close_matches(own, _known_keys(model), 1)
        if near == [own]:
            where = f"table [{table}]" if table else "top of the file, before any table,"
            return f"key {own} has no place in the {where}", "put it into the table that it is of"
        return f"key {key} is unknown", f"did you mean {near[0]}" if near else "remove it"
    if detail["type"] == "missing":
        return f"key {key} is missing", "add it"
    message = detail["msg"].removeprefix("Value error, ").removeprefix("Input ").rstrip(".")
    given = detail["input"]
    cure = None
    if detail["type"] == "literal_error" and isinstance(given, str):
        allowed = re.findall(r"'([^']*)'", message)
        near = difflib.get_close_matches(given.lower(), allowed, 1, cutoff=0.5)
        cure = f"did you mean {near[0]}" if near else None
    shown = f" is {given!r} and" if isinstance(given, str | int | float) else ":"
    if detail["type"] == "value_error":
        return f"{key}: {message}", None
    return f"{key}{shown} {message}", cure


@cache
def _known_keys(model: type[BaseModel]) -> list[str]:
    """All keys of a model, its parts included."""
    return _keys(model.model_json_schema())


def _keys(schema: Any) -> list[str]:
    """All keys that a schema names anywhere."""
    if isinstance(schema, list):
        return [key for value in schema for key in _keys(value)]
    if not isinstance(schema, dict):
        return []
    own = schema.get("properties")
    return [*(own if isinstance(own, dict) else ()), *_keys([*schema.values()])]
