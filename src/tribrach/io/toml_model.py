"""Small TOML files of ours: texts in them, and models whose complaints become sentences."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.xml_file import read_bytes
from tribrach.units import LARGEST

__all__ = ["quoted", "read_model"]

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
