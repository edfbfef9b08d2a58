"""The result for other programs: JSON of schema 2, strict, stable names.

Metres, radians and metres squared; names as keys; null where there is no number. ``xyz`` are E,
N, U of the work frame, which for Cartesian input are its own coordinates. Covariances are scaled
as ``sigma0.covariances`` says (``prior`` or ``posterior``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, create_model

from tribrach.report.chapters import CHAPTERS, named
from tribrach.report.content import ObservedValues, Point, Report, StationRow, Unknown
from tribrach.report.schema.base import Items, document_pieces, heading
from tribrach.report.schema.result import SCHEMA, ResultHead

__all__ = ["SCHEMA", "dumps", "network", "pieces", "result", "result_model"]

#: objects of a part that is written at once
_PART = 5000
#: keys of an observation in their order; figures that need it to take part are null for others
_KEYS = (
    "id", "kind", "component", "from", "to", "unit", "value", "sigma", "residual", "redundancy",
    "w", "tau", "mdb", "external", "external_at", "block_test", "suspicious", "group", "state",
    "source",
)  # fmt: skip
#: attributes of what the keys name otherwise
_ATTRIBUTES = {"from": "start", "to": "end"}

_DOCUMENT = "What ``tribrach run`` and ``tribrach adjust --json`` write."


def result(content: Report) -> ResultHead:
    """The result as a document."""
    return result_model().model_validate(network(content))


def network(content: Report) -> dict[str, Any]:
    """The result as plain values by the keys of the document."""
    whole: dict[str, Any] = {"points": {}, "calibrations": {}, "stations": {}, "observations": []}
    for key, parts in _long(content).items():
        for part in parts:
            if isinstance(part, dict):
                whole[key].update(part)
            else:
                whole[key] += part
    return _short(content) | whole


def pieces(content: Report) -> Iterator[str]:
    """The result as strict JSON text, piece by piece; a large network is never in memory whole.

    NaN or infinity in it would be an error of this program.
    """
    long = _long(content)
    empty: dict[str, Any] = {key: [] if key == "observations" else {} for key in long}
    short = _short(content)
    # only models of what it has: building them takes longer than a small network
    model = result_model(tuple(name for name in CHAPTERS if name in short))
    document = model.model_validate(short | empty)
    yield from document_pieces(document, long)


def dumps(content: Report) -> str:
    """The text of :func:`pieces`."""
    return "".join(pieces(content))


def _short(content: Report) -> dict[str, Any]:
    """The keys that do not grow with the network, and what the chapters add."""
    data = heading(SCHEMA) | {
        "tribrach": content.version,
        "title": content.title,
        "datum": {
            "kind": content.datum.kind,
            "names": list(content.datum.names),
            "statement": content.datum.sentence,
        },
        "reference": dict(content.reference),
        "sigma0": _sigma0(content),
        "lever_arms": {u.name: _block(u) for u in content.unknowns if u.family == "vector"},
        "planes": {u.name: _plane(u) for u in content.unknowns if u.family == "plane"},
        "edits": [asdict(edit) for edit in content.adjustment.network.edits],
        "warnings": list(content.warnings),
    }
    return data | _chapters(content)


def _long(content: Report) -> dict[str, Iterator[Items]]:
    """The keys that grow with the network, part by part."""
    return {
        "points": _parts({point.name: _point(point) for point in content.points}),
        "stations": _parts(_stations(content)),
        "calibrations": _parts({u.name: _scalar(u) for u in _calibrations(content)}),
        "observations": _observation_parts(content.observations),
    }


def _parts(whole: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A mapping in parts."""
    items = iter(whole.items())
    while part := dict(islice(items, _PART)):
        yield part


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


@cache
def result_model(chapters: tuple[str, ...] = tuple(CHAPTERS)) -> type[ResultHead]:
    """The model of the whole document: the adjusted network, and what each chapter adds."""
    keys: dict[str, Any] = {
        subject.key: (subject.model, Field(default=None))
        for subject in map(named, chapters)
        if subject.model is not None
    }
    return create_model("Result", __base__=ResultHead, __doc__=_DOCUMENT, **keys)


def _sigma0(content: Report) -> dict[str, Any]:
    """Sigma of unit weight, redundancy, global test, and what covariances are scaled by."""
    summary, test = content.summary, content.summary.test
    return {
        "prior": summary.sigma0,
        "posterior": summary.sigma0_posterior,
        "dof": summary.dof,
        "vtpv": summary.vtpv,
        "covariances": "posterior" if content.scaled else "prior",
        "iterations": summary.iterations,
        "global_test": {
            "statistic": test.statistic,
            "lower": test.lower,
            "upper": test.upper,
            "alpha": test.alpha,
            "accepted": test.accepted,
        },
    }


def _point(point: Point) -> dict[str, Any]:
    out = {"xyz": point.xyz, "covariance": point.covariance, "role": point.role}
    further = ("geodetic", "ecef", "ecef_covariance", "projected")
    known = {key: getattr(point, key) for key in further}
    return out | {key: value for key, value in known.items() if value is not None}


def _stations(content: Report) -> dict[str, Any]:
    """Scanner stations by their pose; set-ups on points by their orientation unknowns."""
    out: dict[str, Any] = {station.name: _station(station) for station in content.stations}
    for unknown in content.unknowns:
        if unknown.role == "orientation" and unknown.at:
            empty = {"world_from_scanner": None, "covariance": None}
            station = out.setdefault(unknown.at, empty)
            station.setdefault("orientation", {})[unknown.name] = {
                "value": unknown.values[0],
                "sigma": unknown.sigma[0],
            }
    return out


def _station(station: StationRow) -> dict[str, Any]:
    return {"world_from_scanner": station.world_from_scanner, "covariance": station.covariance}


def _calibrations(content: Report) -> list[Unknown]:
    """Scalars that are not listed as the orientation of a station."""
    return [
        u
        for u in content.unknowns
        if u.family == "scalar" and not (u.role == "orientation" and u.at)
    ]


def _scalar(unknown: Unknown) -> dict[str, Any]:
    return {
        "value": unknown.values[0],
        "sigma": unknown.sigma[0],
        "unit": unknown.units[0],
        "role": unknown.role,
    }


def _block(unknown: Unknown) -> dict[str, Any]:
    return {"xyz": unknown.values, "covariance": unknown.covariance, "role": unknown.role}


def _plane(unknown: Unknown) -> dict[str, Any]:
    """Normal and offset; the covariance is of two turns of the normal [rad] and the offset [m]."""
    return {
        "normal": unknown.values[:3],
        "offset": unknown.values[3],
        "covariance": unknown.covariance,
    }


def _observation_parts(observations: ObservedValues) -> Iterator[list[dict[str, Any]]]:
    """All values, part by part; figures that need a value to take part are None for the others.

    Raises
    ------
    ValueError
        A value or a sigma is no number, which is an error of this program.
    """
    for name in ("value", "sigma"):
        if not np.isfinite(observations.column(name)).all():
            raise ValueError(f"the {name} of an observation is not a number")
    for begin in range(0, len(observations), _PART):
        part = observations[begin : begin + _PART]
        columns = [_plain(part.column(_ATTRIBUTES.get(key, key))) for key in _KEYS]
        rows = [dict(zip(_KEYS, values, strict=True)) for values in zip(*columns, strict=True)]
        reasons = part.column("reason").tolist()
        for row, reason in zip(rows, reasons, strict=True):
            row["external_at"] = row["external_at"] or None
            if reason:
                row["reason"] = reason
        yield rows


def _plain(column: NDArray[Any]) -> list[Any]:
    """Values of a column, None for NaN."""
    missing = np.isnan(column) if column.dtype.kind == "f" else np.zeros(len(column), dtype=bool)
    if missing.any():
        column = column.astype(object)
        column[missing] = None
    values: list[Any] = column.tolist()
    return values
