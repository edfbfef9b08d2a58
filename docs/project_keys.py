"""Tables of ``docs/project_keys.md``: every key with type, unit, default and meaning.

All of it comes from the models that read project files: types and defaults from their fields,
meanings from the comments above them, units from the names of the keys.
"""

import inspect
import re
import types
import typing
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from tribrach.project import Project

#: units by the ends of keys, the longest first
UNITS = {
    "_mm_per_sqrt_km": "mm per √km", "_arcsec": "″", "_arcmin": "′", "_mrad": "mrad", "_ppm": "ppm",
    "_deg": "°", "_gon": "gon", "_mm": "mm", "_cm": "cm", "_km": "km", "_hours": "h", "_s": "s",
    "_days": "days", "_m": "m", "_mgal": "mGal", "_hpa": "hPa", "_percent": "%",
}  # fmt: skip


def unit(key: str) -> str:
    """The unit that a key names, in brackets."""
    for end, words in UNITS.items():
        if key.endswith(end) or f"{end}_" in key:
            return f" [{words}]"
    return ""


def kind(annotation: Any) -> str:
    """A type in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return ", ".join(f"`{value}`" if value else "nothing" for value in inner)
    if origin is typing.Annotated:
        return kind(inner[0])
    if origin in (typing.Union, types.UnionType):
        words = dict.fromkeys(kind(one) for one in inner if one is not type(None))
        return " or ".join(words)
    if origin in (tuple, list):
        if (len(inner) == 2 and inner[1] is Ellipsis) or origin is list:
            return f"list of {kind(inner[0])}"
        return f"{len(inner)} × {kind(inner[0])}" if inner else "list"
    if origin is dict:
        return f"table of {kind(inner[1])}"
    names = {str: "text", float: "number", int: "whole number", bool: "`true`, `false`"}
    if annotation in names:
        return names[annotation]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "section"
    return "text"


def default(field: Any) -> str:
    """What a key has that is not given."""
    if field.is_required():
        return "required"
    value = field.default
    if field.default_factory is not None:
        value = field.default_factory()
    if value is PydanticUndefined or value is None or value in ("", (), [], {}):
        return "–"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, BaseModel):
        return "–"
    if isinstance(value, tuple | list):
        inner = ", ".join(f'"{v}"' if isinstance(v, str) else f"{v:g}" for v in value)
        return f"`[{inner}]`"
    return f'`"{value}"`' if isinstance(value, str) else f"`{value:g}`"


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """What stands above each key in its class; a key without words has those of the key before."""
    said: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if not issubclass(base, BaseModel) or base is BaseModel:
            continue
        words, fresh = "", True
        for line in inspect.getsource(base).splitlines():
            if line.startswith("    #:"):
                words = "" if fresh else words
                words, fresh = f"{words} {line.strip(' #:')}".strip(), False
            elif key := re.match(r"    (\w+): [^#]*(?:#: (.*))?", line):
                said[key[1]], fresh = key[2] or words, True
    return said


def inner_model(annotation: Any) -> tuple[type[BaseModel] | None, str]:
    """The section that a key holds, and how its heading is written."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, "[{}]"
    if origin in (tuple, list) and inner:
        return inner_model(inner[0])[0], "[[{}]]"
    if origin is dict:
        return inner_model(inner[1])[0], "[{}.NAME]"
    if origin in (typing.Union, types.UnionType, typing.Annotated):
        for one in inner:
            model, words = inner_model(one)
            if model is not None:
                return model, words
    return None, "[{}]"


def table(model: type[BaseModel], path: str, seen: dict[str, str]) -> list[str]:
    """The rows of a section, and the tables of those in it; keys of one meaning share a row.

    ``seen`` has the headings of the sections that are written already, and where keys that several
    sections have are explained.
    """
    said = meanings(model)
    rows: dict[str, list[tuple[str, str, str]]] = {}
    elsewhere: dict[str, list[str]] = {}
    further: list[str] = []
    for name, field in model.model_fields.items():
        key = field.alias or name
        section, words = inner_model(field.annotation)
        if section is not None:
            heading = words.format(f"{path}.{key}" if path else key)
            if heading not in seen:
                seen[heading] = heading
                inner = re.sub(r"[\[\]]", "", heading)
                lines = table(section, inner, seen)
                if lines:
                    first = (section.__doc__ or "").strip().split("\n")[0].replace("``", "`")
                    further += ["", f"## `{heading}`", "", first, "", *lines]
            continue
        if name not in model.__annotations__ and name in seen:
            elsewhere.setdefault(seen[name], []).append(f"`{key}`")
            continue
        if name not in model.__annotations__:
            seen[name] = path
        meaning = said.get(name, "").replace("|", "\\|").replace("``", "`")
        meaning = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", meaning)
        words = f"{kind(field.annotation)}{unit(key)}"
        rows.setdefault(meaning or key, []).append((f"`{key}`", words, default(field)))
    lines = [
        f"| {' | '.join(together(cells) for cells in zip(*keys, strict=True))} | "
        f"{'' if meaning == keys[0][0].strip('`') else meaning} |"
        for meaning, keys in rows.items()
    ]
    lines += [f"| {', '.join(keys)} | | | As in `{of}`. |" for of, keys in elsewhere.items()]
    head = ["| key | type [unit] | default | meaning |", "|---|---|---|---|"]
    return [*(head if lines else []), *lines, *further]


def together(cells: tuple[str, ...]) -> str:
    """Cells of keys that share a row: once if they are alike."""
    alike = len(set(cells)) == 1
    return cells[0] if alike else ", ".join(cells)


def tables() -> str:
    """All tables, with a heading for each section."""
    return "\n".join(["## Top of the file", "", *table(Project, "", {})])
