"""Which of several ways of computing a baseline is taken: fabricated figures, decided by hand."""

from dataclasses import replace

import pytest

from tribrach.gnss.attempts import Attempt, choose, comparison, reason

FLOAT = Attempt("L1 and L2", 2, "float", 0.04, 1.5, 0.008, scatter=0.1, pieces=10)
MOVED = Attempt(
    "moved", 2, "fixed", 0.98, 48.0, 0.003, away=0.003, scatter=0.0073, pieces=10, cures="mixed"
)
ALONE = Attempt("L1 alone", 1, "fixed", 0.97, 209.0, 0.004, away=0.005, scatter=0.0066, pieces=10)


def test_the_fixed_way_whose_pieces_scatter_least_is_taken() -> None:
    attempts = [FLOAT, MOVED, ALONE]
    assert choose(attempts) == 2
    assert choose([FLOAT, MOVED, replace(ALONE, scatter=0.0074)]) == 1
    words = reason(attempts, 2)
    assert words.startswith("L1 alone is taken (fixed, 97 % of the epochs fixed, ratio 209.0, 10")
    assert "instead of L1 and L2 (float, 4 % of the epochs fixed, ratio 1.5" in words
    # the cause is named only because moving the phases made the same frequencies fixed
    assert "mixed" in words
    assert "mixed" not in reason([FLOAT, replace(MOVED, ambiguities="float"), ALONE], 2)


def test_without_pieces_the_share_of_fixed_epochs_decides() -> None:
    short = [replace(a, scatter=None, pieces=0) for a in (FLOAT, MOVED, ALONE)]
    assert choose(short) == 1
    assert "pieces" not in reason(short, 1)


@pytest.mark.parametrize(("share", "expected"), [(0.59, 0), (0.60, 1)])
def test_a_share_of_sixty_percent_is_needed(share: float, expected: int) -> None:
    assert choose([FLOAT, replace(ALONE, fixed_share=share)]) == expected


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, 1),
        ({"ambiguities": "float"}, 0),
        # wrong integers: 4 times the root of 8 mm and 4 mm squared is 35.8 mm
        ({"away": 0.0357}, 1),
        ({"away": 0.0359}, 0),
        # fixed, and yet its pieces scatter more than those of the float solution
        ({"scatter": 0.11}, 0),
    ],
)
def test_what_a_way_needs_to_replace_a_float_baseline(
    change: dict[str, float | str], expected: int
) -> None:
    attempts = [FLOAT, replace(ALONE, **change)]  # type: ignore[arg-type]
    assert choose(attempts) == expected
    if not expected:
        assert reason(attempts, 0).startswith("L1 and L2 is kept")
        assert attempts[1].words in reason(attempts, 0)


@pytest.mark.parametrize(("scatter", "expected"), [(0.0131, 0), (0.0133, 1), (None, 0)])
def test_a_fixed_baseline_gives_way_only_to_half_of_its_scatter(
    scatter: float | None, expected: int
) -> None:
    first = replace(FLOAT, ambiguities="fixed", fixed_share=0.45, scatter=scatter)
    assert choose([first, ALONE]) == expected


@pytest.mark.parametrize(
    ("change", "expected"), [({}, 1), ({"ratio": 3.0}, 0), ({"fixed_share": 0.84}, 0)]
)
def test_wrong_integers_of_mixed_phases_give_way_without_pieces(
    change: dict[str, float], expected: int
) -> None:
    """Ten minutes that were fixed with ratio 1.5, and with 48 once the phases are of one kind."""
    first = replace(FLOAT, ambiguities="fixed", fixed_share=0.85, scatter=None, pieces=0)
    moved = replace(MOVED, scatter=None, pieces=0)
    attempts = [first, replace(moved, **change)]
    assert choose(attempts) == expected
    assert ("a quarter of a cycle" in reason(attempts, choose(attempts))) is bool(expected)
    # L1 alone cures nothing
    assert choose([first, replace(ALONE, scatter=None)]) == 0


def test_comparison_has_a_line_for_each() -> None:
    lines = comparison([FLOAT, MOVED, replace(ALONE, taken=True)])
    assert [line.endswith("(taken)") for line in lines] == [False, False, True]
    assert (
        "10 pieces scatter by 100.0 mm (standard deviation, none left out), sigma 8.0 mm"
        in lines[0]
    )
    assert "5.0 mm from the first" in lines[2]
