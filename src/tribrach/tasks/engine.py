"""Who does tasks: by default this process, one after the other.

A task is a function of a module and the values that it gets; it knows nothing of other tasks, of
what is remembered, or of who does it. So every engine gives the same results, bit by bit:

* its values travel: they are small and can be pickled. Points stay in their files, which a task
  reads itself, and large results go into files of their own;
* what it depends on is in its values: seeds and quotas come from the number of a part, never from
  what was done before;
* results are put in the order of the calls by their numbers, whoever was ready first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from tribrach._types import Progress

R = TypeVar("R")


@dataclass(frozen=True)
class Call:
    """A task that is to be done."""

    what: str  #: in words, such as ``targets of S1``: progress and errors speak of it so
    values: tuple[Any, ...]  #: what the task gets
    file: Path | None = None  #: the file that it reads above all, where there is one
    #: work in comparison to the other calls, such as points: the longest are begun first where
    #: several are done at a time
    cost: float = 0.0


class Engine(Protocol):
    """Who does the tasks on scans: this process, other processes, or a cluster."""

    def completed(
        self, task: Callable[..., R], calls: Sequence[Call], progress: Progress
    ) -> Iterator[tuple[int, R]]:
        """Do a task for each call; results as they come."""
        ...


class InProcess:
    """Does one task after the other in this process."""

    def completed(
        self, task: Callable[..., R], calls: Sequence[Call], progress: Progress
    ) -> Iterator[tuple[int, R]]:
        """Do a task for each call, in their order; see :meth:`Engine.completed`."""
        for number, call in enumerate(calls):
            progress(call.what, 0, None)
            yield number, task(*call.values, progress=progress)


#: this process
HERE: Engine = InProcess()
