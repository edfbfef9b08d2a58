"""Takes values apart into what JSON can hold and puts them together again, bit for bit.

Values are dataclasses, enums, arrays of numbers, bytes, plain numbers, texts and sentences with
their figures, and tuples, lists and mappings of them. Their type hints say what to put together, so
no class says itself how it is written. What a file holds is not to be trusted: whatever does not
fit its hint is refused.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.sentences import Sentence

#: an array of more bytes is none of ours
_MOST_BYTES = 80_000_000
#: kinds of arrays: truth values, whole numbers with and without sign, floating numbers
_KINDS = "biuf"
#: what is raised where data are not of a form
_MISFITS = (ValueError, TypeError, LookupError, AttributeError, OverflowError)
#: what Python makes of JSON; a number without a point may stand for a floating one
_LEAVES: dict[Any, tuple[type, ...]] = {
    NoneType: (NoneType,),
    bool: (bool,),
    int: (int,),
    float: (float, int),
    str: (str,),
}


def settled(value: Any) -> Any:
    """The same value as it is put together again: numbers are Python's, arrays in the order of C.

    Products of matrices differ in their last digits by the order of their arrays in memory. What is
    handed on must not differ from what the next run reads. Nor does it hold on to the arrays that
    its own are parts of.
    """
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return np.array(value, order="C")
    if isinstance(value, Sentence):
        return Sentence.of(value.template, {key: _figure(of) for key, of in value.values.items()})
    if isinstance(value, list | tuple):
        return type(value)(settled(item) for item in value)
    if isinstance(value, Mapping):
        return {settled(key): settled(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{f.name: settled(getattr(value, f.name)) for f in fields(value)})
    return value


def taken_apart(value: Any) -> Any:
    """Take a settled value apart."""
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, Sentence):
        figures = {name: taken_apart(figure) for name, figure in value.values.items()}
        return {"template": value.template, "values": figures}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, bytes):
        return base64.b64encode(value).decode("ascii")
    if isinstance(value, np.ndarray) and value.dtype.kind in _KINDS:
        little = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        packed = taken_apart(zlib.compress(little.tobytes(), 1))
        return {"type": little.dtype.str, "shape": list(value.shape), "packed": packed}
    if isinstance(value, list | tuple):
        return [taken_apart(item) for item in value]
    if isinstance(value, Mapping):
        # pairs, so that keys may be numbers and keep their order
        return [[taken_apart(key), taken_apart(item)] for key, item in value.items()]
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: taken_apart(getattr(value, f.name)) for f in fields(value)}
    raise TypeError(f"a {type(value).__qualname__} cannot be taken apart: {value!r:.80}")


def put_together(form: Any, data: Any) -> Any:
    """Put a value together again."""
    try:
        return _made_of(form, data)
    except (*_MISFITS, InputError, zlib.error) as error:
        raise ValueError(f"this is no {form}") from error


def _made_of(form: Any, data: Any) -> Any:
    kind, of = get_origin(form) or form, get_args(form)
    if kind in (str, Sentence) and isinstance(data, dict):
        return Sentence.of(data["template"], {k: _said(v) for k, v in data["values"].items()})
    if kind in _LEAVES:
        return _known(data, isinstance(data, _LEAVES[kind]))
    if kind in (Union, UnionType):
        return _first_that_fits(of, data)
    if kind is Literal:
        return _known(data, data in of)
    if kind is np.ndarray:
        return _array(data)
    if kind is bytes:
        return base64.b64decode(data, validate=True)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = _hints(kind)
        _known(data, isinstance(data, dict) and data.keys() == hints.keys())
        return kind(**{name: _made_of(hint, data[name]) for name, hint in hints.items()})
    if issubclass(kind, Enum):
        return kind[data]
    _known(data, isinstance(data, list))
    if kind is tuple and of[1:] != (...,):
        return tuple(_made_of(one, item) for one, item in zip(of, data, strict=True))
    if kind in (tuple, list):
        return kind(_made_of(of[0], item) for item in data)
    if issubclass(kind, Mapping):
        return {_made_of(of[0], key): _made_of(of[1], item) for key, item in data}
    raise TypeError(f"{form} cannot be put together")


def _figure(value: Any) -> Any:
    """A figure of a stored sentence; text stands for infinity and NaN."""
    value = settled(value)
    return value if _is_figure(value) else str(value)


def _said(data: Any) -> Any:
    """What a field of a sentence has, of its data."""
    return _made_of(str, data) if isinstance(data, dict) else _known(data, _is_figure(data))


def _is_figure(value: Any) -> bool:
    return isinstance(value, str | int | float)


@cache
def _hints(form: type[Any]) -> dict[str, Any]:
    """The types of the fields of a dataclass."""
    hints = get_type_hints(form)
    return {field.name: hints[field.name] for field in fields(form)}


def _known(data: Any, fits: bool) -> Any:
    """Data that fit."""
    if not fits:
        raise ValueError(f"{data!r:.80} is not what it should be")
    return data


def _first_that_fits(forms: tuple[Any, ...], data: Any) -> Any:
    """A value of the first of several types that the data are of."""
    for form in forms:
        try:
            return put_together(form, data)
        except ValueError:
            continue
    return _known(data, False)


def _array(data: Mapping[str, Any]) -> NDArray[Any]:
    """A packed array; memory is taken for what its shape can hold, not for what its bytes say."""
    form, shape = np.dtype(data["type"]), tuple(int(n) for n in data["shape"])
    size = int(np.prod(shape, dtype=object)) * form.itemsize
    _known(form, form.kind in _KINDS and min(shape, default=0) >= 0 and size <= _MOST_BYTES)
    packed = base64.b64decode(data["packed"], validate=True)
    unpacked = zlib.decompressobj().decompress(packed, size + 1)
    return np.frombuffer(unpacked, form).reshape(shape).copy()
