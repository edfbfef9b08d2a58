"""Products by tasks: remembered one by one, in the order of the items, whoever makes them."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.job.each import Item, each
from tribrach.job.state import Remembered
from tribrach.tasks.engine import Call


def squared(number: float, *, progress: Progress) -> dict[str, Any]:
    progress("squares", 1, 1)
    if number < 0:
        raise InputError("a negative number")
    return {"square": number**2}


class Backwards:
    """An engine that is ready with the last call first."""

    def completed(
        self, task: Callable[..., Any], calls: Sequence[Call], progress: Progress
    ) -> Iterator[tuple[int, Any]]:
        for number in reversed(range(len(calls))):
            yield number, task(*calls[number].values, progress=progress)


def items(*numbers: float) -> list[Item]:
    return [Item(f"square-{n}", f"square of {n}", (n,)) for n in numbers]


def wanted(state: Remembered, *numbers: float) -> tuple[list[float], list[str]]:
    """Squares, and what was said while they were made."""
    said: list[str] = []
    made = each(
        squared, items(*numbers), state=state, progress=lambda what, done, total: said.append(what)
    )
    return [facts["square"] for facts in made], said


def test_only_what_is_not_remembered_is_made(tmp_path: Path) -> None:
    assert wanted(Remembered(tmp_path), 3.0, 2.0) == (
        [9.0, 4.0],
        ["square of 3.0", "squares", "square of 2.0", "squares"],
    )
    assert wanted(Remembered(tmp_path), 2.0, 5.0, 3.0) == (
        [4.0, 25.0, 9.0],
        ["square of 5.0", "squares"],
    )


def test_results_are_in_the_order_of_the_items(tmp_path: Path) -> None:
    state = Remembered(tmp_path, Backwards())
    assert wanted(state, 3.0, 2.0, 7.0)[0] == [9.0, 4.0, 49.0]
    assert wanted(Remembered(tmp_path), 3.0, 2.0, 7.0) == ([9.0, 4.0, 49.0], [])


def test_what_was_made_before_a_failure_is_remembered(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a negative number"):
        wanted(Remembered(tmp_path), 3.0, -1.0, 2.0)
    assert wanted(Remembered(tmp_path), 3.0)[1] == []
    assert wanted(Remembered(tmp_path), 2.0)[1] != []
