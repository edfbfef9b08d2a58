"""Reads a result of an adjustment, ``result.json``, as this or an earlier run wrote it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.io.json_file import read_json

#: name in a folder of results
RESULT = "result.json"
#: layouts that are read
_SCHEMAS = (2,)
_CURE = "give the folder of results of a run, or its result.json"


def result_path(given: Path) -> Path:
    """The result that is meant by a file, a folder of results, or the folder of a project."""
    if not given.is_dir():
        return given
    for path in (given / RESULT, given / "out" / RESULT):
        if path.is_file():
            return path
    return given / RESULT


def read_result_file(path: Path) -> dict[str, Any]:
    """The keys of a result."""
    if not path.is_file():
        # the folder of a project is given for that of its results
        below = path.parent / "out" / RESULT
        cure = f"give {below.parent}" if below.is_file() else _CURE
        raise InputError("there is no result here", file=path, cure=cure)
    try:
        data = read_json(path)
    except ValueError as error:
        raise InputError(f"this is no result ({error})", file=path, cure=_CURE) from error
    if not isinstance(data, dict) or "observations" not in data or "points" not in data:
        raise InputError("this is no result of an adjustment", file=path, cure=_CURE)
    if data.get("schema") not in _SCHEMAS:
        raise InputError(
            f"this result has the layout {data.get('schema')}, which this version does not know",
            file=path,
            cure="take the version of the program that wrote it, or run the project again",
        )
    return data
