"""What was found in scans: targets and refused candidates as lines, a list and panoramas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from tribrach.answers import Form, Result, Vector
from tribrach.io.outputs import Content, write_texts
from tribrach.job.find_targets import Findings
from tribrach.job.grouping import file_name
from tribrach.job.state import FOUND
from tribrach.report.answer import Answer
from tribrach.report.panoramas import panorama_file
from tribrach.sentences import Sentence, written
from tribrach.targets.detection import Detection

#: folder of these files among the results, and the list in it
FOLDER, LIST = FOUND, "targets.json"


@dataclass(frozen=True, eq=False)
class RejectedTarget(Result):
    """What looked like a target and was none."""

    scan: str
    kind: str
    #: in the frame of its scan [m]
    center: Vector
    reason: str


@dataclass(frozen=True)
class FoundTargets(Result):
    """Targets and candidates of scans, centres in the frames of their scans."""

    targets: tuple[Detection, ...]
    rejected: tuple[RejectedTarget, ...]


FORM = Form("targets", FoundTargets, 1)


def answer_of(findings: Sequence[Findings]) -> Answer:
    """The targets as an answer: a line for each target and candidate."""
    found = tuple(d for f in findings for d in f.detections)
    rejected = tuple(RejectedTarget(f.scan, **vars(r)) for f in findings for r in f.rejected)
    scans = ", ".join(f.scan for f in findings)
    lines = [line for finding in findings for line in _lines(finding)]
    result = FoundTargets(found, rejected)
    return Answer("Targets in scans", scans, None, result, FORM, terminal=lines)


def _lines(finding: Findings) -> list[str]:
    """One line per target and per rejected candidate."""
    lines = [
        f"{finding.scan}: {finding.points} points, {len(finding.detections)} targets, "
        f"{len(finding.rejected)} candidates rejected",
        *(f"  ! {sentence}" for sentence in finding.sentences),
    ]
    for number, d in enumerate(finding.detections, start=1):
        x, y, z = d.center
        sigma = ", ".join(written(s, "mm2~") for s in d.sigmas)
        far = Sentence("  range {d.range:m2}", d=d) if isfinite(d.range) else ""
        lines.append(
            Sentence(
                "  {number}  {d.kind}  {x:5} {y:5} {z:m5}  sigma {sigma} mm  rms {d.rms:mm2} "
                "within the limit of its fit  {d.points} points{far}",
                number=number,
                d=d,
                x=x,
                y=y,
                z=z,
                sigma=sigma,
                far=far,
            )
        )
    for r in finding.rejected:
        x, y, z = r.center
        lines.append(Sentence("  x  {r.kind} at {x:3} {y:3} {z:3}: {r.reason}", r=r, x=x, y=y, z=z))
    return lines


def write_found(findings: Sequence[Findings], folder: Path) -> list[Path]:
    """Write what was found in scans, also where nothing comes of it."""
    place = folder / FOLDER
    files: dict[Path, Content] = {place / LIST: answer_of(findings).json()}
    for number, finding in enumerate(findings, start=1):
        if finding.panorama is not None:
            name = f"{number}-{file_name(finding.scan)}.png"
            files[place / name] = panorama_file(finding.panorama, "PNG")
    return write_texts(files)
