"""Products of many scans or pairs: those of the last run where they hold, the others by tasks.

Only the caller touches what is remembered. A product is noted as soon as its task is done, so that
a run that is stopped loses only what was being worked on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tribrach._types import Progress
from tribrach.job.state import Remembered
from tribrach.tasks.engine import Call

__all__ = ["Item", "each"]


@dataclass(frozen=True)
class Item:
    """A product that is wanted.

    Parameters
    ----------
    product
        Its name among what is remembered.
    what
        What is done for it, in words, such as ``targets of S1``.
    values
        What its task gets: all that it depends on.
    file
        The file that its task reads above all.
    cost
        Work in comparison to the other items, such as points.
    """

    product: str
    what: str
    values: tuple[Any, ...]
    file: Path | None = None
    cost: float = 0.0


def each(
    task: Callable[..., dict[str, Any]],
    items: Sequence[Item],
    *,
    state: Remembered,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Facts of every item; those that have not changed since the last run come from there.

    Parameters
    ----------
    task
        A function of a module that makes the facts of an item from its values, and gets
        ``progress``; see :mod:`tribrach.tasks.engine`.
    items
        What is wanted; products of different names.
    state
        What is remembered, and who does what is not.
    progress
        Told of what is done.

    Returns
    -------
    list of dict
        Facts in the order of the items, as JSON can hold them.

    Raises
    ------
    Exception
        What the first task that fails raises; the products of those before it are remembered.
    """
    keys = [state.key(task, *item.values) for item in items]
    facts = [state.recall(item.product, key) for item, key in zip(items, keys, strict=True)]
    missing = [number for number, known in enumerate(facts) if known is None]
    calls = [
        Call(item.what, item.values, item.file, item.cost)
        for item in (items[number] for number in missing)
    ]
    for k, made in state.engine.completed(task, calls, progress):
        number = missing[k]
        state.remember(items[number].product, keys[number], made)
        facts[number] = made
    return [known for known in facts if known is not None]
