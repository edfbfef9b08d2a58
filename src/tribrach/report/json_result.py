"""The result for other programs: JSON of schema 2, strict, stable names.

Metres, radians and metres squared; names as keys; null where there is no number. ``xyz`` are E,
N, U of the work frame, which for Cartesian input are its own coordinates. Covariances are scaled
as ``sigma0.covariances`` says (``prior`` or ``posterior``).
"""

from __future__ import annotations

from dataclasses import asdict
from functools import cache
from typing import Any

from pydantic import Field, create_model

from tribrach.report.chapters import SUBJECTS
from tribrach.report.content import Observation, Point, Report, StationRow, Unknown
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.result import SCHEMA, ResultHead

__all__ = ["SCHEMA", "dumps", "result", "result_model"]

_DOCUMENT = "What ``tribrach run`` and ``tribrach adjust --json`` write."


def result(content: Report) -> ResultHead:
    """The result as a document."""
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
        "points": {point.name: _point(point) for point in content.points},
        "stations": _stations(content),
        "calibrations": {u.name: _scalar(u) for u in _calibrations(content)},
        "lever_arms": {u.name: _block(u) for u in content.unknowns if u.family == "vector"},
        "planes": {u.name: _plane(u) for u in content.unknowns if u.family == "plane"},
        "observations": [_observation(o) for o in content.observations],
        "edits": [asdict(edit) for edit in content.adjustment.network.edits],
        "warnings": list(content.warnings),
    }
    return result_model().model_validate(data | _chapters(content))


def _chapters(content: Report) -> dict[str, Any]:
    """Data of the chapters by their keys; a list where a subject may have several chapters."""
    several = {subject.key for subject in SUBJECTS if subject.several}
    data: dict[str, Any] = {}
    for chapter in content.chapters:
        key = chapter.key or chapter.name
        if chapter.data is None:
            continue
        if key in several:
            data.setdefault(key, []).append(chapter.data)
        else:
            data[key] = chapter.data
    return data


@cache
def result_model() -> type[ResultHead]:
    """The model of the whole document: the adjusted network, and what each chapter adds."""
    keys: dict[str, Any] = {
        subject.key: (subject.model, Field(default=None))
        for subject in SUBJECTS
        if subject.model is not None
    }
    return create_model("Result", __base__=ResultHead, __doc__=_DOCUMENT, **keys)


def dumps(content: Report) -> str:
    """The result as strict JSON text; NaN or infinity in it would be an error of this program."""
    return document_text(result(content))


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


def _observation(o: Observation) -> dict[str, Any]:
    """One value; figures that need it to take part are null for the others."""
    out = {
        "id": o.id,
        "kind": o.kind,
        "component": o.component,
        "from": o.start,
        "to": o.end,
        "unit": o.unit,
        "value": o.value,
        "sigma": o.sigma,
        "residual": o.residual,
        "redundancy": o.redundancy,
        "w": o.w,
        "tau": o.tau,
        "mdb": o.mdb,
        "external": o.external,
        "external_at": o.external_at or None,
        "block_test": o.block_test,
        "suspicious": o.suspicious,
        "group": o.group,
        "state": o.state,
        "source": o.source,
    }
    return out | ({"reason": o.reason} if o.reason else {})
