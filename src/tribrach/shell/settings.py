"""The options of commands that adjust: ``run`` and ``adjust`` have the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from tribrach.network.network import Datum
    from tribrach.project import Project


@dataclass(frozen=True, kw_only=True)
class Adjusting:
    """What is to be done with a network besides what a project says; None where nothing is said."""

    datum: Annotated[
        str | None, typer.Option(help="control, free, free:A,B,C (inner constraints) or fixed:A,B.")
    ] = None
    snoop: Annotated[
        bool | None, typer.Option("--snoop/--no-snoop", help="Switch blunders off, one by one.")
    ] = None
    robust: Annotated[
        Literal["none", "huber", "danish", "igg3"] | None,
        typer.Option(help="Weigh what departs down, which points at blunders."),
    ] = None
    vce: Annotated[
        bool | None,
        typer.Option("--vce/--no-vce", help="Weigh the groups anew by variance components."),
    ] = None
    confidence: Annotated[
        float | None,
        typer.Option(
            min=0.5, max=0.9999, help="Probability of ellipses, intervals and tests, 0.95."
        ),
    ] = None
    posterior: Annotated[
        bool | None,
        typer.Option("--posterior/--prior", help="Scale sigmas by sigma0 a posteriori."),
    ] = None
    angle: Annotated[
        Literal["gon", "deg"] | None,
        typer.Option(help="Unit of angles in reports; gon if not given."),
    ] = None

    @property
    def given(self) -> dict[str, Any]:
        """Settings of an adjustment that somebody gave."""
        return {k: v for k, v in vars(self).items() if v is not None and k != "datum"}

    @property
    def other_datum(self) -> Datum | None:
        """The datum that is to take the place of the network's own."""
        if self.datum is None:
            return None
        from tribrach.project import parse_datum

        return parse_datum(self.datum)

    def of_project(self, project: Project) -> Project:
        """A project in which these options take the place of what its file says."""
        from tribrach.project import DatumSection

        options, datum = self.given, self.other_datum
        steps = {k: v for k, v in options.items() if k in ("snoop", "robust", "vce", "posterior")}
        changed: dict[str, Any] = {"adjustment": project.adjustment.model_copy(update=steps)}
        if "confidence" in options:
            changed["confidence"] = options["confidence"]
        if "angle" in options:
            changed["output"] = project.output.model_copy(update={"angle": options["angle"]})
        if datum is not None:
            changed["datum"] = DatumSection(kind=datum.kind, points=tuple(datum.names))
        return project.model_copy(update=changed)
