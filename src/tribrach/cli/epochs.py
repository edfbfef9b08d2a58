"""The command epochs: has anything moved between two adjusted epochs or more?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from tribrach.epochs.comparison import Settings
from tribrach.epochs.differences import MOTIONS
from tribrach.epochs_from_files import compare_epoch_files
from tribrach.errors import InputError, UnknownName
from tribrach.io.outputs import write_texts
from tribrach.job.epochs import EpochSettings
from tribrach.report.characters import visible
from tribrach.report.epochs import (
    epochs_findings,
    epochs_page,
    epochs_part,
    epochs_svg,
    epochs_tables,
)
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.epochs import EpochsDocument
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded
from tribrach.shell.printing import printed

__all__ = ["epochs"]

#: version of the layout of the JSON
SCHEMA = 1
#: terminals with as many columns show all columns of the tables
_WIDE = 118
#: motions by what they are called on the command line
_MOTIONS = {"scale": ("scale",), "turn": (MOTIONS[5],), "shift": MOTIONS[:3], "tilt": MOTIONS[3:5]}


def epochs(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="A B [C ...]",
            help="Epochs, the earliest first: projects, survey files, epoch files, results of "
            "Gama, SINEX, coordinates+matrix. Files of one epoch are joined by +.",
        ),
    ],
    reference: Annotated[
        list[str] | None,
        typer.Option(help="A point taken as stable until tested; repeat it. Else control, or all."),
    ] = None,
    coordinates: Annotated[
        Literal["heights", "plan", "3D"] | None,
        typer.Option(help="What is compared; else all that both epochs have."),
    ] = None,
    datum: Annotated[
        Literal["free", "control"],
        typer.Option(help="Of networks: free, control is tested too; control as given."),
    ] = "free",
    free: Annotated[
        list[str] | None,
        typer.Option(help="Take out scale, turn, shift or tilt of the whole as well; repeat it."),
    ] = None,
    previous: Annotated[
        bool, typer.Option("--previous", help="Each against the one before it, not the first.")
    ] = False,
    confidence: Annotated[
        float, typer.Option(min=0.5, max=0.9999, help="Of each test and of ellipses.")
    ] = 0.95,
    power: Annotated[
        float, typer.Option(min=0.1, max=0.999, help="Of the displacement called detectable.")
    ] = 0.8,
    posterior: Annotated[
        bool, typer.Option("--posterior/--prior", help="Scale variances a posteriori.")
    ] = False,
    together: Annotated[
        bool, typer.Option("--together", help="One confidence for the tests of all points.")
    ] = False,
    most_moved: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Reference points that may have moved.")
    ] = None,
    systematic_mm: Annotated[
        float, typer.Option(min=0, max=1e6, help="Bound of what may be systematic, E and N.")
    ] = 0.0,
    systematic_up_mm: Annotated[
        float | None, typer.Option(min=0, max=1e6, help="The same in U; as in E and N if left out.")
    ] = None,
    angle: Annotated[
        Literal["gon", "deg"], typer.Option(help="Unit of angles in reports.")
    ] = "gon",
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[Path | None, typer.Option("--html", help="Write a page.")] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map", help="Write the map of the last epoch as SVG.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Say what has moved between epochs: which points, how far, how sure."""

    def work() -> None:
        every = [_files(text) for text in files]
        outputs = (json_file, html_file, map_file)
        claim([path for epoch in every for path in epoch], outputs, overwrite=overwrite)
        up = systematic_mm if systematic_up_mm is None else systematic_up_mm
        settings = EpochSettings(
            Settings(
                references=tuple(reference or ()),
                confidence=confidence,
                power=power,
                posterior=posterior,
                together=together,
                most=most_moved,
                systematic=(1e-3 * systematic_mm, 1e-3 * systematic_mm, 1e-3 * up),
            ),
            coordinates,
            tuple(m for word in free or () for m in _motions(word)),
        )
        compared = compare_epoch_files(every, settings, datum=datum, previous=previous)
        texts = {}
        if json_file is not None:
            parts = [epochs_part(one, angle) for one in compared]
            data = heading(SCHEMA) | {"comparisons": parts}
            texts[json_file] = document_text(EpochsDocument.model_validate(data))
        if html_file is not None:
            texts[html_file] = epochs_page(compared, angle)
        if map_file is not None:
            drawing = epochs_svg(compared[-1])
            if drawing is None:
                raise InputError(
                    "there is no map: the points have no coordinates in plan",
                    file=map_file,
                    cure="leave --map out",
                )
            texts[map_file] = drawing
        write_texts(texts)
        if quiet:
            return
        console = Console()
        for one in compared:
            for table in epochs_tables(one, angle):
                fitting = table if console.width >= _WIDE else table.narrow()
                console.print(printed(fitting, console.width))
            for finding in epochs_findings(one, angle):
                console.print(visible(finding.line()), markup=False)

    guarded(work)


def _motions(word: str) -> tuple[str, ...]:
    """Motions by the word of the option.

    Raises
    ------
    UnknownName
        Another word.
    """
    if word not in _MOTIONS:
        raise UnknownName("motion", word, _MOTIONS)
    return _MOTIONS[word]


def _files(text: str) -> list[Path]:
    """Files of one epoch; a plus in the name of a file that is there joins nothing."""
    if Path(text).is_file():
        return [Path(text)]
    return [Path(part) for part in text.split("+") if part]
