"""The commands seal and verify: a job in one file, and whether such a file holds."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.questions.seal.chapters import seal_answer, verification_answer
from tribrach.questions.seal.sealing import seal_job
from tribrach.questions.seal.signature import Signing
from tribrach.questions.seal.verification import verify_seal
from tribrach.report.answer import Answer
from tribrach.shell.command import WRITTEN, command


def project_of(given: Path) -> Path:
    """The project file that is meant by a file or its folder."""
    if not given.is_dir():
        return given
    found = [path for path in sorted(given.glob("*.toml")) if _is_project(path)]
    if len(found) != 1:
        what = "there is no project file here" if not found else "there are several project files"
        raise InputError(what, file=given, cure="name the project file")
    return found[0]


def _is_project(path: Path) -> bool:
    """Can the file be read as a project?"""
    try:
        Project.load(path)
    except InputError:
        return False
    return True


@command(html=None)
def seal(
    project: Annotated[
        Path, typer.Argument(help="A project that was run, or its folder."), project_of
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The sealed job; PROJECT.seal.zip beside the project if not given."),
        WRITTEN,
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(help="Sign with it: a .p12 file, or PEM with --key.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="Key of a PEM certificate.")] = None,
    time_server: Annotated[
        str | None, typer.Option(metavar="URL", help="Server of time stamps (RFC 3161).")
    ] = None,
    scans: Annotated[
        bool, typer.Option("--scans/--no-scans", help="Scans inside, or by their digests.")
    ] = True,
    check: Annotated[
        bool, typer.Option("--check/--no-check", help="Run the sealed inputs first.")
    ] = True,
    *,
    progress: Progress,
) -> Answer:
    """Put a job into one file: inputs, decisions, results, versions, digests, a signature.

    The passphrase of a key is taken from TRIBRACH_PASSPHRASE.
    """
    if certificate is None and (key is not None or time_server is not None):
        raise InputError("--key and --time-server belong to a certificate", cure="--certificate")
    phrase = os.environ.get("TRIBRACH_PASSPHRASE")
    signing = None
    if certificate is not None:
        signing = Signing(certificate, key, phrase.encode() if phrase else None, time_server)
    place = out or project.with_name(f"{project.stem}.seal.zip")
    made = seal_job(
        Project.load(project),
        place,
        signing=signing,
        scans=scans,
        check=run if check else None,
        progress=progress,
    )
    return seal_answer(made)


@command(html=None)
def verify(
    file: Annotated[Path, typer.Argument(help="A sealed job.")],
    inputs: Annotated[
        Path | None, typer.Option(help="Folder of the scans that are not inside.")
    ] = None,
    trust: Annotated[
        list[Path] | None, typer.Option(help="Certificate of an authority; may be repeated.")
    ] = None,
    again: Annotated[bool, typer.Option("--run/--no-run", help="Run the job again.")] = True,
    *,
    progress: Progress,
) -> Answer:
    """Test a sealed job: is every file unchanged, who signed it, does a run give the same?"""
    found = verify_seal(
        file, inputs=inputs, trusted=trust or (), run=run if again else None, progress=progress
    )
    return verification_answer(found)
