"""The one place where JSON is written that is no document of a form.

JSON has no word for NaN and infinities; Python writes them all the same, and half of all readers
then refuse the whole file. Here what is no number is null, as in the documents, or, in what the
program keeps for itself, a word that it reads back.
"""

from __future__ import annotations

import json
import math
from typing import Any

#: the only key of an object that stands for a number without a word in JSON
_WORD = "not_finite"


def json_text(
    data: Any, *, indent: int | None = None, sort_keys: bool = False, restorable: bool = False
) -> str:
    """Data as JSON that every reader takes."""
    layout: dict[str, Any] = {"indent": indent, "sort_keys": sort_keys, "allow_nan": False}
    try:
        return json.dumps(data, **layout)
    except ValueError:
        return json.dumps(_written(data, restorable), **layout)


def restored(read: dict[str, Any]) -> Any:
    """What an object of a restorable text stands for; an ``object_hook`` of :func:`json.loads`."""
    if read.keys() != {_WORD}:
        return read
    return float(str(read[_WORD]))


def _written(data: Any, restorable: bool) -> Any:
    """The same with another word for every number that is not finite."""
    if isinstance(data, dict):
        return {key: _written(value, restorable) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_written(value, restorable) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return {_WORD: repr(float(data))} if restorable else None
    return data
