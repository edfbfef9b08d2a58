"""The chapter on the stations as one rigid model, beside their adjustment.

What published chains deliver can so be compared with what everything adjusted together gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.answers import Matrix, Result
from tribrach.job.rigid_placing import adjusted_place
from tribrach.network.adjustment import Adjustment
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet, component
from tribrach.report.content import Head
from tribrach.report.subject import Subject
from tribrach.report.tables import Spec, build_table
from tribrach.report.warnings import Severity, warned
from tribrach.sentences import Sentence

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.registration.rigid_model import RigidModel

_TITLE = "The stations as one rigid model"


@dataclass(frozen=True)
class RigidPosePart(Result):
    """The pose of a station in the rigid model, 4 x 4, with its covariance 6 x 6."""

    world_from_scanner: Matrix
    covariance: Matrix


@dataclass(frozen=True, kw_only=True)
class RigidModelPart(Result):
    """All stations moved as one body [m]."""

    parameters: int
    sigma0: float | None
    dof: int
    check_rms_rigid: float | None
    check_rms_adjusted: float | None
    poses: dict[str, RigidPosePart]


@dataclass(frozen=True)
class _Row:
    name: str
    use: str
    rigid: tuple[float, ...]
    adjusted: tuple[float, ...]


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where stations make such a model; a warning where they make none."""
    if job.antennas is None:
        return
    if job.antennas.rigid is not None:
        yield _chapter(job.antennas.rigid, head.adjustment, head.columns)
    elif job.antennas.obstacle:
        text = "The stations make no rigid model by themselves: " + job.antennas.obstacle
        warnings = warned(Severity.WEAK, [text], "no_rigid_model")
        yield Chapter("rigid_model", _TITLE, warnings=warnings)


def _chapter(rigid: RigidModel, adjustment: Adjustment, columns: ColumnSet) -> Chapter:
    """Differences of both solutions at every place that is known without scans."""
    rows = [
        _Row(
            place.name,
            "check" if check else "control",
            tuple(difference),
            tuple(place.xyz - adjusted_place(adjustment, place)),
        )
        for place, check, difference in zip(
            rigid.places, rigid.fit.points.check, rigid.fit.difference, strict=True
        )
    ]
    specs: list[Spec] = [columns.word("Place", "name"), columns.word("Use", "use")]
    for head, path in (("rigid", "rigid"), ("adjusted", "adjusted")):
        specs += [columns.mm(f"Δ{axis} {head}", component(path, k)) for k, axis in enumerate("ENU")]
    note = (
        "Measured without scans minus placed. Rigid: the model of all stations moved as one body. "
        "Adjusted: everything in one network, as the clouds are."
    )
    table = build_table("rigid-model", "Rigid model and adjustment", note, rows, specs)
    poses = {
        name: RigidPosePart(rigid.pose(name).matrix, rigid.covariance(name))
        for name in rigid.model.layout.names["pose"]
    }
    part = RigidModelPart(
        parameters=rigid.fit.model.count,
        sigma0=rigid.fit.sigma0,
        dof=rigid.fit.dof,
        check_rms_rigid=_rms(rows, "check", "rigid"),
        check_rms_adjusted=_rms(rows, "check", "adjusted"),
        poses=poses,
    )
    return Chapter("rigid_model", _TITLE, _sentences(rigid, rows, adjustment), (), (table,), part)


def _rms(rows: Sequence[_Row], use: str, path: str) -> float | None:
    values = [getattr(row, path) for row in rows if row.use == use]
    return float(np.sqrt((np.array(values) ** 2).mean())) if values else None


def _sentences(model: RigidModel, rows: Sequence[_Row], adjustment: Adjustment) -> tuple[str, ...]:
    fit, n = model.fit, sum(row.use == "control" for row in rows)
    sigma0 = (
        "without redundancy" if fit.sigma0 is None else Sentence("sigma0 {fit.sigma0:2}", fit=fit)
    )
    residual = _rms(rows, "control", "rigid") or 0.0
    out = [
        Sentence(
            "The stations as one rigid body are placed by {n} places with "
            "{fit.model.count} parameters: {sigma0} with redundancy {fit.dof}, residuals "
            "of {residual:mm1} a coordinate (root mean square of all, none left out by a "
            "limit; a fit, no accuracy).",
            n=n,
            fit=fit,
            sigma0=sigma0,
            residual=residual,
        ),
    ]
    rigid, adjusted = _rms(rows, "check", "rigid"), _rms(rows, "check", "adjusted")
    if rigid is not None and adjusted is not None:
        out.append(
            Sentence(
                "Check places differ by {rigid:mm1} a coordinate from the rigid model and by "
                "{adjusted:mm1} from the adjustment of everything (root mean squares of all "
                "check places, none left out by a limit).",
                rigid=rigid,
                adjusted=adjusted,
            )
        )
    names = model.model.layout.names["pose"]
    state, layout = adjustment.state, adjustment.layout
    shift = [
        model.pose(name).translation - state.pose_t[layout.index("pose", name)] for name in names
    ]
    size = np.linalg.norm(shift, axis=1)
    worst = int(np.argmax(size))
    out.append(
        Sentence(
            "The two solutions differ most at {names}, by {size:mm1}: so much the model "
            "bends there; clouds are placed by the adjustment.",
            names=names[worst],
            size=size[worst],
        )
    )
    return tuple(out)


SUBJECT = Subject("rigid_model", _chapters, RigidModelPart)
