"""Products of many scans or pairs: those of the last run where they hold, the others by tasks.

Only the caller touches what is remembered and gives files their names: a task writes its file under
a name of its own in the folder of what is remembered, so that two that do the same, one of them
taken for dead, never write into one file. A product is noted as soon as its task is done, so that
a run that is stopped loses only what was being worked on.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.keeping import refuse_loss
from tribrach.io.outputs import take_over
from tribrach.job.state import Remembered
from tribrach.tasks.engine import Call

R = TypeVar("R")


@dataclass(frozen=True)
class Item:
    """A product that is wanted."""

    product: str  #: its name among what is remembered
    what: str  #: what is done for it, in words, such as ``targets of S1``
    values: tuple[Any, ...]  #: what its task gets: all that it depends on
    source: Path | None = None  #: the file that its task reads above all
    cost: float = 0.0  #: work in comparison to the other items, such as points
    #: the file that its task writes, on the disk of the results; None if it writes none
    file: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files of the product."""
        return () if self.file is None else (self.file,)


def each(
    task: Callable[..., R],
    items: Sequence[Item],
    *,
    state: Remembered,
    progress: Progress,
    made: Callable[[int], None] = lambda number: None,
) -> list[R]:
    """Products of every item; those that have not changed since the last run come from there."""
    keys = [state.key(task, *item.values) for item in items]
    form = product_type(task)
    found = [
        state.recall(item.product, key, form, *item.files)
        for item, key in zip(items, keys, strict=True)
    ]
    products = {number: product for number, product in enumerate(found) if product is not None}
    missing = [number for number in range(len(items)) if number not in products]
    mark = f"{state.MADE}{uuid.uuid4().hex[:8]}-"
    calls = []
    for item in (items[number] for number in missing):
        values: tuple[Any, ...] = (task, item.values, None)
        if item.file is not None:
            refuse_loss(item.file)
            values = (task, item.values, (state.folder, mark, item.file))
        calls.append(Call(item.what, values, item.source, item.cost))
    try:
        for k, (product, path) in state.engine.completed(_make, calls, progress):
            number = missing[k]
            item = items[number]
            if item.file is not None and path is not None:
                take_over(path, item.file)
            made(number)
            products[number] = state.remember(item.product, keys[number], product, *item.files)
    finally:
        state.drop(mark)
    return [products[number] for number in range(len(items))]


def product_type(task: Callable[..., Any]) -> Any:
    """The type of the products of a task, which its hints tell."""
    return get_type_hints(task)["return"]


def _make(
    task: Callable[..., R],
    values: tuple[Any, ...],
    place: tuple[Path, str, Path] | None,
    *,
    progress: Progress,
) -> tuple[R, Path | None]:
    """Do the task of an item; its product, and its file under a name that nobody else gives.

    place : folder, mark and file of the product, None where it has none.
    """
    if place is None:
        return task(*values, progress=progress), None
    folder, mark, file = place
    path = folder / f"{mark}{uuid.uuid4().hex[:8]}-{file.name}"
    try:
        return task(*values, path=path, progress=progress), path
    except InputError as error:
        if error.file is None or Path(error.file) != path:
            raise
        # the user knows the file by the name that it would have had
        raise InputError(
            error.what, file=file, line=error.line, record=error.record, cure=error.cure
        ) from error
