"""Docstrings as the pages of the API reference need them.

They are written for readers of the code: units stand in square brackets, other names in roles as
numpydoc has them. In Markdown two brackets in a row are a link, and roles are unknown.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

ROLE = re.compile(r":\w+:`~?(?:[\w.]+\.)?(\w+)`")
CODE = re.compile(r"(`+[^`]*`+)")
LINK = re.compile(r"\](\s*)([\[(])")


class Markup(griffe.Extension):
    """Writes roles as code and keeps brackets from becoming links."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Rewrite the docstring of an object of the package."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(text: str) -> str:
    """A docstring with its roles as code and no accidental links."""
    pieces = CODE.split(ROLE.sub(r"`\1`", text))
    plain, code = pieces[::2], pieces[1::2]
    plain = [LINK.sub(r"]\1\\\2", piece) for piece in plain]
    return "".join(a + b for a, b in zip(plain, [*code, ""], strict=True))
