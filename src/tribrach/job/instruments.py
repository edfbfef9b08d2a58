"""The figures of a project's instruments, for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribrach.report.content import InstrumentFigure

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["instrument_figures"]


def instrument_figures(project: Project) -> tuple[InstrumentFigure, ...]:
    """Every figure that the project or a data sheet gives, instrument by instrument."""
    return tuple(
        InstrumentFigure(
            name, instrument.sheet or "", figure.key, figure.value, figure.source, figure.published
        )
        for name, instrument in project.instruments.items()
        for figure in instrument.figures()
    )
