"""What a file in :mod:`tribrach.report.chapters` declares about itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tribrach.report.chapter import Chapter
from tribrach.report.content import Head

if TYPE_CHECKING:
    from tribrach.job.results import JobResults


@dataclass(frozen=True)
class Subject:
    """A subject of the report."""

    key: str  #: key in the JSON result of what its chapters have as data
    #: makes its chapters from the head of the report and from what the job left besides the
    #: adjustment; none where the job has nothing to say
    chapters: Callable[[Head, JobResults], Iterable[Chapter]]
    #: what the JSON result holds under the key: a result, or a list or dictionary of results;
    #: None if its chapters have no data
    model: Any = None
    #: true if there may be several chapters: their data are a list in the JSON result
    several: bool = False
