"""The chapter on side shots: points that are computed from the adjusted network."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.answers import Matrix, Result, Vector
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.network.facts import facts_of
from tribrach.network.side_shots import ComputedShot, SideShots, compute
from tribrach.report.chapter import Chapter
from tribrach.report.columns import column, component
from tribrach.report.content import Head
from tribrach.report.numbers import counted
from tribrach.report.subject import Subject
from tribrach.report.tables import ReportTable, build_table

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: shots that a sentence names
_NAMED = 5


@dataclass(frozen=True)
class SideShotPart(Result, without=("place", "sigma"), maybe=("projected",)):
    """A point that a side shot gives: coordinates [m] and covariance [m^2] of the work frame."""

    name: str
    source: str
    xyz: Vector
    covariance: Matrix
    #: what a table shows, in the grid or in the work frame
    place: Vector
    sigma: Vector
    #: easting, northing and height in the grid of the site, if it has one
    projected: Vector | None = None


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where side shots were measured."""
    shots: list[ComputedShot] = []
    left_out: dict[str, str] = {}
    for fact in facts_of(head.adjustment.network.facts, SideShots):
        computed, others = compute(head.adjustment, fact)
        shots += computed
        left_out |= others
    if not shots and not left_out:
        return
    sentences = []
    if shots:
        several = "points are" if len(shots) > 1 else "point is"
        sentences.append(
            f"{len(shots)} {several} computed by side shots from the adjusted network. They take "
            "no part in it and nothing controls them."
        )
    if left_out:
        some = [f"{source}: {why}" for source, why in list(left_out.items())[:_NAMED]]
        more = f"; and {len(left_out) - _NAMED} more" if len(left_out) > _NAMED else ""
        listed = "; ".join(some) + more
        sentences.append(f"{counted(len(left_out), 'side shot')} cannot be computed: {listed}.")
    grid = head.adjustment.network.reference.grid
    parts = [_part(shot, grid, head.variance_factor) for shot in shots]
    tables = (_table(parts, "ENU" if grid is None else "ENH"),) if parts else ()
    yield Chapter("side_shots", "Side shots", tuple(sentences), (), tables, parts)


def _part(shot: ComputedShot, grid: OutputFrame | None, factor: float) -> SideShotPart:
    """A point with what its table shows."""
    covariance = factor * shot.covariance
    projected = None if grid is None else grid.from_work(shot.xyz[None])[0]
    jacobian = np.eye(3) if grid is None else grid.jacobian(shot.xyz)
    sigma = np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
    place = shot.xyz if projected is None else projected
    return SideShotPart(shot.name, shot.source, shot.xyz, covariance, place, sigma, projected)


def _table(parts: list[SideShotPart], axes: str) -> ReportTable:
    """Coordinates of the grid, or of the work frame, with their sigmas."""
    columns = [
        column("Point", "name"),
        *(column(axes[k], component("place", k), "m4") for k in range(3)),
        *(column(f"σ{axes[k]}", component("sigma", k), "mm2") for k in range(3)),
        column("Source", "source"),
    ]
    return build_table("side-shots", "Side shots", "", parts, columns)


SUBJECT = Subject("side_shots", _chapters, list[SideShotPart])
