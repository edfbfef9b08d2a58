"""The chapters of a report: one file each, and the order in which a report has them.

A new chapter is a file that declares a ``SUBJECT`` whose key is the name of the file, and that
name in :data:`CHAPTERS`. A file is loaded for reports that may have the chapter: a network of some
points needs nothing of what scans, comparisons or receivers need.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import TYPE_CHECKING

from tribrach.observations.gnss import GnssBaselines
from tribrach.report.subject import Subject

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.report.content import Head

#: whether a report may have a chapter
When = Callable[["Head", "JobResults"], bool]


def _always(head: Head, job: JobResults) -> bool:
    return True


def _with_baselines(head: Head, job: JobResults) -> bool:
    observations = head.adjustment.network.observations
    return bool(job.sessions) or any(isinstance(o, GnssBaselines) for o in observations)


def _with_angles(head: Head, job: JobResults) -> bool:
    return any(o.kind in ("direction", "angle") for o in head.adjustment.network.observations)


#: in the order of the report, with when there is something to ask the file for; chapters that one
#: signs come before all others
CHAPTERS: dict[str, When] = {
    "stations": _always,
    "control": _always,
    "points": _always,
    "observations": _always,
    "traverses": _with_angles,
    "side_shots": lambda head, job: bool(head.adjustment.network.facts),
    "georeferencing": lambda head, job: job.project is not None,
    "scans": lambda head, job: job.placed is not None,
    "adjustment": _always,
    "unknowns": _always,
    "registration": lambda head, job: job.registered is not None,
    "comparisons": lambda head, job: bool(job.comparisons),
    "observed_noise": lambda head, job: job.placed is not None,
    "epochs": lambda head, job: bool(job.epochs),
    "reductions": lambda head, job: bool(head.adjustment.network.facts),
    "gnss": _with_baselines,
    "lever_arm_calibration": lambda head, job: job.antennas is not None,
    "rigid_model": lambda head, job: job.antennas is not None,
    "instruments": _always,
}


def named(name: str) -> Subject:
    """What the file of a chapter declares."""
    subject: Subject = import_module(f"tribrach.report.chapters.{name}").SUBJECT
    return subject


def subjects(head: Head, job: JobResults) -> Iterator[Subject]:
    """Give the subjects that a report may have chapters of."""
    for name, when in CHAPTERS.items():
        if when(head, job):
            yield named(name)
