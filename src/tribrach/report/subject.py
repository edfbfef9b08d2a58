"""What a file in :mod:`tribrach.report.chapters` declares about itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tribrach.job.results import JobResults
from tribrach.report.chapter import Chapter
from tribrach.report.content import Head

__all__ = ["Subject"]


@dataclass(frozen=True)
class Subject:
    """A subject of the report.

    Parameters
    ----------
    key : str
        Key in the JSON result of what its chapters have as data.
    chapters : callable
        Makes its chapters from the head of the report and from what the job left besides the
        adjustment; none where the job has nothing to say.
    several : bool
        True if there may be several chapters: their data are a list in the JSON result.
    """

    key: str
    chapters: Callable[[Head, JobResults], Iterable[Chapter]]
    several: bool = False
