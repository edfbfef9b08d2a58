"""What somebody decided by hand about a project, in a file beside it: ``edits.toml``.

``[[edit]]`` switches an observation off, makes it a check, or takes it back; ``[[role]]`` says what
the given coordinates of a point are for; ``[[target]]`` names a target that was found in a scan, or
rejects it; ``[[pick]]`` uses a natural point of a scan. Each says why.
"""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PrivateAttr, Strict, ValidationError, field_validator, model_validator

from tribrach.errors import InputError
from tribrach.io.toml_model import quoted, with_comments
from tribrach.network.network import PointRole
from tribrach.project import toml_file
from tribrach.project.sections import Section
from tribrach.targets.picks import NaturalPoint, PickKind

#: the largest file of this kind [bytes]
_LARGEST = 20_000_000
#: characters of a reason
_LONGEST = 2000


class _Decision(Section):
    """What every decision has."""

    #: Why, who says so, and when.
    reason: str = Field(min_length=1, max_length=_LONGEST)
    by: str = Field(default="", max_length=_LONGEST)
    # strict: pydantic would take numbers for seconds since 1970
    at: Annotated[datetime.datetime, Strict()] | Annotated[datetime.date, Strict()] | None = None

    @field_validator("reason")
    @classmethod
    def _said(cls, reason: str) -> str:
        if not reason.strip():
            raise ValueError("say why: the reason is blank")
        return reason

    @property
    def when(self) -> str:
        """Date or date and time as text; empty if not given."""
        return "" if self.at is None else self.at.isoformat()


class ObservationEdit(_Decision):
    """The use of an observation."""

    #: Its id, or the ``file:line`` where one or several stand.
    observation: str = Field(min_length=1)
    use: Literal["off", "check", "active"]  #: ``off``, ``check`` or ``active``.


class RoleEdit(_Decision):
    """What the given coordinates of a point are for."""

    point: str = Field(min_length=1)  #: Its name.
    role: PointRole  #: ``control``, ``check`` or ``free``.


class TargetEdit(_Decision):
    """What a target is that was found in a scan."""

    scan: str = Field(min_length=1)  #: Name of the scan.
    center: tuple[float, float, float]  #: Where it was found, x, y, z in the scanner frame [m].
    #: Its name; without one it keeps the name that is found for it.
    name: str | None = Field(default=None, min_length=1)
    accept: bool = True  #: False if it is none, or is not to be used.

    @model_validator(mode="after")
    def _one_thing(self) -> Self:
        if not self.accept and self.name is not None:
            raise ValueError("a target that is not accepted needs no name")
        if self.accept and self.name is None:
            raise ValueError("give the name of the target, or accept = false")
        return self


class PickEdit(_Decision):
    """A natural point of a scan that is used like a target."""

    scan: str = Field(min_length=1)  #: Name of the scan.
    place: tuple[float, float, float]  #: Where it was picked, x, y, z in the scanner frame [m].
    #: What it is: ``corner`` of three faces, ``edge`` of two, ``disc``, ``hole``, ``axis`` of a
    #: cylinder, or a ``place``.
    kind: PickKind
    name: str = Field(min_length=1)  #: Its name; the same from another station ties both.
    radius_m: float = Field(default=0.3, gt=0, le=20)  #: Points as near as this to the place count.
    use: Literal["active", "check"] = "active"  #: ``check`` to compare it only.

    @property
    def pick(self) -> NaturalPoint:
        """The same for the fit."""
        return NaturalPoint(self.kind, self.place, self.radius_m)


class Edits(Section):
    """Decisions by hand in a project, each with its reason."""

    #: Of observations, points and found targets.
    edit: tuple[ObservationEdit, ...] = ()
    role: tuple[RoleEdit, ...] = ()
    target: tuple[TargetEdit, ...] = ()
    pick: tuple[PickEdit, ...] = ()
    _file: Path | None = PrivateAttr(default=None)
    _text: str = PrivateAttr(default="")

    @property
    def file(self) -> Path | None:
        """Where they were read; None for decisions made in Python."""
        return self._file

    @property
    def text(self) -> str:
        """The text of the file; empty for decisions made in Python."""
        return self._text

    def __len__(self) -> int:
        return len(self.edit) + len(self.role) + len(self.target) + len(self.pick)

    def error(self, table: str, number: int, what: str, cure: str | None = None) -> InputError:
        """Make an error about an entry, counted from 0."""
        line = toml_file.line_of(self._text, (table, number)) if self._text else None
        return InputError(
            what, file=self._file, line=line, record=f"{table} {number + 1}", cure=cure
        )

    def check(self) -> Self:
        """Refuse two entries about one thing, with the line of the second."""
        for table, keys in (
            ("edit", [edit.observation for edit in self.edit]),
            ("role", [role.point for role in self.role]),
            ("target", [f"{t.scan} at {t.center}" for t in self.target]),
            ("pick", [f"{p.name} in {p.scan}" for p in self.pick]),
        ):
            seen: dict[str, int] = {}
            for number, key in enumerate(keys):
                if key in seen:
                    raise self.error(
                        table,
                        number,
                        f"{key} is decided twice (first in entry {seen[key] + 1})",
                        "keep one of them",
                    )
                seen[key] = number
        return self


def read_edits(path: Path) -> Edits:
    """Read a file of decisions, each with a reason and no two about one thing."""
    data, text = toml_file.load(path, _LARGEST)
    try:
        edits = Edits.model_validate(data)
    except ValidationError as error:
        raise toml_file.refused(error, Edits, path, text) from error
    edits._file, edits._text = path, text
    return edits.check()


def edits_text(edits: Edits, old: str = "") -> str:
    """Decisions as such a file, read as the same; comments of the text ``old`` stay."""
    head = "# Decisions by hand; run and adjust obey them.\n"
    tables = [
        "\n".join([f"[[{table}]]", *_lines(entry), ""])
        for table in ("edit", "role", "target", "pick")
        for entry in getattr(edits, table)
    ]
    return with_comments(head, tables, old)


def _lines(entry: _Decision) -> Iterator[str]:
    """Keys and values of an entry."""
    own = [name for name in type(entry).model_fields if name not in _Decision.model_fields]
    for name in (*own, *_Decision.model_fields):
        value = getattr(entry, name)
        if value is None or value == "":
            continue
        if isinstance(value, bool):
            yield f"{name} = {'true' if value else 'false'}"
        elif isinstance(value, str):
            yield f"{name} = {quoted(value)}"
        elif isinstance(value, float):
            yield f"{name} = {value!r}"
        elif isinstance(value, datetime.date):
            yield f"{name} = {value.isoformat()}"
        else:
            yield f"{name} = [{', '.join(repr(float(number)) for number in value)}]"
