"""A calibration as one HTML page, and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tribrach.calibration.correlations import CorrelatedPair
from tribrach.calibration.estimability import Left
from tribrach.calibration.remedies import Remedy
from tribrach.calibration.self_calibration import Parameter, SelfCalibration
from tribrach.calibration.significance import BlockTest, Omitted
from tribrach.instruments.calibration import unit_of
from tribrach.report.calibration_charts import calibration_charts
from tribrach.report.calibration_words import (
    calibration_sentences,
    shown,
    shown_unit,
)
from tribrach.report.numbers import count_cell, matrix, number, numbers
from tribrach.report.page import page
from tribrach.report.schema.base import heading
from tribrach.report.schema.calibration import SCHEMA, CalibrationDocument
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import SEC

__all__ = ["calibration_document", "calibration_page"]


def calibration_page(title: str, found: SelfCalibration, further: Sequence[str] = ()) -> str:
    """HTML text; further : sentences to begin with."""
    footer = f"Datum: {found.datum_words}. Sigmas {found.sigma_origin}."
    return page(
        "Self-calibration",
        title,
        [*further, *calibration_sentences(found)],
        calibration_charts(found),
        [
            _parameters(found),
            _left(found),
            _omitted(found),
            _pairs(found),
            _datum_parameters(found),
            _datum_stations(found),
            _datum_points(found),
            _remedies(found),
        ],
        footer,
    )


def _small(value: float, unit: str, mark: str = "") -> Cell:
    return number_cell(value, shown(value, unit), mark)


def _parameters(found: SelfCalibration) -> ReportTable:
    def t_cell(p: Parameter) -> Cell:
        return number_cell(p.t, f"{p.t:.2f}", "good" if p.significant else "")

    columns = [
        (ColumnHead("Parameter", numeric=False), lambda p: text_cell(p.name)),
        (ColumnHead("Value"), lambda p: _small(p.value, p.unit)),
        (ColumnHead("σ"), lambda p: _small(p.sigma, p.unit)),
        (ColumnHead("Unit", numeric=False), lambda p: text_cell(shown_unit(p.unit))),
        (ColumnHead("t"), t_cell),
    ]
    note = f"True = measured + correction. Sigmas {found.sigma_origin}. Significant t are green."
    return build_table("parameters", "Parameters", note, found.parameters, columns)


def _left(found: SelfCalibration) -> ReportTable:
    items = [*found.proposal.left, *found.proposal.hardly]
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda i: text_cell(i.name)),
        (ColumnHead("Why", numeric=False), lambda i: text_cell(i.why)),
    ]
    note = "Proposed to be left out: what cannot be separated, then what hardly can."
    return build_table("left", "Not or hardly separated", note, items, columns)


def _omitted(found: SelfCalibration) -> ReportTable:
    def w_cell(o: Omitted) -> Cell:
        return number_cell(o.w, f"{o.w:.2f}", "bad" if o.missing else "")

    columns = [
        (ColumnHead("Parameter", numeric=False), lambda o: text_cell(o.name)),
        (ColumnHead("Would be"), lambda o: _small(o.value, unit_of(o.name))),
        (ColumnHead("σ"), lambda o: _small(o.sigma, unit_of(o.name))),
        (ColumnHead("Unit", numeric=False), lambda o: text_cell(shown_unit(unit_of(o.name)))),
        (ColumnHead("w"), w_cell),
        (ColumnHead("limit"), lambda o: number_cell(o.limit, f"{o.limit:.2f}")),
    ]
    note = "Each as the only further parameter, from the residuals. Red: they call for it."
    return build_table("omitted", "Parameters that are no unknowns", note, found.omitted, columns)


def _pairs(found: SelfCalibration) -> ReportTable:
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda p: text_cell(p.a)),
        (ColumnHead("and", numeric=False), lambda p: text_cell(p.b)),
        (
            ColumnHead("Correlation"),
            lambda p: number_cell(p.value, f"{p.value:+.3f}", "bad" if abs(p.value) > 0.9 else ""),
        ),
    ]
    note = "Above 0.7, strongest first; those with orientations belong to the datum."
    return build_table(
        "correlations", "Correlations", note, found.correlations.pairs, columns, most=500
    )


def _datum_parameters(found: SelfCalibration) -> ReportTable:
    rows = list(range(len(found.parameters))) if len(found.datums) > 1 else []
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda k: text_cell(found.names[k])),
        (
            ColumnHead("Unit", numeric=False),
            lambda k: text_cell(shown_unit(found.parameters[k].unit)),
        ),
        *[
            (
                ColumnHead(f"σ, {d.datum}"),
                lambda k, d=d: _small(float(d.parameters[k]), found.parameters[k].unit),
            )
            for d in found.datums
        ],
    ]
    note = "A priori. Estimable parameters have the same sigma in every datum."
    return build_table("datum-parameters", "Parameters in other datums", note, rows, columns)


def _datum_stations(found: SelfCalibration) -> ReportTable:
    layout = found.adjustment.layout
    names = layout.names["pose"]
    rows = [(d, s) for d in found.datums for s in range(len(names))] if found.datums else []
    if len(found.datums) > 1:
        rows += [(d, -1) for d in found.datums]

    def value(row: tuple[Any, int], k: int) -> Cell:
        d, s = row
        if s < 0:
            mean = float(np.sqrt((d.points[:, k] ** 2).mean())) if k < 3 else float("nan")
            return number_cell(mean if k < 3 else None, f"{1e3 * mean:.3f}")
        scale = 1e3 if k < 3 else 1 / SEC
        return number_cell(float(d.stations[s, k]), f"{scale * d.stations[s, k]:.3f}")

    heads = ("E [mm]", "N [mm]", "U [mm]", "tilt E [″]", "tilt N [″]", "heading [″]")
    columns = [
        (ColumnHead("Datum", numeric=False), lambda row: text_cell(row[0].datum)),
        (
            ColumnHead("Station", numeric=False),
            lambda row: text_cell(names[row[1]] if row[1] >= 0 else "mean of points"),
        ),
        *[(ColumnHead(f"σ {h}"), lambda row, k=k: value(row, k)) for k, h in enumerate(heads)],
    ]
    note = "A priori. The same observations; only what is held differs."
    return build_table("datum-stations", "Stations and points by datum", note, rows, columns)


def _datum_points(found: SelfCalibration) -> ReportTable:
    """Three-dimensional sigma of every point in every datum."""
    names = found.adjustment.layout.names["point"]
    sigmas = [np.sqrt((d.points**2).sum(axis=1)) for d in found.datums]
    columns = [
        (ColumnHead("Point", numeric=False), lambda k: text_cell(names[k])),
        *[
            (ColumnHead(f"σ 3D, {d.datum}", "mm"), lambda k, s=s: _small(float(s[k]), "m"))
            for d, s in zip(found.datums, sigmas, strict=True)
        ],
    ]
    note = "A priori. What a point is known by depends on what it is referred to."
    rows = list(range(len(names))) if len(found.datums) > 1 else []
    return build_table("datum-points", "Points by datum", note, rows, columns, most=2000)


def _remedies(found: SelfCalibration) -> ReportTable:
    own = dict(zip(found.proposal.names, found.proposal.sigma, strict=True))

    def largest(remedy: Remedy) -> float:
        """Largest fall of a sigma."""
        p = remedy.proposal
        ratios = [own[n] / s for n, s in zip(p.names, p.sigma, strict=True) if n in own and s > 0]
        return float(max(ratios, default=1.0))

    columns = [
        (ColumnHead("Addition", numeric=False), lambda r: text_cell(r.what)),
        (ColumnHead("Estimable"), lambda r: count_cell(len(r.proposal.names))),
        (ColumnHead("Well separated"), lambda r: count_cell(len(r.proposal.recommended))),
        (
            ColumnHead("Best gain"),
            lambda r: number_cell(largest(r), f"sigma divided by {largest(r):.1f}"),
        ),
    ]
    note = (
        f"Now {len(found.proposal.names)} are estimable and {len(found.proposal.recommended)} of "
        "them well separated. Tried out on the design, without observations."
    )
    return build_table("remedies", "What would help", note, found.remedies, columns)


def calibration_document(title: str, found: SelfCalibration) -> CalibrationDocument:
    """The calibration as data; metres, radians and their squares."""
    a = found.adjustment
    data = heading(SCHEMA) | {
        "title": title,
        "datum": found.datum_words,
        "sigma_origin": found.sigma_origin,
        "sigma0": {
            "prior": a.sigma0,
            "posterior": number(a.sigma0_posterior),
            "dof": a.dof,
            "vtpv": a.vtpv,
        },
        "counts": {
            "observed": a.n_observations,
            "unknowns": a.n_unknowns,
            "constraints": a.n_constraints,
            "defect": a.defect,
        },
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit,
                "value": p.value,
                "sigma": p.sigma,
                "t": number(p.t),
                "significant": p.significant,
            }
            for p in found.parameters
        ],
        "covariance": matrix(found.covariance),
        "stations": _stations_json(found),
        "open": list(found.estimability.open),
        "closed_by_datum": list(found.estimability.datum),
        "left_out": [_left_json(i) for i in found.proposal.left],
        "hardly_separated": [_left_json(i) for i in found.proposal.hardly],
        "proposed": list(found.suggested),
        "remedies": [_remedy_json(r) for r in found.remedies],
        "tests": {
            "together": _test_json(found.together),
            "gain": _test_json(found.gain),
            "stations_differ": _test_json(found.differ),
            "omitted": [_omitted_json(o) for o in found.omitted],
        },
        "correlations": [_pair_json(p) for p in found.correlations.pairs],
        "datums": [
            {
                "datum": d.datum,
                "parameters": numbers(d.parameters),
                "stations": matrix(d.stations),
                "points": dict(zip(a.layout.names["point"], matrix(d.points), strict=True)),
                "distances": numbers(d.distances),
            }
            for d in found.datums
        ],
        "sentences": calibration_sentences(found),
    }
    return CalibrationDocument.model_validate(data)


def _stations_json(found: SelfCalibration) -> dict[str, Any]:
    """Poses with their covariance, left increments."""
    a = found.adjustment
    blocks = found.factor * a.family_covariances("pose")
    out = {}
    for k, name in enumerate(a.layout.names["pose"]):
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = a.state.pose_r[k], a.state.pose_t[k]
        out[name] = {"world_from_scanner": frame.tolist(), "covariance": matrix(blocks[k])}
    return out


def _left_json(item: Left) -> dict[str, str]:
    return {"name": item.name, "why": item.why}


def _remedy_json(remedy: Remedy) -> dict[str, Any]:
    return {
        "what": remedy.what,
        "estimable": list(remedy.proposal.names),
        "well_separated": list(remedy.proposal.recommended),
        "sigma": numbers(remedy.proposal.sigma),
    }


def _test_json(test: BlockTest | None) -> dict[str, Any] | None:
    if test is None:
        return None
    return {
        "freedom": test.freedom,
        "redundancy": test.redundancy,
        "statistic": number(test.statistic),
        "p": number(test.p),
        "kind": "F" if test.posterior else "chi-square over freedom",
    }


def _omitted_json(o: Omitted) -> dict[str, Any]:
    return {"name": o.name, "value": o.value, "sigma": o.sigma, "w": o.w, "limit": o.limit}


def _pair_json(pair: CorrelatedPair) -> dict[str, Any]:
    return {"a": pair.a, "b": pair.b, "value": pair.value}
