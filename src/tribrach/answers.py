"""The one form of an answer: a result class is what is computed, written as JSON, and read again.

A result is a dataclass on the base :class:`Result`, which is written with its fields and the
properties that it names. A table is one on the base :class:`Table`: its fields are columns, and it
is written as a list of objects. NaN and infinities are null; a name that is a word of Python has an
underscore behind it (``from_``), and its key has none. :class:`Form` is the whole document.

pydantic makes the JSON, its schema, and the way back; it is loaded when the first of them is asked
for.
"""

from __future__ import annotations

import inspect
import math
import re
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping, Sized
from dataclasses import MISSING, dataclass, fields, is_dataclass
from datetime import UTC, datetime
from functools import cache, cached_property
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pydantic import TypeAdapter


def _null(value: Any) -> Any:
    """A number as JSON has it; minus zero loses its sign."""
    value = float(value)
    return value + 0.0 if math.isfinite(value) else None


class _Number:
    """Marks a float that may be NaN or infinite, which is null."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema as cs

        number = cs.nullable_schema(cs.float_schema())
        return cs.no_info_after_validator_function(
            lambda value: math.nan if value is None else value,
            number,
            serialization=cs.plain_serializer_function_ser_schema(_null, return_schema=number),
        )


@dataclass(frozen=True)
class _Nested:
    """Marks an array of numbers with so many axes; of columns the first counts the rows."""

    axes: int

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema as cs

        out: Any = cs.nullable_schema(cs.float_schema())
        for _ in range(self.axes):
            out = cs.list_schema(out)
        return cs.no_info_after_validator_function(
            lambda value: np.array(value, dtype=np.float64),
            out,
            serialization=cs.plain_serializer_function_ser_schema(_lists, return_schema=out),
        )


@dataclass(frozen=True)
class Written:
    """Marks a number that JSON has as text, for times and dates."""

    write: Callable[[float], str]
    #: back to the number; None for what is not read again
    read: Callable[[str], float] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema as cs

        text = cs.str_schema()
        out = cs.plain_serializer_function_ser_schema(self.write, return_schema=text)
        if self.read is None:
            return cs.any_schema(serialization=out)
        return cs.no_info_after_validator_function(self.read, text, serialization=out)


def stamp(seconds: float) -> str:
    """A time for files, given in seconds since 1970: ISO 8601 in UTC."""
    # times that were kept in days lack a rounding error to the full minute
    at = datetime.fromtimestamp(round(seconds, 3), UTC)
    return at.isoformat(timespec="seconds").replace("+00:00", "Z")


def _lists(values: Any) -> Any:
    """Nested lists of numbers, None for what is none."""
    values = np.asarray(values, dtype=np.float64)
    if np.isfinite(values).all():
        return (values + 0.0).tolist()
    return np.where(np.isfinite(values), values + 0.0, np.array(None)).tolist()


#: a number that may be missing: NaN inside, null in JSON
Number = Annotated[float, _Number()]
#: numbers along one axis
Vector = Annotated[NDArray[np.float64], _Nested(1)]
#: numbers along two axes
Matrix = Annotated[NDArray[np.float64], _Nested(2)]
#: numbers along three axes
Matrices = Annotated[NDArray[np.float64], _Nested(3)]

#: a time: seconds since 1970 inside, ISO 8601 in UTC in JSON
Instant = Annotated[float, Written(stamp, lambda text: datetime.fromisoformat(text).timestamp())]

#: set while published schemas are made: what stands at the fields is read from their source
_describing = False


class Result:
    """Base of a dataclass that is written as an object: its fields, and properties by name.

    Parameters of a subclass
    ------------------------
    also : tuple of str
        Properties that are written behind the fields.
    without : tuple of str
        Fields that are not written: what was computed with, not what was found.
    maybe : tuple of str
        Names that are left out where nothing is known: None, an empty text, nothing in it.
    null : tuple of str
        Texts that are null where they are empty.
    keys : mapping, optional
        Keys of names that are written otherwise.
    """

    _also: ClassVar[tuple[str, ...]] = ()
    _without: ClassVar[tuple[str, ...]] = ()
    _maybe: ClassVar[tuple[str, ...]] = ()
    _null: ClassVar[tuple[str, ...]] = ()
    _keys: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(
        cls,
        *,
        also: tuple[str, ...] = (),
        without: tuple[str, ...] = (),
        maybe: tuple[str, ...] = (),
        null: tuple[str, ...] = (),
        keys: Mapping[str, str] | None = None,
        **more: Any,
    ) -> None:
        super().__init_subclass__(**more)
        cls._also, cls._without = (*cls._also, *also), (*cls._without, *without)
        cls._maybe, cls._null = (*cls._maybe, *maybe), (*cls._null, *null)
        cls._keys = {**cls._keys, **(keys or {})}

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema as cs

        hints, notes, keys = _hints(cls), _notes(cls), written(cls)
        own: Any = cls
        ready = {f.name for f in fields(own) if f.default_factory is not MISSING}
        ready |= {f.name for f in fields(own) if f.default is not MISSING}
        kinds = {
            name: _found(handler.generate_schema(hints[name]), name in cls._also) for name in keys
        }
        kinds |= {name: cs.nullable_schema(kinds[name]) for name in cls._null}

        def parts(may_lack: set[str]) -> dict[str, Any]:
            return {
                keys[name]: cs.typed_dict_field(
                    kind, required=name not in may_lack, metadata=_described(notes.get(name))
                )
                for name, kind in kinds.items()
            }

        built = {f.name: keys[f.name] for f in fields(own) if f.init and f.name in keys}

        def made(data: Any, inside: Any) -> Any:
            if isinstance(data, cls):
                return data
            known = inside(data)
            return cls(**{name: known[key] for name, key in built.items() if key in known})

        # what has a default may lack in what is read, and is always written
        whole = _object(cls, parts({*cls._maybe}))
        return cs.no_info_wrap_validator_function(
            made,
            _object(cls, parts(ready | {*cls._maybe})),
            serialization=cs.plain_serializer_function_ser_schema(
                lambda one: {key: _plain(value) for key, value in items_of(one).items()},
                return_schema=whole,
            ),
        )


def part(path: str, kind: Any, words: str) -> Any:
    """A property that is an attribute of a field: ``part("fitted.spread", Number, "...")``.

    It is None where something on the way is.
    """
    names = path.split(".")

    def get(self: Any) -> Any:
        for name in names:
            self = None if self is None else getattr(self, name)
        return self

    get.__annotations__["return"], get.__doc__ = kind, words
    return property(get)


def _found(schema: Any, computed: bool) -> Any:
    """The schema of a key; what is computed is written and, where it is read, not looked at."""
    from pydantic_core import core_schema as cs

    if not computed:
        return schema
    written = cs.plain_serializer_function_ser_schema(lambda value: value, return_schema=schema)
    return cs.any_schema(serialization=written)


class Table:
    """Columns of one length, a list of objects in JSON; first axes and tuples are the rows."""

    def __len__(self) -> int:
        own: Any = self
        return len(getattr(self, fields(own)[0].name))

    def each(self, order: Iterable[int] | None = None) -> list[Any]:
        """The rows, all or some in an order, each with the names of the columns."""
        own: Any = self
        columns = {f.name: getattr(self, f.name) for f in fields(own)}
        row = namedtuple(type(self).__name__, columns)  # type: ignore[misc]
        chosen = range(len(self)) if order is None else order
        return [row(*(column[k] for column in columns.values())) for k in chosen]

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema as cs

        hints, notes = _hints(cls), _notes(cls)
        own: Any = cls
        parts = {
            _key(f.name): cs.typed_dict_field(
                _item(hints[f.name], handler), metadata=_described(notes.get(f.name))
            )
            for f in fields(own)
        }
        whole = cs.list_schema(_object(cls, parts))
        return cs.no_info_after_validator_function(
            lambda data: _columns(cls, hints, data),
            whole,
            serialization=cs.plain_serializer_function_ser_schema(_objects, return_schema=whole),
        )


def _object(cls: type, parts: dict[str, Any]) -> Any:
    """The schema of an object with these keys and no others."""
    from pydantic_core import core_schema as cs

    said = _described(_first_line(cls), cls.__name__)
    return cs.typed_dict_schema(parts, extra_behavior="forbid", metadata=said)


def _objects(table: Any) -> list[dict[str, Any]]:
    """The rows of a table as dictionaries."""
    columns = {}
    for field in fields(table):
        value = getattr(table, field.name)
        is_number = isinstance(value, np.ndarray) and value.dtype.kind == "f"
        columns[_key(field.name)] = _lists(value) if is_number else _plain(value)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _columns(cls: type, hints: Mapping[str, Any], data: list[dict[str, Any]]) -> Any:
    """A table of its rows."""
    out: dict[str, Any] = {}
    for field in fields(cls):
        values = [row[_key(field.name)] for row in data]
        nested = _nested(hints[field.name])
        out[field.name] = tuple(values) if nested is None else np.array(values, dtype=np.float64)
    return cls(**out)


def _nested(hint: Any) -> _Nested | None:
    """The mark of an array of numbers."""
    marks = getattr(hint, "__metadata__", ())
    return next((mark for mark in marks if isinstance(mark, _Nested)), None)


def _item(hint: Any, handler: Any) -> Any:
    """JSON Schema of one cell of a column."""
    from pydantic_core import core_schema as cs

    nested = _nested(hint)
    if nested is None:
        return handler.generate_schema(hint.__args__[0])
    out: Any = cs.nullable_schema(cs.float_schema())
    for _ in range(nested.axes - 1):
        out = cs.list_schema(out)
    return out


def _plain(value: Any) -> Any:
    """A value without types of numpy that JSON does not have."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray) and value.dtype.kind in "ibUO":
        return value.tolist()
    return value


def plain(value: Any) -> Any:
    """A value as JSON has it: dictionaries, lists, texts, finite numbers and None.

    It needs no schema, which takes longer to make than a small document.
    """
    if isinstance(value, Result):
        return {key: plain(item) for key, item in items_of(value).items()}
    if isinstance(value, float):
        return _null(value)
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        return _lists(value)
    if isinstance(value, Table):
        return plain(_objects(value))
    if hasattr(value, "model_dump"):
        return value.model_dump(mode="json", by_alias=True, exclude_unset=True)
    if isinstance(value, Iterable) and not isinstance(value, np.ndarray):
        return [plain(item) for item in value]
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def written(cls: Any) -> dict[str, str]:
    """Function that writes results of a class: keys are names of fields and properties."""
    return _written(cls)


@cache
def _written(cls: Any) -> dict[str, str]:
    names = (*(f.name for f in fields(cls) if f.name not in cls._without), *cls._also)
    return {name: cls._keys.get(name, _key(name)) for name in names}


def items_of(result: Result) -> dict[str, Any]:
    """Keys and unconverted values of a result."""
    cls = type(result)
    out = {key: getattr(result, name) for name, key in written(cls).items()}
    return _shortened(cls, out) if cls._maybe or cls._null else out


def rows_of(cls: type[Result], columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Several results as JSON objects."""
    chosen = {key: columns[name] for name, key in written(cls).items()}
    lists = [_lists(v) if v.dtype.kind == "f" else v.tolist() for v in chosen.values()]
    return [
        _shortened(cls, dict(zip(chosen, row, strict=True))) for row in zip(*lists, strict=True)
    ]


def _shortened(cls: type[Result], out: dict[str, Any]) -> dict[str, Any]:
    """The same without keys of which nothing is known, and with null for empty texts."""
    keys = written(cls)
    for name in cls._null:
        out[keys[name]] = out[keys[name]] or None
    for name in cls._maybe:
        if _nothing(out[keys[name]]):
            del out[keys[name]]
    return out


def _nothing(value: Any) -> bool:
    """True for None and what is empty."""
    return value is None or (isinstance(value, Sized) and not len(value))


def _key(name: str) -> str:
    """The key of a name in JSON."""
    return name.removesuffix("_")


def _hints(cls: type) -> dict[str, Any]:
    """Types of the fields and of the properties of a class."""
    hints = get_type_hints(cls, include_extras=True)
    for name, found in inspect.getmembers(cls):
        getter = getattr(found, "fget", None) or getattr(found, "func", None)
        if getter is not None and "return" in getattr(getter, "__annotations__", {}):
            hints[name] = get_type_hints(getter, include_extras=True)["return"]
    return hints


def _described(words: str | None, title: str = "") -> dict[str, Any]:
    """What a schema says of one of its parts."""
    said = {"description": words} if words else {}
    if title:
        said["title"] = title
    return {"pydantic_js_updates": said} if said else {}


def _first_line(cls: type) -> str:
    """What a class is, in one line."""
    return (inspect.getdoc(cls) or "").split("\n")[0]


def _notes(cls: type) -> dict[str, str]:
    """What stands at the fields of a class (``#: ...``) and first in its properties."""
    if not _describing:
        return {}
    out: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        if not is_dataclass(base):
            continue
        above: list[str] = []
        for line in _source(base):
            stripped = line.strip()
            if stripped.startswith("#:"):
                above.append(stripped[2:].strip())
                continue
            found = re.match(r"    (\w+)\s*:(?!:)[^#]*(?:#: (.*))?$", line)
            words = " ".join([*above, *([found[2]] if found and found[2] else [])])
            if found and words:
                out[found[1]] = words
            above = []
    for name, found in inspect.getmembers(cls):
        if isinstance(found, property | cached_property) and found.__doc__:
            out.setdefault(name, found.__doc__.split("\n")[0])
    return out


def _source(cls: type) -> list[str]:
    """The lines of a class; none of one that was made."""
    try:
        return inspect.getsource(cls).splitlines()
    except OSError:
        return []


class described:  # noqa: N801
    """A block in which schemas are made with what stands at the fields."""

    def __enter__(self) -> None:
        global _describing
        _describing = True

    def __exit__(self, *error: object) -> None:
        global _describing
        _describing = False


@dataclass(frozen=True)
class Estimate(Result):
    """A value and its standard deviation."""

    value: Number
    sigma: Number

    @property
    def t(self) -> float:
        """Value over sigma."""
        return self.value / self.sigma


@dataclass(frozen=True)
class PoseEstimate(Result):
    """A pose, 4 x 4, with its covariance 6 x 6 of left increments."""

    world_from_scanner: Matrix
    covariance: Matrix


@dataclass(frozen=True)
class Test(Result, also=("passed",)):
    """A sum of weighted squares against its chi-square limit."""

    statistic: Number
    dof: int
    limit: Number
    p: Number  #: probability of as much by chance

    #: a class of the program, not of its tests
    __test__ = False

    @property
    def passed(self) -> bool:
        """True if it is within the limit."""
        return self.statistic <= self.limit


class Form:
    """The JSON document of a question: what stands first, its result, and words about it.

    ``schema`` is the version of the layout; it changes when a key or a meaning does. A ``quick``
    result of plain columns is written without making its schema. Words are types of keys that are
    no figures of the result, such as sentences, by key.
    """

    every: ClassVar[dict[str, Form]] = {}  #: all that were made, by name

    def __init__(
        self, name: str, result: type, schema: int, *, quick: bool = False, **words: Any
    ) -> None:
        self.quick = quick
        self.name, self.result, self.schema, self.words = name, result, schema, words
        self.every[name] = self

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        """What makes JSON of a result."""
        from pydantic import TypeAdapter

        return TypeAdapter(self.result)

    def data(self, result: Any, **words: Any) -> dict[str, Any]:
        """The document as Python has JSON."""
        head = {"tribrach": version("tribrach"), "schema": self.schema}
        own: dict[str, Any] = (
            plain(result) if self.quick else self.adapter.dump_python(result, mode="json")
        )
        return head | own | words

    def text(self, result: Any, **words: Any) -> str:
        """The document as text."""
        from pydantic_core import to_json

        return to_json(self.data(result, **words), indent=1).decode() + "\n"

    def read(self, data: Mapping[str, Any]) -> Any:
        """The result of a document."""
        skip = {"tribrach", "schema", *self.words}
        return self.adapter.validate_python({k: v for k, v in data.items() if k not in skip})

    def json_schema(self) -> dict[str, Any]:
        """The JSON Schema (draft 2020-12), with what stands at the fields."""
        from pydantic import TypeAdapter

        with described():
            own = TypeAdapter(self.result).json_schema(mode="serialization")
            more = {key: TypeAdapter(kind).json_schema() for key, kind in self.words.items()}
        said = {"tribrach": {"type": "string"}, "schema": {"type": "integer"}}
        return {
            **own,
            "properties": {**said, **own["properties"], **more},
            "required": ["tribrach", "schema", *own["required"], *more],
        }
