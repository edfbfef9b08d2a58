"""The options of commands that adjust: ``run`` and ``adjust`` have the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = [
    "Angle",
    "Confidence",
    "DatumWords",
    "Posterior",
    "Robust",
    "Snoop",
    "Vce",
    "given",
    "with_options",
]

DatumWords = Annotated[
    str | None, typer.Option(help="control, free, free:A,B,C (inner constraints) or fixed:A,B.")
]
Snoop = Annotated[
    bool | None, typer.Option("--snoop/--no-snoop", help="Switch blunders off, one by one.")
]
Robust = Annotated[
    Literal["none", "huber", "danish", "igg3"] | None,
    typer.Option(help="Weigh what departs down, which points at blunders."),
]
Vce = Annotated[
    bool | None,
    typer.Option("--vce/--no-vce", help="Weigh the groups anew by variance components."),
]
Confidence = Annotated[
    float | None,
    typer.Option(min=0.5, max=0.9999, help="Probability of ellipses, intervals and tests, 0.95."),
]
Posterior = Annotated[
    bool | None, typer.Option("--posterior/--prior", help="Scale sigmas by sigma0 a posteriori.")
]
Angle = Annotated[
    Literal["gon", "deg"] | None, typer.Option(help="Unit of angles in reports; gon if not given.")
]


def given(**options: Any) -> dict[str, Any]:
    """The options that somebody gave."""
    return {key: value for key, value in options.items() if value is not None}


def with_options(project: Project, options: dict[str, Any], datum: str | None) -> Project:
    """A project in which options of the command line take the place of what its file says."""
    from tribrach.project import DatumSection, parse_datum

    steps = {k: v for k, v in options.items() if k in ("snoop", "robust", "vce", "posterior")}
    changed: dict[str, Any] = {"adjustment": project.adjustment.model_copy(update=steps)}
    if "confidence" in options:
        changed["confidence"] = options["confidence"]
    if "angle" in options:
        changed["output"] = project.output.model_copy(update={"angle": options["angle"]})
    if datum is not None:
        words = parse_datum(datum)
        changed["datum"] = DatumSection(kind=words.kind, points=tuple(words.names))
    return project.model_copy(update=changed)
