"""What terminals, logs, notebooks and callers are told of work that takes long."""

import io

import pytest

from tribrach import progress


class Clock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_log_has_one_line_a_stage_with_its_time() -> None:
    out, clock = io.StringIO(), Clock()
    with progress.in_lines(out, clock) as tell:
        for done in (0, 5, 10):
            tell("points of S1", done, 10)
            clock.now += 1.5
        tell("short", 0, None)
        clock.now += 0.2
        tell("clouds\x1b[2J", 0, None)
        clock.now += 65.0
    assert out.getvalue().splitlines() == [
        "  points of S1, 10: 4.5 s (after 0:04)",
        "  clouds\ufffd[2J: 65.0 s (after 1:09)",
    ]


def test_what_fails_still_says_how_long_it_took() -> None:
    out, clock = io.StringIO(), Clock()

    def work() -> None:
        with progress.in_lines(out, clock) as tell:
            tell("points", 0, None)
            clock.now += 3
            raise RuntimeError

    with pytest.raises(RuntimeError):
        work()
    assert "points: 3.0 s" in out.getvalue()


def test_a_notebook_says_how_far_and_how_long_still() -> None:
    lines, clock = [], Clock()

    def show(first: str):
        lines.append(first)
        return lines.append

    with progress.in_notebook(show, clock) as tell:
        tell("points of S1", 0, 100)
        clock.now = 10.0
        tell("points of S1", 25, 100)
        clock.now = 10.1
        tell("points of S1", 26, 100)
        tell("matching", 0, None)
        clock.now = 70.0
    assert lines == [
        "0:00  stage 1: points of S1, 0%",
        # a quarter took ten seconds: three quarters take thirty
        "0:10  stage 1: points of S1, 25%, still 0:30",
        "0:10  stage 2: matching",
        "1:10  2 stages, done",
    ]


def test_a_caller_is_told_and_nobody_else() -> None:
    told = []
    with progress.watched(lambda *said: told.append(said)) as tell:
        tell("a", 1, 2)
    assert told == [("a", 1, 2)]
    with progress.watched(None) as tell:
        assert tell is progress.silent


def test_a_terminal_is_told_without_a_word_left(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.in_terminal() as tell:
        tell("points [of] S1", 1, 3)
        tell("next", 0, None)
    assert capsys.readouterr().out == ""
