"""The chapter on side shots: points that are computed from the adjusted network."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from tribrach.network.facts import facts_of
from tribrach.network.side_shots import ComputedShot, SideShots, compute
from tribrach.report.chapter import Chapter
from tribrach.report.content import Head
from tribrach.report.numbers import counted, fixed_cell, matrix, mm_cell, triple
from tribrach.report.schema.base import DocumentPart, Matrix, Triple
from tribrach.report.subject import Subject
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

__all__ = ["SUBJECT", "SideShotPart"]

#: shots that a sentence names
_NAMED = 5


class SideShotPart(DocumentPart):
    """A point that a side shot gives: coordinates [m] and covariance [m^2] of the work frame.

    ``projected`` are easting, northing and height in the grid of the site, if it has one.
    """

    name: str
    source: str
    xyz: Triple
    covariance: Matrix
    projected: Triple | None = None


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
    parts = [
        SideShotPart(
            name=shot.name,
            source=shot.source,
            xyz=triple(shot.xyz),
            covariance=[list(row) for row in matrix(head.variance_factor * shot.covariance)],
            projected=None if grid is None else triple(grid.from_work(shot.xyz[None])[0]),
        )
        for shot in shots
    ]
    tables = (_table(head, shots, parts),) if shots else ()
    yield Chapter("side_shots", "Side shots", tuple(sentences), (), tables, parts)


def _table(head: Head, shots: list[ComputedShot], parts: list[SideShotPart]) -> ReportTable:
    """Coordinates of the grid, or of the work frame, with their sigmas."""
    grid = head.adjustment.network.reference.grid
    rows = []
    for shot, part in zip(shots, parts, strict=True):
        jacobian = np.eye(3) if grid is None else grid.jacobian(shot.xyz)
        turned = jacobian @ shot.covariance @ jacobian.T
        sigma = np.sqrt(np.maximum(head.variance_factor * np.diag(turned), 0.0))
        rows.append((part, part.xyz if part.projected is None else part.projected, sigma))
    axes = "ENU" if grid is None else "ENH"
    columns = [
        (ColumnHead("Point", numeric=False), lambda r: text_cell(r[0].name)),
        *((ColumnHead(axes[k], "m"), lambda r, k=k: fixed_cell(r[1][k], 4)) for k in range(3)),
        *((ColumnHead(f"σ{axes[k]}", "mm"), lambda r, k=k: mm_cell(r[2][k])) for k in range(3)),
        (ColumnHead("Source", numeric=False), lambda r: text_cell(r[0].source)),
    ]
    return build_table("side-shots", "Side shots", "", rows, columns)


SUBJECT = Subject("side_shots", _chapters, list[SideShotPart])
