"""Reads small TOML files of ours, checked by a pydantic model whose complaints become sentences."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.xml_file import read_bytes

__all__ = ["read_model"]

Model = TypeVar("Model", bound=BaseModel)


def read_model(path: Path, model: type[Model], cure: str) -> Model:
    """A file as an instance of a model.

    Parameters
    ----------
    path
        The file.
    model
        The pydantic model.
    cure
        What to do about a key that is wrong.

    Raises
    ------
    InputError
        Unreadable, not UTF-8, not TOML, a key that is missing, unknown or wrong.
    """
    try:
        return model.model_validate(tomllib.loads(read_bytes(path).decode("utf-8-sig")))
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
