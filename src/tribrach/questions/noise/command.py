"""The command noise: the noise of a scanner from its own scans."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.instrument_sheets import find_sheet
from tribrach.io.scans.formats import read_scans
from tribrach.project import Project
from tribrach.project.instrument import noise_of
from tribrach.project.instrument_file import instrument_file_text
from tribrach.questions.noise.chapters import answer_of
from tribrach.questions.noise.estimate import NoiseEstimate, estimate_noise
from tribrach.report.answer import Answer
from tribrach.scan.no_return import screened
from tribrach.scan.prepared import seen_from
from tribrach.shell.command import WRITTEN, command


@command(html="Write a page with a plot.", scans=True)
def noise(
    files: Annotated[list[Path], typer.Argument(help="Scans of one scanner in one mode.")],
    sheet: Annotated[
        str | None, typer.Option(help="A model whose data sheet is compared, with its beam.")
    ] = None,
    project: Annotated[
        Path | None, typer.Option(help="A project whose instrument is compared instead.")
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Its name there, where it has several scanners.")
    ] = None,
    origin: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the scanner stood in the coordinates of the files in metres."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write an instrument file (.toml) for projects."), WRITTEN
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Estimate the noise of a scanner from planes in its scans: a law for each point."""
    stated, stated_by = _stated(sheet, project, name)
    scans = [
        screened(one if origin is None else seen_from(one, origin))
        for path in files
        for one in read_scans(path)
    ]
    estimate = estimate_noise(scans, stated, stated_by, progress)
    answer = answer_of(estimate)
    if out is None:
        return answer
    wrong = [str(one.words) for one in answer.findings if one.key == "contradicted"][:1]
    if not (estimate.doubts or wrong):
        return replace(answer, files={out: _instrument(estimate, sheet)})
    failure = InputError(
        "these scans do not tell the noise of the scanner: "
        + "; ".join(estimate.doubts or wrong).removesuffix("."),
        cure="take scans with smooth walls or floors at several ranges, or leave --out away",
    )
    return replace(answer, failure=failure, refuses=True)


def _stated(
    sheet: str | None, project: Path | None, name: str | None
) -> tuple[ScanNoise | None, str]:
    """The noise to compare with, and what states it."""
    if sheet is not None and project is not None:
        raise InputError("--sheet and --project both state a noise", cure="give one of them")
    if sheet is not None:
        return noise_of(sheet), f"the data sheet of {find_sheet(sheet).name}"
    if project is None:
        return None, ""
    instruments = Project.load(project).instruments
    noises = {key: one.noise() for key, one in instruments.items()}
    known = {key: one for key, one in noises.items() if one is not None}
    if name is None and len(known) == 1:
        name = next(iter(known))
    if name not in known:
        names = ", ".join(known) or "none"
        raise InputError(
            "the project has no one scanner to compare with"
            if name is None
            else f"the project has no scanner {name} with a noise",
            file=project,
            cure=f"name one with --name; there are {names}",
        )
    return known[name], f"the project for {name}"


def _instrument(estimate: NoiseEstimate, sheet: str | None) -> str:
    """The instrument file."""
    if sheet is not None:  # it gives what the scans do not
        return instrument_file_text(estimate.instrument, estimate.source, find_sheet(sheet).name)
    source, carried = estimate.source, estimate.carried()
    if carried:
        source += f"; {', '.join(carried)} as {estimate.stated_by} states them"
    return instrument_file_text({**estimate.instrument, **carried}, source)
