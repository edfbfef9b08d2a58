"""The command epochs: has anything moved between two adjusted epochs or more?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tribrach.epochs.comparison import Settings
from tribrach.epochs.differences import MOTIONS
from tribrach.errors import InputError, UnknownName
from tribrach.job.epochs import EpochSettings
from tribrach.questions.epochs.chapters import answer_of
from tribrach.questions.epochs.from_files import compare_epoch_files
from tribrach.report.answer import Answer
from tribrach.report.epochs import epochs_svg
from tribrach.shell.command import WRITTEN, command

#: motions by what they are called on the command line
_MOTIONS = {"scale": ("scale",), "turn": (MOTIONS[5],), "shift": MOTIONS[:3], "tilt": MOTIONS[3:5]}


def _every(texts: Sequence[str]) -> list[list[Path]]:
    """Files of each epoch; a plus in the name of a file that is there joins nothing."""
    return [
        [Path(text)] if Path(text).is_file() else [Path(part) for part in text.split("+") if part]
        for text in texts
    ]


@command()
def epochs(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="A B [C ...]",
            help="Epochs, the earliest first: projects, survey files, epoch files, results of "
            "Gama, SINEX, coordinates+matrix. Files of one epoch are joined by +.",
        ),
        _every,
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
    map_svg: Annotated[
        Path | None, typer.Option("--map", help="Write the map of the last epoch as SVG."), WRITTEN
    ] = None,
) -> Answer:
    """Say what has moved between epochs: which points, how far, how sure."""
    every: Any = files
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
    answer = answer_of(compared, angle)
    if map_svg is None:
        return answer
    drawing = epochs_svg(compared[-1])
    if drawing is None:
        raise InputError(
            "there is no map: the points have no coordinates in plan",
            file=map_svg,
            cure="leave --map out",
        )
    return replace(answer, files={map_svg: drawing})


def _motions(word: str) -> tuple[str, ...]:
    """Motions by the word of the option."""
    if word not in _MOTIONS:
        raise UnknownName("motion", word, _MOTIONS)
    return _MOTIONS[word]
