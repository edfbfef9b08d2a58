"""The command check: tests a scanner in the field by faces, distances, series and lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.calibration.field_check import check_readings
from tribrach.errors import InputError
from tribrach.project.instrument import Instrument
from tribrach.questions.check.chapters import answer_of
from tribrach.questions.check.readings import (
    known_lengths,
    noise_of,
    read_earlier,
    read_lengths,
    readings_of,
    survey_to_check,
)
from tribrach.report.answer import Answer
from tribrach.shell.command import command


@command(html="Write a page with charts.")
def check(
    source: Annotated[
        Path, typer.Argument(metavar="PROJECT-OR-CSV", help="A project, or a table of targets.")
    ],
    range_mm: Annotated[
        float | None, typer.Option(min=1e-4, help="Sigma of ranges where a table has none.")
    ] = None,
    range_ppm: Annotated[
        float, typer.Option(min=0, help="Its part that grows with the range.")
    ] = 0.0,
    angle_arcsec: Annotated[
        float | None, typer.Option(min=1e-4, help="Sigma of both angles where a table has none.")
    ] = None,
    sheet: Annotated[
        str | None, typer.Option(help="A model whose data sheet gives these sigmas.")
    ] = None,
    alpha: Annotated[
        float, typer.Option(min=1e-6, max=0.5, help="Error probability of the whole verdict.")
    ] = 0.05,
    earlier: Annotated[
        Path | None, typer.Option(help="JSON of an earlier check to compare with.")
    ] = None,
    lengths: Annotated[
        Path | None,
        typer.Option(help="Known distances between targets, or their coordinates, with sigmas."),
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Test a scanner in the field: both faces, distances between targets, repeated series."""
    if (range_mm is None) != (angle_arcsec is None):
        raise InputError("the sigma of ranges and that of angles go together", cure="give both")
    sigmas = {} if range_mm is None else {
        "range_mm": range_mm,
        "range_ppm": range_ppm,
        "scan_angle_arcsec": angle_arcsec,
        "scan_angle_accuracy_arcsec": angle_arcsec,
    }  # fmt: skip
    try:
        instrument = Instrument.model_validate({"sheet": sheet, **sigmas} if sheet else sigmas)
    except ValueError as error:
        raise InputError(
            f"there is no data sheet {sheet}", cure="see the list of instruments"
        ) from error
    before = None if earlier is None else read_earlier(earlier)
    precision = instrument.precision()
    survey, given, title = survey_to_check(source, precision, progress)
    readings = readings_of(survey)
    targets = [str(name) for name in dict.fromkeys(readings.target)]
    known = known_lengths(given, targets) if lengths is None else read_lengths(lengths, targets)
    noise = noise_of(source, precision)
    return answer_of(check_readings(readings, title, alpha, before, known, noise))
