"""The stations as one rigid model beside their adjustment: a chapter, and the poses of that model.

What published chains deliver can so be compared with what everything adjusted together gives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.registration.outer_places import OuterPlace
from tribrach.registration.rigid_model import RigidModel, rigid_model
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet, Spec
from tribrach.report.style import Style
from tribrach.report.tables import build_table

__all__ = ["adjusted_place", "place_rigidly", "rigid_chapter"]


def place_rigidly(survey: Survey, adjustment: Adjustment) -> RigidModel:
    """The rigid model of a survey, with the lever arms of its adjustment.

    Raises
    ------
    AdjustmentError, InputError : as :func:`~tribrach.registration.rigid_model.rigid_model`.
    """
    names = adjustment.layout.names["vector"]
    arms = dict(zip(names, adjustment.state.vectors, strict=True))
    return rigid_model(survey, arms)


def adjusted_place(adjustment: Adjustment, place: OuterPlace) -> Array:
    """Where a place is after the adjustment of everything (3,)."""
    state, layout = adjustment.state, adjustment.layout
    if not place.station:
        point: Array = state.points[layout.index("point", place.name)]
        return point
    k = layout.index("pose", place.station)
    arm = state.vectors[layout.index("vector", place.arm)]
    end: Array = state.pose_t[k] + state.pose_r[k] @ arm
    return end


@dataclass(frozen=True)
class _Row:
    name: str
    use: str
    rigid: tuple[float, ...]
    adjusted: tuple[float, ...]


def rigid_chapter(found: RigidModel, adjustment: Adjustment, angle: str) -> Chapter:
    """Differences of both solutions at every place that is known without scans."""
    rows = [
        _Row(
            place.name,
            "check" if check else "control",
            tuple(difference),
            tuple(place.xyz - adjusted_place(adjustment, place)),
        )
        for place, check, difference in zip(
            found.places, found.fit.points.check, found.fit.difference, strict=True
        )
    ]
    columns = ColumnSet(Style("deg" if angle == "deg" else "gon"))
    specs: list[Spec] = [columns.word("Place", "name"), columns.word("Use", "use")]
    for head, path in (("rigid", "rigid"), ("adjusted", "adjusted")):
        specs += [
            columns.mm(f"Δ{axis} {head}", _component(path, k)) for k, axis in enumerate("ENU")
        ]
    note = (
        "Measured without scans minus placed. Rigid: the model of all stations moved as one body. "
        "Adjusted: everything in one network, as the clouds are."
    )
    table = build_table("rigid-model", "Rigid model and adjustment", note, rows, specs)
    data = {
        "parameters": found.fit.model.count,
        "sigma0": found.fit.sigma0,
        "dof": found.fit.dof,
        "check_rms_rigid": _rms(rows, "check", "rigid"),
        "check_rms_adjusted": _rms(rows, "check", "adjusted"),
        "poses": {
            name: {
                "world_from_scanner": found.pose(name).matrix.tolist(),
                "covariance": found.covariance(name).tolist(),
            }
            for name in found.model.layout.names["pose"]
        },
    }
    sentences = _sentences(found, rows, adjustment)
    title = "The stations as one rigid model"
    return Chapter("rigid_model", title, sentences, (), (table,), data)


def _component(path: str, k: int) -> Callable[[_Row], float]:
    return lambda row: float(getattr(row, path)[k])


def _rms(rows: Sequence[_Row], use: str, path: str) -> float | None:
    values = [getattr(row, path) for row in rows if row.use == use]
    return float(np.sqrt((np.array(values) ** 2).mean())) if values else None


def _sentences(found: RigidModel, rows: Sequence[_Row], adjustment: Adjustment) -> tuple[str, ...]:
    fit, n = found.fit, sum(row.use == "control" for row in rows)
    sigma0 = "without redundancy" if fit.sigma0 is None else f"sigma0 {fit.sigma0:.2f}"
    residual = 1e3 * (_rms(rows, "control", "rigid") or 0.0)
    out = [
        f"The stations as one rigid body are placed by {n} places with {fit.model.count} "
        f"parameters: {sigma0} with redundancy {fit.dof}, residuals of {residual:.1f} mm a "
        "coordinate (a fit, no accuracy).",
    ]
    rigid, adjusted = _rms(rows, "check", "rigid"), _rms(rows, "check", "adjusted")
    if rigid is not None and adjusted is not None:
        out.append(
            f"Check places differ by {1e3 * rigid:.1f} mm a coordinate from the rigid model and by "
            f"{1e3 * adjusted:.1f} mm from the adjustment of everything."
        )
    names = found.model.layout.names["pose"]
    state, layout = adjustment.state, adjustment.layout
    shift = [
        found.pose(name).translation - state.pose_t[layout.index("pose", name)] for name in names
    ]
    size = np.linalg.norm(shift, axis=1)
    worst = int(np.argmax(size))
    out.append(
        f"The two solutions differ most at {names[worst]}, by {1e3 * size[worst]:.1f} mm: so much "
        "the model bends there; clouds are placed by the adjustment."
    )
    return tuple(out)
