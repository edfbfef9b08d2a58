"""Views that somebody saved by name: a small file beside the project.

A view is the part of the address behind ``#``: layers, camera, colours and selection.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from tribrach.errors import InputError
from tribrach.io.keeping import alone, keeping
from tribrach.io.outputs import write_text
from tribrach.io.toml_model import quoted, read_model, read_text, with_comments

#: beside the project file
VIEWS = "views.toml"
#: views of a project, and characters of a name and of a view
_MOST, _NAME, _LENGTH = 500, 100, 20_000
_HEAD = "# Views of the workbench, by name: what stands behind # in its address.\n"


class _View(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    hash: str


class _Views(BaseModel):
    model_config = ConfigDict(extra="forbid")
    view: list[_View] = []


def read_views(path: Path) -> dict[str, str]:
    """Views by name; none where there is no file."""
    if not path.is_file():
        return {}
    views = read_model(path, _Views, "a view has a name and a hash").view
    return {view.name: view.hash for view in views}


def keep_view(path: Path, name: str, place: str | None) -> dict[str, str]:
    """Save a view, or remove the one of a name."""
    name = name.strip()
    if not name or len(name) > _NAME or len(place or "") > _LENGTH:
        raise InputError(
            f"a view has a name of at most {_NAME} characters and a state of at most {_LENGTH}",
            cure="give it a short name",
        )
    with alone(path):
        text = read_text(path) if path.is_file() else ""
        views = read_views(path)
        if place is None:
            views.pop(name, None)
        else:
            views[name] = place
        if len(views) > _MOST:
            raise InputError(f"there are {_MOST} views already", cure="remove some")
        tables = [f"[[view]]\nname = {quoted(n)}\nhash = {quoted(h)}\n" for n, h in views.items()]
        with keeping(overwrite=True):
            write_text(path, with_comments(_HEAD, tables, text))
    return views
