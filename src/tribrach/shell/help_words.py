"""Words in the help of commands that say what an option takes, in place of types of a language.

Which of them an option gets follows from its annotation: FILE for a path, NUMBER, TEXT, the choices
themselves, and nothing for a switch. An option that says its own (``metavar``) keeps it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from typer.core import TyperCommand, TyperGroup

from tribrach.io.keeping import keeping

_WORDS = {Path: "FILE", int: "NUMBER", float: "NUMBER", str: "TEXT", bool: ""}


def in_words(taken: Any) -> str:
    """What a value of a type is to be: FILE, NUMBER, gon|deg, "" for a switch."""
    origin, parts = get_origin(taken), get_args(taken)
    if origin is Literal:
        return "|".join(map(str, parts))
    if origin in (Union, UnionType):
        return in_words(next(part for part in parts if part is not type(None)))
    if origin is tuple:
        return " ".join(map(in_words, parts))
    if origin is list:
        return in_words(parts[0])
    return _WORDS.get(taken, "TEXT")


def spoken(command: Any, function: Callable[..., None]) -> None:
    """Give the options and arguments of a command words for what they take."""
    hints = get_type_hints(function, include_extras=True)
    for param in command.params:
        hint = hints.get(param.name)
        if hint is None or param.metavar is not None:
            continue
        taken = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        if param.param_type_name == "argument":
            param.metavar = param.name.upper().replace("_", "-")
        else:
            folder = re.search(r"^folder|into this folder", param.help or "", re.IGNORECASE)
            param.metavar = "FOLDER" if folder else in_words(taken)


class _Spoken:
    """Help that names no types."""

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        for param in self.params:  # type: ignore[attr-defined]
            if param.param_type_name == "argument":
                # its name says what it is
                param.display_type_rich = _nothing

    def get_help_option(self, ctx: Any) -> Any:
        """The option ``--help``, which takes nothing."""
        option = super().get_help_option(ctx)  # type: ignore[misc]
        if option is not None:
            option.metavar = ""
        return option


class SpokenCommand(_Spoken, TyperCommand):
    """A command whose help names no types; what it writes is listed as of its words."""

    def invoke(self, ctx: Any) -> Any:
        """Run it as ``transform fit``, whatever the program is called."""
        words, at = list[str](), ctx
        while at is not None and at.parent is not None:
            words.insert(0, at.info_name)
            at = at.parent
        with keeping(command=" ".join(words)):
            return super().invoke(ctx)


class SpokenGroup(_Spoken, TyperGroup):
    """The same of commands under one name."""


def _nothing(ctx: Any) -> str:
    """No type."""
    return ""
