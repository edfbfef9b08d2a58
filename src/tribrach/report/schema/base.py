"""What all documents have in common."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import version
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import to_json

__all__ = [
    "Document",
    "DocumentPart",
    "Finite",
    "Matrix",
    "Number",
    "Triple",
    "document_pieces",
    "document_text",
    "heading",
]

#: a part of a long list or mapping of objects
Items = list[dict[str, Any]] | dict[str, dict[str, Any]]
#: null where there is no number
Number = float | None
#: three numbers along the axes of a frame
Triple = tuple[Number, Number, Number]
#: rows of numbers
Matrix = list[list[Number]]


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


#: a number; NaN and infinities become null
Finite = Annotated[float | None, BeforeValidator(_finite)]


class DocumentPart(BaseModel):
    """A part of a document: its keys and no others, every number finite.

    Keys that a part may lack are left out where nothing is known of them. What is written below an
    attribute describes its key in the published schema; ``docs/make_schemas.py`` looks it up there,
    as it would cost every command a tenth of its start.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        from_attributes=True,
        populate_by_name=True,
        protected_namespaces=(),
        defer_build=True,
    )


class Document(DocumentPart):
    """A whole document."""

    tribrach: str
    """Version of the program that wrote it."""
    schema_: int = Field(alias="schema")
    """Version of the layout; it changes when a key or a meaning does."""


def heading(schema: int) -> dict[str, Any]:
    """The keys that every document begins with."""
    return {"tribrach": version("tribrach"), "schema": schema}


def document_text(document: DocumentPart) -> str:
    """A document as JSON text; keys that were not given are left out."""
    return document.model_dump_json(**_LAYOUT) + "\n"


def document_pieces(
    document: DocumentPart, streamed: Mapping[str, Iterable[Items]]
) -> Iterator[str]:
    """The text of :func:`document_text` piece by piece, with long lists that no model holds.

    Parameters
    ----------
    document
        All keys; those that are streamed are empty in it.
    streamed
        By key its items, part by part in their order: lists of objects for a list, dictionaries of
        objects for a mapping. Their texts, finite numbers and None are those of the models; a
        number that is none becomes null.

    Yields
    ------
    str
        Pieces of the text.
    """
    opened = "{"
    for name, field in type(document).model_fields.items():
        if name not in document.model_fields_set:
            continue
        yield opened + "\n"
        empty = _inner(document.model_dump_json(include={name}, **_LAYOUT))
        parts = (part for part in streamed.get(name, ()) if part)
        yield from _key_pieces(field.alias or name, parts, empty)
        opened = ","
    yield "\n}\n"


#: how documents are written
_LAYOUT: dict[str, Any] = {"by_alias": True, "exclude_unset": True, "indent": 1}


def _key_pieces(key: str, parts: Iterable[Items], empty: str) -> Iterator[str]:
    """The lines of one key, without the braces of its document; ``empty`` if there are no parts."""
    last = empty
    for number, part in enumerate(parts):
        lines = _inner(to_json({key: part}, indent=1, inf_nan_mode="null").decode())
        head, rest = lines.split("\n", 1)
        items, last = rest.rsplit("\n", 1)
        yield f",\n{items}" if number else f"{head}\n{items}"
        last = f"\n{last}"
    yield last


def _inner(text: str) -> str:
    """The lines of an object without its braces."""
    return text.removeprefix("{\n").removesuffix("\n}")
