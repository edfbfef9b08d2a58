"""Sealing a job: its inputs, decisions, results and the versions of all that computed them."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path

from tribrach._types import Progress
from tribrach.answers import Form, Result
from tribrach.errors import InputError
from tribrach.io.bag import copied, digest_of, files_below, write_bag
from tribrach.io.keeping import keep, read_for, written_in
from tribrach.project import Project
from tribrach.questions.seal.signature import Signing, signed
from tribrach.scratch import scratch_folder

#: runs a project, leaves its results in a folder and tells its progress
Run = Callable[[Project, Path, Progress], object]


@dataclass(frozen=True)
class Seal(Result):
    """A sealed job."""

    file: str  #: name of the file
    #: digest of the list that is signed: it stands for all of the seal
    digest: str
    inputs: tuple[str, ...]
    results: tuple[str, ...]
    by_reference: tuple[str, ...]  #: inputs that are named by their digest and are not inside
    size: int  #: size of the file [bytes]
    reproduced: bool  #: did a run of the sealed inputs alone give the sealed results?
    certificate: str  #: name of the certificate; "" if it is not signed


FORM = Form("seal", Seal, 1, sentences=list[str])


def seal_job(
    project: Project,
    path: Path,
    *,
    signing: Signing | None,
    scans: bool,
    check: Run | None,
    progress: Progress,
) -> Seal:
    """Write the job of a project, its results included, into one file.

    scans : are the scans inside? Else they are named by their digests.
    check : runs the sealed inputs first.

    Without ``scans`` inside, they are named by their digests; ``check`` runs the sealed inputs
    first.
    """
    own = project.inputs()[0]
    folder = project.results
    edits = [project.edits_file] if project.edits_file.is_file() else []
    # besides what the project names a run reads what stands beside it, such as the poses of clouds
    read = [*project.inputs(), *edits, *read_for(folder)]
    inputs = list({path.resolve(): Path(os.path.abspath(path)) for path in reversed(read)}.values())
    inputs.sort()
    results = _results(folder, own)
    _refuse_outside(project)
    root = Path(os.path.commonpath([*(p.parent for p in inputs), os.path.abspath(folder)]))
    payload = {p.relative_to(root).as_posix(): p for p in (*inputs, *results)}
    keep(payload.values())
    digests = dict[str, str]()
    for k, (name, place) in enumerate(payload.items()):
        progress("digests", k, len(payload))
        digests[name] = digest_of(place)
    progress("digests", len(payload), len(payload))
    mine = Path(os.path.abspath(own)).relative_to(root).as_posix()
    out = Path(os.path.abspath(folder)).relative_to(root).as_posix()
    made = [p.relative_to(root).as_posix() for p in results]
    given = [name for name in payload if name not in made]
    if check is not None:
        _reproduce(payload, digests, given, made, mine, out, check, progress)
    outside = {(project.folder / scan.file).resolve() for scan in project.scans}
    absent = [] if scans else [name for name in given if payload[name].resolve() in outside]
    about = {
        "seal": 1,
        "title": project.title,
        "project": mine,
        "results_folder": out,
        "inputs": given,
        "results": made,
        "by_reference": absent,
        "reproduced": check is not None,
        "versions": versions(),
    }
    info = {
        "Bag-Software-Agent": f"tribrach {metadata.version('tribrach')}",
        "External-Description": project.title,
    }
    progress("sealing", 0, 1)
    sign = None if signing is None else partial(signed, wish=signing)
    digest, size = write_bag(path, own.stem, payload, digests, absent, about, info, sign)
    progress("sealing", 1, 1)
    name = "" if signing is None else signing.certificate.name
    return Seal(
        path.name, digest, tuple(given), tuple(made), tuple(absent), size, check is not None, name
    )


def _results(folder: Path, project: Path) -> list[Path]:
    """What a run wrote into its folder, as it wrote it."""
    if not (folder / "result.json").is_file():
        raise InputError(
            "there are no results to seal", file=folder, cure=f"tribrach run {project.name}"
        )
    found: list[Path] = []
    for name, as_written in sorted(written_in(folder, "run").items()):
        path = Path(os.path.abspath(folder / name))
        if not path.is_file():
            continue
        if not as_written:
            raise InputError(
                "this result was changed after it was written",
                file=path,
                cure=f"run {project.name} again, then seal it",
            )
        found.append(path)
    return found


def _refuse_outside(project: Project, root: Path | None = None) -> None:
    """Refuse a project that names files by their place on this machine, or outside of a folder."""
    for text, path in project.named_files().items():
        leaves = root is not None and not path.resolve().is_relative_to(root.resolve())
        if Path(text).is_absolute() or leaves:
            raise InputError(
                f"{text} is a place on this machine, and nobody else could run the job",
                file=project.inputs()[0],
                cure=f"name {path.name} by its way from the folder of the project",
            )


def versions() -> dict[str, str]:
    """Versions of everything that computes, by name."""
    found = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }
    for line in ["tribrach", *(metadata.requires("tribrach") or ())]:
        name = re.match(r"[\w.-]+", line)
        if name is not None and "extra ==" not in line:
            try:
                found[name[0]] = metadata.version(name[0])
            except metadata.PackageNotFoundError:
                continue
    return found


def again(root: Path, project: str, out: str, run: Run, progress: Progress) -> dict[str, Path]:
    """Run a job that was copied into a folder; its results by their names in theirs."""
    copied = Project.load(root / project)
    _refuse_outside(copied, root)
    run(copied, root / out, progress)
    return files_below(root / out)


def _reproduce(
    payload: dict[str, Path],
    digests: dict[str, str],
    given: list[str],
    made: list[str],
    project: str,
    out: str,
    run: Run,
    progress: Progress,
) -> None:
    """Run the inputs alone, somewhere else; refuse to seal what does not come of them."""
    with scratch_folder() as place:
        for name in given:
            copied(payload[name], place / name, digests[name])
        found = again(place, project, out, run, progress)
        differing = list[str]()
        for name in made:
            path = found.get(name.removeprefix(f"{out}/"))
            if path is None:
                differing.append(f"no {name}")
            elif digest_of(path) != digests[name]:
                differing.append(name)
    if differing:
        more = f" and {len(differing) - 5} more" if len(differing) > 5 else ""
        raise InputError(
            f"a run of these inputs alone gives other results: {', '.join(differing[:5])}{more}",
            file=payload[project],
            cure="run the project again, then seal it; --no-check seals it as it is, and says so",
        )
