"""The command pick: a natural point of a scan with its covariance, kept among the decisions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from tribrach._types import Progress
from tribrach.answers import Form, Result
from tribrach.errors import InputError, UnknownName
from tribrach.io.keeping import alone, rewriting
from tribrach.io.outputs import Content, write_text
from tribrach.io.scans.formats import read_scans
from tribrach.io.toml_model import read_text
from tribrach.job.find_targets import find_targets
from tribrach.job.opened import open_job
from tribrach.job.scans import StationScan, open_scans
from tribrach.job.state import Remembered
from tribrach.project import Project
from tribrach.project.edits import PickEdit, edits_text
from tribrach.project.sections import TargetSection
from tribrach.report.answer import Answer
from tribrach.scan.no_return import screened
from tribrach.sentences import Sentence, joined, written
from tribrach.shell.command import WRITTEN, command
from tribrach.targets.detection import Detection
from tribrach.targets.picks import PickKind


@dataclass(frozen=True, eq=False)
class PickedPoint(Result):
    """A natural point of a scan, in its scanner frame."""

    name: str
    point: Detection


FORM = Form("pick", PickedPoint, 1)


@command(html=None, scans=True)
def pick(
    source: Annotated[
        Path, typer.Argument(metavar="SCAN-OR-PROJECT", help="A file of scans, or a project.")
    ],
    at: Annotated[
        tuple[float, float, float],
        typer.Option(help="Place x y z in the scanner frame in metres."),
    ],
    kind: Annotated[PickKind, typer.Option("--as", help="What it is.")] = "corner",
    radius: Annotated[
        float, typer.Option(min=1e-3, max=20, help="Points this near to the place count, metres.")
    ] = 0.3,
    scan: Annotated[str, typer.Option(help="Which scan, of a project or a file of several.")] = "",
    name: Annotated[str, typer.Option(help="Name of the point.")] = "",
    reason: Annotated[
        str, typer.Option(help="Why; with it the pick is kept in edits.toml of the project.")
    ] = "",
    check: Annotated[
        bool, typer.Option("--check", help="Compare it only, instead of using it.")
    ] = False,
    png_file: Annotated[
        Path | None, typer.Option("--picture", help="Write the scan around the point."), WRITTEN
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Pick a natural point of a scan: corner, edge, disc, hole, axis or place, with covariance."""
    project = Project.load(source) if source.suffix.lower() == ".toml" else None
    if reason and (project is None or not name):
        raise typer.BadParameter("a pick is kept with --name, in a project", param_hint="--reason")
    entry = PickEdit(
        scan=scan or "scan",
        place=at,
        kind=kind,
        name=name or kind,
        radius_m=radius,
        use="check" if check else "active",
        reason=reason or "looked at only",
    )
    chosen, wanted = _chosen(source, project, scan)
    entry = entry.model_copy(update={"scan": chosen.name})
    seen = replace(chosen, scan=screened(chosen.scan))
    found = find_targets(seen, wanted, [entry.pick])
    if not found.detections:
        raise InputError(
            found.rejected[0].reason,
            file=chosen.scan.path,
            record=chosen.name,
            cure="give another place, --radius or --as",
        )
    point = found.detections[0]
    files: dict[Path, Content] = {}
    if png_file is not None and 1 in found.pictures:
        made = BytesIO()
        Image.open(BytesIO(found.pictures[1])).save(made, "PNG")
        files[png_file] = made.getvalue()
    if reason and project is not None:
        _keep(project, entry)
    lines: list[str] = [
        Sentence(
            "{name} in {d.scan}, {d.kind}: {center}  sigma {sigma} mm  {d.inliers} of {d.points} "
            "points within the limit, rms {d.rms:mm2}",
            name=entry.name,
            d=point,
            center=joined(" ", (Sentence("{x:5}", x=x) for x in point.center)),
            sigma=", ".join(written(s, "mm2~") for s in point.sigmas),
        )
    ]
    if reason and project is not None:
        lines.append(f"kept in {project.edits_file.name}: run and adjust use it")
    result = PickedPoint(entry.name, point)
    return Answer("Picked point", chosen.name, None, result, FORM, terminal=lines, files=files)


def _chosen(source: Path, project: Project | None, name: str) -> tuple[StationScan, TargetSection]:
    """The scan that is meant, and the project's section of targets without any size."""
    if project is None:
        scans = [StationScan(s.name, s.name, s, None, False, {}) for s in read_scans(source)]
        wanted = TargetSection()
    else:
        scans = open_scans(open_job(project), Remembered(project.results))
        wanted = TargetSection(floor_mm=project.targets.floor_mm)
    by_name = {one.name: one for one in scans}
    if name and name not in by_name:
        raise UnknownName("scan", name, by_name)
    if not name and len(scans) != 1:
        raise InputError(
            f"there are {len(scans)} scans",
            file=source,
            cure=f"give --scan, such as {next(iter(by_name), '')}",
        )
    return by_name[name] if name else scans[0], wanted


def _keep(project: Project, entry: PickEdit) -> None:
    """Add a pick to the decisions, whose comments stay."""
    path = project.edits_file
    with alone(path):
        old = read_text(path) if path.exists() else ""
        edits = project.read_edits()
        if any((one.scan, one.name) == (entry.scan, entry.name) for one in edits.pick):
            raise InputError(
                f"{entry.name} is picked in {entry.scan} already",
                file=path,
                cure="give another name, or take the entry out",
            )
        text = edits_text(edits.model_copy(update={"pick": (*edits.pick, entry)}), old)
        with rewriting(path):
            write_text(path, text)
