"""The command init: from a folder of files to a project file that runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tribrach.cli.shell import Overwrite, Quiet, claim, guarded, say
from tribrach.errors import InputError
from tribrach.io.outputs import write_text
from tribrach.job.first_project import FirstProject, Wishes, compose, parse_target, sheet_of
from tribrach.job.folder import AXES, Axes, FolderFile, look_through

__all__ = ["init"]

#: files that are listed of each kind
_LISTED = 60


def init(
    folder: Annotated[Path, typer.Argument(help="Folder with scans, observations and lists.")],
    out: Annotated[
        Path | None, typer.Option(help="The project file; project.toml in the folder if not given.")
    ] = None,
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND:SIZE",
            help="Targets: sphere:RADIUS, checkerboard:SIDE, disc:RADIUS; metres, or 145mm.",
        ),
    ] = None,
    scanner: Annotated[
        str | None, typer.Option(help='Model of the scanner, such as "Leica P40": its data sheet.')
    ] = None,
    total_station: Annotated[
        str | None, typer.Option(help='Model, such as "Leica TS16": its data sheet.')
    ] = None,
    crs: Annotated[
        str | None, typer.Option(help="Reference system of coordinates, such as EPSG:25832.")
    ] = None,
    control_role: Annotated[
        Literal["control", "check", "approximate", "fixed"] | None,
        typer.Option(help="What lists of coordinates are for."),
    ] = None,
    control_sigma_mm: Annotated[
        float | None,
        typer.Option(min=1e-3, max=1e5, help="Sigma where a list gives none; 5 if not given."),
    ] = None,
    axes: Annotated[
        Axes | None, typer.Option(help="Which way X points in lists with X and Y.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Ask nothing.")] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write a project file for a folder: looks at scans, observations and lists, and asks."""

    def work() -> None:
        path = folder / "project.toml" if out is None else out
        if path.parent.resolve() != folder.resolve():
            raise InputError(
                "a project names files beside it",
                file=path,
                cure="give a file in the folder itself",
            )
        claim([], [path], overwrite=overwrite)
        models = {name: sheet_of(name) for name in (scanner, total_station) if name is not None}
        targets, said = [], []
        for words in target or ():
            key, size, guess = parse_target(words)
            targets.append((key, size))
            said += [guess] if guess else []
        found = look_through(folder, axes)
        if not yes:
            found, more = _asked(folder, found, axes, bool(targets))
            for words in more:
                key, size, guess = parse_target(words)
                targets.append((key, size))
                said += [guess] if guess else []
        surveyed = any(one.kind in ("points", "survey") for one in found)
        if not targets and surveyed and any(one.kind == "scans" for one in found):
            # finders take their time to load, which only who looks for targets should spend
            from tribrach.job.usual_targets import usual_targets

            targets, sentence = usual_targets(found)
            said += [sentence] if sentence else []
        wishes = Wishes(
            tuple(targets),
            models.get(scanner or ""),
            models.get(total_station or ""),
            crs,
            control_role or _role(found, yes=yes),
            5.0 if control_sigma_mm is None else control_sigma_mm,
        )
        project = compose(
            folder, [one for one in found if one.path.resolve() != path.resolve()], wishes
        )
        project.assumed[:0] = said
        write_text(path, project.text)
        if not quiet:
            _tell(folder, path, project)

    guarded(work)


def _asked(
    folder: Path, found: list[FolderFile], axes: Axes | None, targets: bool
) -> tuple[list[FolderFile], list[str]]:
    """The files and the targets, after asking what only somebody who was there knows."""
    if axes is None and any("does X point" in f.words or "no header" in f.words for f in found):
        told = typer.prompt("Lists with X and Y: does X (the first) point east or north?")
        chosen = next((one for one in AXES if one.startswith(told.strip().lower()[:1])), None)
        if chosen is not None:
            found = look_through(folder, chosen)
    more: list[str] = []
    if not targets and any(one.kind == "scans" for one in found):
        told = typer.prompt(
            "Targets (sphere:RADIUS, checkerboard:SIDE, disc:RADIUS, several with blanks; empty "
            "to look for usual ones)",
            default="",
            show_default=False,
        )
        more = told.split()
    return found, more


def _role(found: list[FolderFile], *, yes: bool) -> str:
    """What lists of coordinates are for, asked where their columns do not say it."""
    open_ones = [f for f in found if f.table is not None and f.kind == "points"]
    if yes or all(f.table is None or f.table.has("role") for f in open_ones):
        return "control"
    roles = ("control", "check", "approximate", "fixed")
    while True:
        told = typer.prompt(f"Lists of coordinates are {', '.join(roles)}", default="control")
        if told.strip().lower() in roles:
            return str(told.strip().lower())


def _tell(folder: Path, path: Path, project: FirstProject) -> None:
    """Say what was found, assumed and left out, and what comes next."""

    def listed(title: str, rows: list[str]) -> None:
        if rows:
            more = [f"  and {len(rows) - _LISTED} more"] if len(rows) > _LISTED else []
            say("\n".join([title, *(f"  {row}" for row in rows[:_LISTED]), *more]))

    def named(file: Path) -> str:
        return file.relative_to(folder).as_posix()

    listed("In the project:", [f"{named(file)}: {words}" for file, words in project.used])
    listed("Assumed:", [f"{sentence}." for sentence in project.assumed])
    listed("Not in it:", [f"{named(file)}: {why}" for file, why in project.left])
    say(f"{path}\nnow: tribrach check-project {path}\nthen: tribrach run {path}")
