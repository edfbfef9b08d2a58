"""The command export: a network in the format of another program, so that it can check this one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tribrach.errors import InputError
from tribrach.io.outputs import write_texts
from tribrach.io.survey.exported import export as exported
from tribrach.io.survey.formats import read_files
from tribrach.job.opened import open_job
from tribrach.network.network import Network
from tribrach.network.observed_part import observed_part
from tribrach.questions.adjust.command import project_of
from tribrach.sentences import capital
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown

__all__ = ["export"]

#: suffixes of the files
_SUFFIX = {"gkf": ".gkf", "dynaml": ".xml", "starnet": ".dat"}


def export(
    files: Annotated[
        list[Path],
        typer.Argument(help="Networks, as adjust takes them, or a toml."),
    ],
    to: Annotated[
        Literal["gkf", "dynaml", "starnet"],
        typer.Option("--to", help="Format: GNU Gama (gkf), DynAdjust (dynaml) or STAR*NET."),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The file; beside the first input if not given."),
    ] = None,
    partial: Annotated[
        bool, typer.Option("--partial", help="Leave out what the format cannot hold.")
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write a network for another program; what its format cannot hold is named."""

    def work() -> None:
        path = _beside(files[0], _SUFFIX[to]) if out is None else out
        claim(files, {f"--to {to}": path}, overwrite=overwrite)
        result = exported(_network(files, quiet), to)
        claim(files, {f"--to {to}": result.files(path)}, overwrite=overwrite)
        if result.lost and not partial:
            raise InputError(
                f"{to} cannot hold all of this network: {'; '.join(result.lost)}",
                cure="give --partial to write the rest, which is another network",
            )
        written = write_texts(result.files(path))
        if quiet:
            return
        one = result.written == 1
        names = ", ".join(map(str, written))
        say(f"{names}: {result.written} observation{'' if one else 's'}")
        for sentence in (*result.lost, *result.notes):
            say(f"! {capital(sentence)}.")

    guarded(work)


def _network(files: list[Path], quiet: bool) -> Network:
    """The network of the files, or of a project, as adjust has it."""
    project = project_of(files)
    if project is None:
        return observed_part(read_files(files)).network()
    with shown(quiet) as progress:
        return open_job(project, progress).network()


def _beside(path: Path, suffix: str) -> Path:
    """A name beside an input that is not its own."""
    other = path.with_suffix(suffix)
    return other if other != path else path.with_name(f"{path.stem}-export{suffix}")
