"""Other unknowns: orientations, calibration, lever arms, planes (report chapter 12)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from tribrach.instruments.calibration import unit_of
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Observations
from tribrach.report.content import ReportSettings, Unknown
from tribrach.report.numbers import matrix, numbers, sigmas
from tribrach.report.summary import variance_factor

__all__ = ["other_unknowns"]


#: unit and name of what a scalar is, by the field of the observation kind that refers to it
_ROLES = {
    "orientation": ("rad", "orientation"),
    "offset": ("rad", "azimuth offset"),
    "zero": ("m", "distance zero"),
    "scale": ("1", "scale"),
    "refraction_unknown": ("1", "refraction"),
    "height_instrument_unknown": ("m", "instrument height correction"),
    "height_target_unknown": ("m", "target height correction"),
    "slope_1": ("1", "axis slope"),
    "slope_2": ("1", "axis slope"),
    "along": ("m", "distance along the axis"),
    "radius": ("m", "radius"),
    "offset_x": ("rad", "inclination offset"),
    "offset_y": ("rad", "inclination offset"),
    "xi_error": ("rad", "deflection of the vertical"),
    "eta_error": ("rad", "deflection of the vertical"),
}
_VECTORS = {"lever_arm": "lever arm", "common": "common shift"}


def other_unknowns(adjustment: Adjustment, settings: ReportSettings) -> tuple[Unknown, ...]:
    """Scalars, vectors and planes, in this order."""
    factor = variance_factor(adjustment, settings)
    return (
        *_scalars(adjustment, factor),
        *_vectors(adjustment, factor),
        *_planes(adjustment, factor),
    )


def _references(
    adjustment: Adjustment, family: str
) -> Iterator[tuple[Observations, str, int, int]]:
    """Table, field, unknown and first observation wherever a table refers to a family."""
    for o in adjustment.network.observations:
        for item in fields(o):
            if item.metadata.get("refers") == family and len(o):
                index = getattr(o, item.name).reshape(len(o), -1)
                used, first = np.unique(index, return_index=True)
                for i, flat in zip(used.tolist(), first.tolist(), strict=True):
                    if i >= 0:
                        yield o, item.name, i, flat // index.shape[1]


def _scalar_roles(adjustment: Adjustment) -> dict[int, tuple[str, str, str]]:
    """Unit, role and place of each scalar index, from the first observation that refers to it."""
    out: dict[int, tuple[str, str, str]] = {}
    ends: dict[int, list[tuple[str, str]]] = {}
    for o, name, i, item in _references(adjustment, "scalar"):
        unit, role = _ROLES.get(name, ("1", "parameter"))
        if name == "common":
            unit, role = o.units[0], "common value"
        if name == "parameters":
            parameter = adjustment.layout.names["scalar"][i].split("(")[0]
            unit, role = unit_of(parameter), "calibration"
        if role != "parameter" and i not in out:
            if role == "orientation" and id(o) not in ends:
                ends[id(o)] = o.ends(adjustment.layout)
            out[i] = unit, role, ends[id(o)][item][0] if role == "orientation" else ""
    return out


def _scalars(adjustment: Adjustment, factor: float) -> list[Unknown]:
    names = adjustment.layout.names["scalar"]
    covariance = adjustment.family_covariances("scalar") * factor
    roles = _scalar_roles(adjustment)
    out = []
    for i, name in enumerate(names):
        unit, role, at = roles.get(i, ("1", "parameter", ""))
        value = float(adjustment.state.scalars[i])
        if role == "orientation":
            value = value % (2 * np.pi) % (2 * np.pi)  # the second brings 2 pi itself to 0
        sigma = numbers(sigmas(covariance[i]))
        out.append(
            Unknown(name, "scalar", role, (value,), sigma, (unit,), matrix(covariance[i]), at)
        )
    return out


def _vectors(adjustment: Adjustment, factor: float) -> list[Unknown]:
    covariance = adjustment.family_covariances("vector") * factor
    roles = {i: _VECTORS[f] for _, f, i, _ in _references(adjustment, "vector") if f in _VECTORS}
    return [
        Unknown(
            name,
            "vector",
            roles.get(i, "vector"),
            tuple(adjustment.state.vectors[i].tolist()),
            numbers(sigmas(covariance[i])),
            ("m", "m", "m"),
            matrix(covariance[i]),
        )
        for i, name in enumerate(adjustment.layout.names["vector"])
    ]


def _planes(adjustment: Adjustment, factor: float) -> list[Unknown]:
    """Normal and offset; their sigmas and covariance are of the tangent (two turns, offset)."""
    covariance = adjustment.family_covariances("plane") * factor
    state = adjustment.state
    return [
        Unknown(
            name,
            "plane",
            "plane",
            (*state.plane_n[i].tolist(), float(state.plane_d[i])),
            numbers(sigmas(covariance[i])),
            ("1", "1", "1", "m"),
            matrix(covariance[i]),
        )
        for i, name in enumerate(adjustment.layout.names["plane"])
    ]
