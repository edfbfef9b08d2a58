"""What all documents have in common."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

__all__ = [
    "Document",
    "DocumentPart",
    "Finite",
    "Matrix",
    "Number",
    "Triple",
    "document_text",
    "heading",
]

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


#: how documents are written
_LAYOUT: dict[str, Any] = {"by_alias": True, "exclude_unset": True, "indent": 1}
