"""The result for other programs: JSON of schema 2, strict, stable names.

Metres, radians and metres squared; names as keys; null where there is no number. ``xyz`` are E,
N, U of the work frame, which for Cartesian input are its own coordinates. Covariances are scaled
as ``sigma0.covariances`` says (``prior`` or ``posterior``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from itertools import compress, islice
from math import nan
from typing import Any

import numpy as np

from tribrach.answers import Estimate, Form, Result, plain
from tribrach.network.facts import Reference
from tribrach.network.network import Edit
from tribrach.network.observation_rows import ObservationRow, ObservationRows
from tribrach.report.chapters import CHAPTERS, named
from tribrach.report.content import (
    DatumStatement,
    PlaneUnknown,
    Point,
    Report,
    ScalarUnknown,
    SetUp,
    Summary,
    VectorUnknown,
)

#: version of the layout; 2 has ``id`` and ``suspicious`` of observations
SCHEMA = 2
#: objects of a part that is written at once
_PART = 5000


@dataclass(frozen=True)
class AdjustedNetwork(Result):
    """What ``tribrach run`` and ``tribrach adjust --json`` write."""

    title: str
    datum: DatumStatement
    #: of the coordinates, null where they have none
    reference: Reference
    sigma0: Summary
    points: dict[str, Point]
    stations: dict[str, SetUp]
    calibrations: dict[str, ScalarUnknown]
    lever_arms: dict[str, VectorUnknown]
    planes: dict[str, PlaneUnknown]
    observations: Sequence[ObservationRow]
    edits: list[Edit]  #: observations switched off or given another sigma by hand
    warnings: list[str]  #: sentences, the gravest first


def form() -> Form:
    """The whole document: the adjusted network, and what each chapter adds."""
    added = [(s.key, s.model, field(default=None)) for s in map(named, CHAPTERS) if s.model]
    said = {"__doc__": AdjustedNetwork.__doc__, "_maybe": tuple(key for key, *_ in added)}
    bases = (AdjustedNetwork,)
    whole = make_dataclass("Result", added, bases=bases, namespace=said, frozen=True)
    return Form("result", whole, SCHEMA)


def network(content: Report) -> dict[str, Any]:
    """The result as plain values by the keys of the document."""
    return {key: _plain(value) for key, value in _document(content).items()}


def pieces(content: Report) -> Iterator[str]:
    """The result as strict JSON text, piece by piece; a large network is never in memory whole."""
    opened = "{"
    for key, value in _document(content).items():
        yield opened + "\n"
        yield from _key_pieces(key, value)
        opened = ","
    yield "\n}\n"


def dumps(content: Report) -> str:
    """The text of :func:`pieces`."""
    return "".join(pieces(content))


def _document(content: Report) -> dict[str, Any]:
    """The keys of the document with what stands there."""
    for name in ("value", "sigma"):
        if not np.isfinite(content.observations.column(name)).all():
            raise ValueError(f"the {name} of an observation is not a number")
    scalars = [u for u in content.unknowns if isinstance(u, ScalarUnknown)]
    of_stations = [u.role == "orientation" and u.at != "" for u in scalars]
    adjusted = AdjustedNetwork(
        content.title,
        content.datum,
        content.adjustment.network.reference,
        content.summary,
        {point.name: point for point in content.points},
        _stations(content, compress(scalars, of_stations)),
        {u.name: u for u, own in zip(scalars, of_stations, strict=True) if not own},
        {u.name: u for u in content.unknowns if isinstance(u, VectorUnknown)},
        {u.name: u for u in content.unknowns if isinstance(u, PlaneUnknown)},
        content.observations,
        list(content.adjustment.network.edits),
        list(content.warnings),
    )
    head = {"tribrach": content.version, "schema": SCHEMA}
    return head | vars(adjusted) | _chapters(content)


def _stations(content: Report, oriented: Iterable[ScalarUnknown]) -> dict[str, SetUp]:
    """Scanner stations by their pose; set-ups on points by their orientation unknowns."""
    out: dict[str, SetUp] = {station.name: station for station in content.stations}
    for unknown in oriented:
        known = out.get(unknown.at, SetUp())
        own = Estimate(unknown.value, nan if unknown.sigma is None else unknown.sigma)
        out[unknown.at] = replace(known, orientation={**known.orientation, unknown.name: own})
    return out


def _chapters(content: Report) -> dict[str, Any]:
    """Data of the chapters by their keys; a list where a subject may have several chapters."""
    data: dict[str, Any] = {}
    for chapter in content.chapters:
        key = chapter.key or chapter.name
        if chapter.data is None:
            continue
        if named(key).several:
            data.setdefault(key, []).append(chapter.data)
        else:
            data[key] = chapter.data
    return data


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    return value.written() if isinstance(value, ObservationRows) else plain(value)


def _key_pieces(key: str, value: Any) -> Iterator[str]:
    """The lines of one key, without the braces of its document."""
    from pydantic_core import to_json

    last = ""
    for number, part in enumerate(_parts(value)):
        lines = to_json({key: _plain(part)}, indent=1).decode()[2:-2]
        if not isinstance(part, Mapping | list | ObservationRows) or not len(part):
            yield lines
            return
        head, rest = lines.split("\n", 1)
        items, last = rest.rsplit("\n", 1)
        yield f",\n{items}" if number else f"{head}\n{items}"
        last = f"\n{last}"
    yield last


def _parts(value: Any) -> Iterator[Any]:
    """A long mapping or list in parts, anything else in one."""
    if not isinstance(value, Mapping | list | ObservationRows) or len(value) <= _PART:
        yield value
    elif isinstance(value, Mapping):
        items = iter(value.items())
        while part := dict(islice(items, _PART)):
            yield part
    else:
        for begin in range(0, len(value), _PART):
            yield value[begin : begin + _PART]
