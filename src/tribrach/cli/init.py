"""The command init: from a folder of files to a project file that runs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import typer
from pyproj.exceptions import CRSError, ProjError

from tribrach.errors import InputError
from tribrach.geodesy.grid_datum import GridDatum
from tribrach.io.csv_rows import read_rows
from tribrach.io.instrument_sheets import Sheet
from tribrach.io.outputs import write_text
from tribrach.job.first_project import (
    FirstProject,
    Wishes,
    axes_by_observations,
    by_reason,
    compose,
    grid_without_crs,
    parse_target,
    sheet_of,
    without_sigmas,
)
from tribrach.job.folder import AXES, Axes, FolderFile, look_through, reread
from tribrach.sentences import stopped
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say

#: files that are listed of each kind
_LISTED = 60
#: rows of a file that a question shows
_ROWS = 4
#: name of the project of a survey alone, by that of the scans
_SURVEY = {"project": "survey"}
ROLES = ("control", "check", "approximate", "fixed")
T = TypeVar("T")


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
    control_sigma_up_mm: Annotated[
        float | None,
        typer.Option(min=1e-3, max=1e5, help="The same of heights; as in plan if not given."),
    ] = None,
    axes: Annotated[
        Axes | None, typer.Option(help="Which way X points in lists with X and Y.")
    ] = None,
    levelled: Annotated[
        bool | None,
        typer.Option("--levelled/--not-levelled", help="Was the compensator of the scanner on?"),
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
        claim([], {"": path}, overwrite=overwrite)
        said: list[str] = []
        wishes = Wishes(
            tuple(_targets(target or (), said)),
            None if scanner is None else sheet_of(scanner),
            None if total_station is None else sheet_of(total_station),
            crs,
            control_role or "control",
            control_sigma_mm,
            control_sigma_up_mm,
            levelled,
        )
        found = axes_by_observations(folder, look_through(folder, axes), wishes)
        if not yes:
            unsaid = control_sigma_mm is None and control_sigma_up_mm is None
            asked = _Asked(control_role is None, unsaid, said)
            found = asked.axes(folder, found)
            wishes = asked.wishes(folder, found, wishes)
        surveyed = any(one.kind in ("points", "survey") for one in found)
        if not wishes.targets and surveyed and any(one.kind == "scans" for one in found):
            # finders take their time to load, which only who looks for targets should spend
            from tribrach.job.usual_targets import usual_targets

            usual, sentence = usual_targets(found)
            said += [sentence] if sentence else []
            wishes = replace(wishes, targets=tuple(usual))
        project = compose(
            folder, [one for one in found if one.path.resolve() != path.resolve()], wishes
        )
        project.assumed[:0] = said
        written = {path: project}
        if project.survey is not None:
            name = _SURVEY.get(path.stem, f"{path.stem}-survey")
            written[path.with_name(f"{name}.toml")] = project.survey
            claim([], {"": path.with_name(f"{name}.toml")}, overwrite=overwrite)
        for file, one in written.items():
            write_text(file, one.text)
            if not quiet:
                _tell(folder, file, one)

    guarded(work)


def _targets(several: Iterable[str], said: list[str]) -> Iterator[tuple[str, float]]:
    """Keys and sizes [m] of targets from words; guesses are reported."""
    for words in several:
        key, size, guess = parse_target(words)
        said += [guess] if guess else []
        yield key, size


def _answer(question: str, taken: Callable[[str], T], default: str = "") -> T:
    """What somebody answers; asked again until it can be taken, an empty line is the default."""
    while True:
        told = typer.prompt(question, default=default, show_default=bool(default))
        try:
            return taken(str(told).strip())
        except InputError as error:
            say(str(error))


@dataclass(frozen=True)
class _Asked:
    """Questions on what only somebody who was there knows."""

    #: are what lists are for and their sigmas to be asked, since no option says them?
    role: bool
    sigma: bool
    said: list[str]  #: what was guessed of the answers

    def axes(self, folder: Path, found: list[FolderFile]) -> list[FolderFile]:
        """The files, after the question which way X points in lists that leave it open."""
        out = []
        for one in found:
            if one.assumed_axes is not None:
                _show(folder, [one])
                told = _answer("Does X (the first) point east or north?", _way, one.assumed_axes)
                one = reread(one, told, "as answered")
            out.append(one)
        return out

    def wishes(self, folder: Path, found: list[FolderFile], given: Wishes) -> Wishes:
        """What somebody says besides what the options say."""
        said: dict[str, Any] = {}
        if any(one.kind == "scans" for one in found):
            if not given.targets:
                said["targets"] = _answer(
                    "Targets (sphere:RADIUS, checkerboard:SIDE, disc:RADIUS, several with blanks; "
                    "empty to look for usual ones)",
                    lambda told: tuple(_targets(told.split(), self.said)),
                )
            named = any(s.facts.get("sensor model") for one in found for s in one.scans)
            if given.scanner is None and not named:
                said["scanner"] = _answer("Scanner, such as Leica P40 (empty: unknown)", _sheet)
            if given.levelled is None:
                said["levelled"] = _answer(
                    "Was its compensator on: yes or no (empty: unknown)", _yes_or_no
                )
        if given.total_station is None and any(one.format == "totalstation" for one in found):
            said["total_station"] = _answer(
                "Total station, such as Leica TS16 (empty: unknown)", _sheet
            )
        roles = [f for f in _lists(found) if f.table is not None and not f.table.has("role")]
        grid = given.crs is None and grid_without_crs(found)
        sigmas = self.sigma and without_sigmas(found)
        if grid or sigmas or (self.role and roles):
            _show(folder, _lists(found))
        if grid:
            said["crs"] = _answer(
                "Reference system of the coordinates, such as EPSG:25832 (empty: taken as "
                "Cartesian)",
                _crs,
            )
        if self.role and roles:
            said["control_role"] = _answer(
                f"Lists of coordinates are {', '.join(ROLES)}", _role, "control"
            )
        role = said.get("control_role", given.control_role)
        if sigmas and role == "control":
            said |= _answer(
                "Their sigmas in mm where a list gives none, in plan and in height", _sigmas, "5 5"
            )
        return replace(given, **said)


def _show(folder: Path, files: list[FolderFile]) -> None:
    """Name files that a question is on, with their first rows."""
    for one in files:
        rows = read_rows(one.path).cells[:_ROWS]
        say("\n".join([f"{one.path.relative_to(folder)}:", *(f"  {' | '.join(r)}" for r in rows)]))


def _lists(found: list[FolderFile]) -> list[FolderFile]:
    return [one for one in found if one.kind == "points"]


def _way(told: str) -> Axes:
    """East or north."""
    chosen = [one for one in AXES if told and one.startswith(told.lower())]
    if not chosen:
        raise InputError("that is neither", cure="answer east or north")
    return chosen[0]


def _sheet(told: str) -> Sheet | None:
    """A data sheet, None for an empty answer."""
    return sheet_of(told) if told else None


def _yes_or_no(told: str) -> bool | None:
    """True for yes, None for an empty answer."""
    if told and not re.fullmatch("y|yes|n|no", told, re.IGNORECASE):
        raise InputError("that is neither", cure="answer yes or no, or nothing")
    return told.lower().startswith("y") if told else None


def _crs(told: str) -> str | None:
    """A reference system that there is, None for an empty answer."""
    try:
        if told:
            GridDatum.of(told)
        return told or None
    except (CRSError, ProjError) as error:
        raise InputError(
            f"{told!r} is no reference system that is known", cure="answer such as EPSG:25832"
        ) from error


def _role(told: str) -> str:
    """What lists of coordinates are for."""
    if told.lower() not in ROLES:
        raise InputError("that is none of them", cure=f"answer {', '.join(ROLES)}")
    return told.lower()


def _sigmas(told: str) -> dict[str, float]:
    """One sigma [mm] for all, or those of plan and height."""
    words = told.replace(",", ".").split()
    try:
        figures = [float(word) for word in words]
    except ValueError:
        figures = []
    if len(figures) not in (1, 2) or not all(1e-3 <= one <= 1e5 for one in figures):
        raise InputError("these are no sigmas", cure="answer one or two numbers, such as 5 20")
    return {"control_sigma_mm": figures[0], "control_sigma_up_mm": figures[-1]}


def _tell(folder: Path, path: Path, project: FirstProject) -> None:
    """Say what was found, assumed and left out, and what comes next."""

    def listed(title: str, rows: list[str]) -> None:
        if rows:
            more = [f"  and {len(rows) - _LISTED} more"] if len(rows) > _LISTED else []
            say("\n".join([title, *(f"  {row}" for row in rows[:_LISTED]), *more]))

    def named(file: Path) -> str:
        return file.relative_to(folder).as_posix()

    listed("In the project:", [f"{named(file)}: {words}" for file, words in project.used])
    listed("Assumed:", [stopped(sentence) for sentence in project.assumed])
    listed("Not in it:", by_reason(project.left, folder))
    say(f"{path}\nnow: tribrach check-project {path}\nthen: tribrach run {path}")
