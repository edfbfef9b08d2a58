"""What a run leaves in its folder: the report in three forms, and what its job brings besides."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tribrach.io.keeping import refuse_loss
from tribrach.io.outputs import Content, write_texts
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.questions.epochs.from_files import EPOCH, epoch_text
from tribrach.report import html, json_result, text
from tribrach.report.content import Report
from tribrach.report.workbench_parts import workbench_texts

__all__ = ["refuse_reports", "write"]

#: what every run leaves, by name
_REPORTS: dict[str, Callable[[Report], Content]] = {
    "report.html": html.render,
    "report.txt": text.render,
    "result.json": json_result.pieces,
}


def refuse_reports(folder: Path) -> None:
    """Refuse reports that would take the place of another file, before any work is done."""
    for name in _REPORTS:
        refuse_loss(folder / name)


def write(content: Report, folder: Path) -> list[Path]:
    """Write all reports, lever arms, the epoch that is wanted, and what the workbench shows."""
    job = content.job
    files: dict[Path, Content] = {
        **lever_arm_files(job.lever_arms, folder, content.datum.sentence, content.sigma_origin),
        **workbench_texts(content, folder),
    }
    if job.project is not None and job.project.output.epoch:
        files[folder / EPOCH] = epoch_text(content.adjustment, job.project.title)
    return write_texts(files | {folder / name: make(content) for name, make in _REPORTS.items()})
