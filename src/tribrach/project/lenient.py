"""A project file with mistakes: all of them at once, and what is left without them."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from tribrach.errors import InputError, RefusalCollector
from tribrach.project import toml_file
from tribrach.project.model import Project

#: a file is looked at so often; every look removes something that is wrong
_LOOKS = 50


def load_leniently(path: Path, refused: RefusalCollector) -> Project | None:
    """The part of a project file that is right; what is wrong is noted.

    Keys that are wrong are left out, and where that leaves a table without what it needs, the
    table. None where the file is no TOML, or where nothing of it can be used.
    """
    try:
        _, text = toml_file.load(path)
    except InputError as error:
        refused.add(error)
        return None
    return _right_part(path, text, refused)


def without(
    project: Project, places: Sequence[Sequence[str | int]], refused: RefusalCollector
) -> Project | None:
    """The same project without some keys or tables, all other lines where they were."""
    text, path = project._text, project._file
    assert path is not None
    # entries behind another keep their number until it is gone
    for place in sorted(places, key=lambda p: [str(part).zfill(6) for part in p], reverse=True):
        text = toml_file.without(text, place)
    return _right_part(path, text, refused)


def _right_part(path: Path, text: str, refused: RefusalCollector) -> Project | None:
    for _ in range(_LOOKS):
        try:
            project = Project.model_validate(tomllib.loads(text))
        except ValidationError as error:
            refused.add(toml_file.refused(error, Project, path, text))
            shorter = _shortened(text, error)
            if shorter == text:
                return None
            text = shorter
        except tomllib.TOMLDecodeError:
            return None
        else:
            project._folder, project._file, project._text = path.parent, path, text
            return project
    return None


def _shortened(text: str, error: ValidationError) -> str:
    """A text without what a validation refuses."""
    places = []
    for detail in error.errors():
        place = [part for part in detail["loc"] if not str(part).startswith("function-")]
        typed = toml_file.typed(tomllib.loads(text), place)
        if typed:
            places.append(typed)
    unique = dict.fromkeys(places)
    for there in sorted(unique, key=lambda p: [str(part).zfill(6) for part in p], reverse=True):
        text = toml_file.without(text, there)
    return text
