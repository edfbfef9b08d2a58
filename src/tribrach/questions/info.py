"""What is in files of scans? Points, extents, fields, grids, poses, and what looks wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Annotated

import typer

from tribrach.answers import Form, Result
from tribrach.errors import InputError, TribrachError
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import Description, describe
from tribrach.io.survey.riscan.info import ProjectDescription, describe_project
from tribrach.job.folder import known_file
from tribrach.report.answer import Answer
from tribrach.report.columns import column
from tribrach.report.findings import Finding
from tribrach.report.tables import ReportTable, build_table
from tribrach.shell.command import command


@dataclass(frozen=True)
class DescribedFiles(Result):
    """Contents of files of scans."""

    scans: tuple[Description, ...]
    projects: tuple[ProjectDescription, ...]


FORM = Form("info", DescribedFiles, 1)


@command(html=None, quiet=False, scans=True)
def info(
    files: Annotated[list[Path], typer.Argument(help="Scans, or projects of RiSCAN PRO (.rsp).")],
) -> Answer:
    """Say what is in files of scans: points, extents, fields, grid, poses, what looks wrong.

    A file that cannot be read is named at the end, after what the others hold.
    """
    described: list[Description] = []
    projects: list[ProjectDescription] = []
    refused: list[TribrachError] = []
    for path in files:
        try:
            if path.suffix.lower() == ".rsp":
                projects.append(describe_project(path))
                continue
            scans = read_scans(path)
            described += [describe(scan, among=len(scans)) for scan in scans]
        except TribrachError as error:
            refused.append(_no_scan(path) or error)
    for other in refused[1:]:
        # the first error ends the command, and says the further ones
        refused[0].add_note(str(other))
    every: list[Description | ProjectDescription] = [*projects, *described]
    return Answer(
        "Files of scans",
        "",
        None,
        DescribedFiles(tuple(described), tuple(projects)),
        FORM,
        terminal=[part for one in every for part in _shown(one)],
        failure=refused[0] if refused else None,
    )


#: commands that take files which are no scans
_TAKEN_BY = {"survey": "adjust", "receiver": "baseline", "orbits": "baseline"}


def _no_scan(path: Path) -> InputError | None:
    """What a file is that holds observations, None for others."""
    file = known_file(path) if path.is_file() else None
    if file is None or file.kind not in _TAKEN_BY:
        return None
    what = f"it holds no scan: {file.words}"
    cure = f"give it to tribrach {_TAKEN_BY[file.kind]}, or its folder to tribrach init"
    return InputError(what, file=path, cure=cure)


def _shown(one: Description | ProjectDescription) -> Iterator[ReportTable | Finding]:
    columns = [column("", itemgetter(0)), column("", itemgetter(1))]
    yield build_table("description", one.title, "", one.rows(), columns)
    yield from (Finding(sentence, True) for sentence in one.sentences)
