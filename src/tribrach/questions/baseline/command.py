"""The command baseline: a vector with its covariance from the RINEX files of two receivers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from tribrach._types import Progress
from tribrach.answers import Form
from tribrach.errors import InputError
from tribrach.gnss.antennas import AntennaSetup
from tribrach.gnss.attempts import comparison
from tribrach.gnss.baseline import Baseline, Processing, compute_baseline
from tribrach.gnss.engine import EngineName
from tribrach.gnss.orbits import calendar
from tribrach.gnss.pieces import UNSEEN
from tribrach.io.gnss.observation_file import read_observations
from tribrach.report.answer import Answer
from tribrach.report.findings import Finding, words
from tribrach.sentences import Sentence, joined
from tribrach.shell.command import command

FORM = Form("baseline", Baseline, 1)


def answer_of(baseline: Baseline) -> Answer:
    """The baseline as people read it."""
    findings = list(_findings(baseline))
    lines = joined("\n", words(findings))
    title = " to ".join(baseline.names)
    return Answer("GNSS baseline", title, None, baseline, FORM, findings=findings, terminal=[lines])


def _findings(b: Baseline) -> Iterator[Finding]:
    """Its figures, a line each."""
    yield Finding(b.headline, key="headline")
    phases = "" if b.residual is None else ", phases {b.residual:mm1} (root mean square)"
    yield Finding.of(
        "session",
        "session: {start} to {end}, {b.epochs} of {b.epochs_common} common epochs solved, "
        f"{{b.satellites:1}} satellites ({{b.systems}}){phases}",
        start=calendar(b.start),
        end=calendar(b.end),
        b=b,
    )
    if b.orbits:
        yield Finding(f"orbits: precise ones of {', '.join(b.orbits)}", key="orbits")
    if b.idle:
        yield Finding(f"systems without part: {'; '.join(b.idle)}", key="idle")
    last = "" if b.ambiguities == "fixed" else ", and the scatter of the last third"
    for key, template in (
        ("antennas", "{b.heights[0]:m4} over the base, {b.heights[1]:m4} over the rover"),
        ("baseline X, Y, Z", "{b.vector[0]:m4~} {b.vector[1]:m4~} {b.vector[2]:m4}, geocentric"),
        (
            "rover X, Y, Z",
            "{b.rover[0]:m4~} {b.rover[1]:m4~} {b.rover[2]:m4} (frame and epoch of the base "
            "coordinates)",
        ),
        (
            "sigma X, Y, Z",
            "{sigma[0]:mm1~} {sigma[1]:mm1~} {sigma[2]:mm1} of the baseline, formal times "
            f"{{b.factor:2}} ({{b.factor_source}}){last}",
        ),
    ):
        yield Finding.of(key, f"{key}: {template}", b=b, sigma=np.sqrt(np.diag(b.covariance)))
    if b.session_part is not None:
        yield Finding.of(
            "session_part",
            "alike within a session, in it: {part.plan:mm1} in plan, {part.up:mm1} in height "
            "({part.source})",
            part=b.session_part,
        )
    if b.noise is not None:
        yield Finding("noise: " + b.noise.sentence(), key="noise")
    if b.pieces is not None:
        yield Finding(
            Sentence("check: {said}; {unseen}", said=b.pieces.sentence(), unseen=UNSEEN),
            key="pieces",
        )
    if b.choice:
        yield Finding(f"choice: {b.choice}", key="choice")
        yield from (Finding(f"    {line}", key="attempt") for line in comparison(b.attempts))
    yield from (Finding(f"warning: {text}", True, "warning") for text in b.warnings)


@command(json="Write the result as JSON.", html=None)
def baseline(
    base: Annotated[Path, typer.Argument(help="Observations of the base (RINEX 2 or 3).")],
    rover: Annotated[Path, typer.Argument(help="Observations of the rover.")],
    navigation: Annotated[
        list[Path], typer.Argument(help="Broadcast orbits of the day, and precise ones (SP3).")
    ],
    base_xyz: Annotated[str, typer.Option(help="X,Y,Z of the base mark, geocentric, metres.")],
    mask_deg: Annotated[
        float, typer.Option(min=0, max=60, help="Elevation mask in degrees.")
    ] = 15.0,
    frequencies: Annotated[
        int, typer.Option(min=1, max=3, help="How many frequencies are used at most.")
    ] = 2,
    systems: Annotated[str, typer.Option(help="G GPS, R GLONASS, E Galileo, C BDS, J.")] = "GEJC",
    no_atmosphere: Annotated[
        bool,
        typer.Option("--no-atmosphere", help="No models of troposphere and ionosphere."),
    ] = False,
    base_height_m: Annotated[
        float | None,
        typer.Option(help="Antenna over the base mark in metres; else as in the file."),
    ] = None,
    rover_height_m: Annotated[
        float | None,
        typer.Option(help="Antenna over the rover mark in metres; else as in the file."),
    ] = None,
    sigma_factor: Annotated[
        float | None, typer.Option(min=0.01, max=1000, help="Factor on formal sigmas.")
    ] = None,
    antex: Annotated[Path | None, typer.Option(help="ANTEX file of phase centres.")] = None,
    engine: Annotated[
        EngineName, typer.Option(help="RTKLIB: the package or the program.")
    ] = "auto",
    seconds: Annotated[
        float, typer.Option(min=1, help="Time limit of the engine in seconds.")
    ] = 600.0,
    no_alternatives: Annotated[
        bool,
        typer.Option("--no-alternatives", help="Keep a doubtful baseline as it was asked for."),
    ] = False,
    no_pieces: Annotated[
        bool,
        typer.Option("--no-pieces", help="No check of sigmas by pieces of the session."),
    ] = False,
    *,
    progress: Progress,
) -> Answer:
    """Compute a static baseline from RINEX files."""
    settings = Processing(
        mask=mask_deg,
        frequencies=frequencies,
        systems=systems,
        atmosphere=not no_atmosphere,
        factor=sigma_factor,
        antex=antex,
        engine=engine,
        seconds=seconds,
        alternatives=not no_alternatives,
        pieces=not no_pieces,
    )
    found = compute_baseline(
        base,
        rover,
        navigation,
        _numbers(base_xyz),
        settings,
        base_antenna=_antenna(base, base_height_m),
        rover_antenna=_antenna(rover, rover_height_m),
        progress=progress,
    )
    return answer_of(found)


def _numbers(text: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(
            f"--base-xyz {text!r} is not three numbers", cure="write X,Y,Z in metres"
        ) from None
    return np.array([x, y, z])


def _antenna(path: Path, height: float | None) -> AntennaSetup | None:
    """The antenna of a file with a height of the user's; None if no height is given."""
    return None if height is None else AntennaSetup.of(read_observations(path), height=height)
