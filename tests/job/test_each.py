"""Products by tasks: remembered one by one, in the order of the items, whoever makes them."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.keeping import keeping
from tribrach.io.outputs import write_text
from tribrach.job.each import Item, each
from tribrach.job.state import Remembered
from tribrach.tasks.engine import Call


def squared(number: float, *, progress: Progress) -> float:
    progress("squares", 1, 1)
    if number < 0:
        raise InputError("a negative number")
    return number**2


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
    made = each(squared, items(*numbers), state=state, progress=lambda what, *_: said.append(what))
    return made, said


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


def written(number: float, *, path: Path, progress: Progress) -> float:
    """A square in a file; zero is a disk that is full."""
    if number == 0:
        path.write_text("half")
        raise InputError("the file cannot be written (the disk is full)", file=path)
    write_text(path, str(number**2))
    return number


def squares(state: Remembered, folder: Path, *numbers: float) -> list[float]:
    wish = [
        Item(f"square-{n}", f"square of {n}", (n,), file=folder / f"{n:.0f}.txt") for n in numbers
    ]
    each(written, wish, state=state, progress=lambda *_: None)
    return [float((folder / f"{n:.0f}.txt").read_text()) for n in numbers]


def test_files_get_their_names_from_the_caller_alone(tmp_path: Path) -> None:
    """A task that fails leaves nothing, and the user reads the name that he knows."""
    state, folder = Remembered(tmp_path), tmp_path / "squares"
    with keeping(folder=tmp_path):
        assert squares(state, folder, 3.0, 2.0) == [9.0, 4.0]
        with pytest.raises(InputError) as refused:
            squares(state, folder, 5.0, 0.0)
    assert str(refused.value).startswith(f"{folder / '0.txt'}: the file cannot be written")
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left - {"lock"} == {"2.txt", "3.txt", "5.txt", "written.json"} | {
        f"square-{n}.json" for n in ("2.0", "3.0", "5.0")
    }


def test_a_file_of_another_size_is_made_again(tmp_path: Path) -> None:
    state = Remembered(tmp_path)
    assert squares(state, tmp_path, 3.0, 2.0) == [9.0, 4.0]
    (tmp_path / "3.txt").write_text("x")
    assert squares(state, tmp_path, 3.0, 2.0) == [9.0, 4.0]
    (tmp_path / "3.txt").unlink()
    assert squares(state, tmp_path, 3.0, 2.0) == [9.0, 4.0]


def test_a_file_of_another_program_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "3.txt").write_text("my own")
    with keeping(folder=tmp_path), pytest.raises(InputError, match="did not write"):
        squares(Remembered(tmp_path), tmp_path, 3.0)
    assert (tmp_path / "3.txt").read_text() == "my own"
