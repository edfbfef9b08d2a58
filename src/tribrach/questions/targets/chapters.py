"""Targets and rejected candidates of scans as files: one list, a panorama of every scan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tribrach.io.outputs import write_texts
from tribrach.job.grouping import file_name
from tribrach.job.state import FOUND
from tribrach.report.panoramas import panorama_file
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.scans import SCHEMA, TargetsDocument

if TYPE_CHECKING:
    from tribrach.job.find_targets import Findings

__all__ = ["FOLDER", "LIST", "targets_document", "write_found"]

#: folder of these files among the results, and the list in it
FOLDER, LIST = FOUND, "targets.json"


def targets_document(findings: Sequence[Findings]) -> str:
    """Targets and candidates of scans as JSON, centres in the frames of their scans."""
    data = heading(SCHEMA) | {
        "targets": [d.to_dict() for f in findings for d in f.detections],
        "rejected": [{"scan": f.scan, **r.to_dict()} for f in findings for r in f.rejected],
    }
    return document_text(TargetsDocument.model_validate(data))


def write_found(findings: Sequence[Findings], folder: Path) -> list[Path]:
    """Write what was found in scans, also where nothing comes of it.

    Parameters
    ----------
    findings : sequence of Findings
        Of all scans.
    folder : Path
        Folder of the results.

    Returns
    -------
    list of Path
        The list and the panoramas, numbered in the order of the scans.

    Raises
    ------
    InputError
        A file cannot be written, or would take the place of one that this program did not write.
    """
    place = folder / FOLDER
    files: dict[Path, str | bytes] = {place / LIST: targets_document(findings)}
    for number, finding in enumerate(findings, start=1):
        if finding.panorama is not None:
            name = f"{number}-{file_name(finding.scan)}.png"
            files[place / name] = panorama_file(finding.panorama, "PNG")
    return write_texts(files)
