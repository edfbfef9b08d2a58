"""How the numbers of a report are written, as its project wants them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribrach.sentences import Notation

if TYPE_CHECKING:
    from tribrach.report.content import Report


def notation_of(content: Report) -> Notation:
    """The notation that the project of a report asks for."""
    project, angle = content.job.project, content.settings.angle
    if project is None:
        return Notation(angle=angle)
    return Notation(project.output.decimal, project.output.thousands, angle)
