"""Times along charts and in words."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.answers import stamp
from tribrach.report.times import clock, clocks, time_label, time_ticks

START = datetime(2025, 3, 1, tzinfo=UTC)


def ticks(first: datetime, span: timedelta, most: int = 6) -> list[str]:
    low = first.timestamp()
    return [words for _, words in time_ticks(low, low + span.total_seconds(), most)]


@pytest.mark.parametrize(
    ("span", "words"),
    [
        (timedelta(minutes=30), ["1 Mar", "00:05", "00:10", "00:15", "00:20", "00:25", "00:30"]),
        (timedelta(hours=20), ["1 Mar", "06:00", "12:00", "18:00"]),
        (timedelta(hours=60), ["1 Mar", "12:00", "2 Mar", "12:00", "3 Mar", "12:00"]),
        (timedelta(days=10), ["1 Mar", "3 Mar", "5 Mar", "7 Mar", "9 Mar", "11 Mar"]),
        (timedelta(days=60), ["1 Mar", "15 Mar", "29 Mar", "12 Apr", "26 Apr"]),
        (timedelta(days=400), ["Apr", "Jul", "Oct", "2026", "Apr"]),
        (timedelta(days=700), ["Jul", "2026", "Jul", "2027"]),
        (timedelta(days=3000), ["2026", "2028", "2030", "2032"]),
    ],
)
def test_ticks_are_round(span: timedelta, words: list[str]) -> None:
    assert ticks(START, span) == words


@given(
    st.datetimes(datetime(1980, 1, 1), datetime(2100, 1, 1)),
    st.floats(60, 3e9),
    st.integers(2, 12),
)
def test_ticks_lie_within_and_are_sparse(first: datetime, span: float, most: int) -> None:
    """Between the ends, rising, and no more steps than asked for."""
    low = first.replace(tzinfo=UTC).timestamp()
    places = [at for at, _ in time_ticks(low, low + span, most)]
    assert len(places) <= most + 1
    assert places == sorted(set(places))
    assert all(low - 1e-3 <= at <= low + span + 1e-3 for at in places)


def test_the_axis_says_what_its_ticks_leave_out() -> None:
    low = START.timestamp()
    assert time_label(low, low + 3600) == "1 Mar 2025, UTC"
    assert time_label(low, low + 10 * 86400) == "2025, UTC"
    assert time_label(low, low + 400 * 86400) == "2025 to 2026, UTC"


def test_a_time_that_was_kept_in_days_keeps_its_minute() -> None:
    """Days times seconds of a day may be a little less than the full minute."""
    for k in range(2000):
        seconds = 1740787200.0 + 60 * k
        days = seconds / 86400
        assert clock(days * 86400 - 2e-7) == clock(seconds)
        assert stamp(days * 86400 - 2e-7) == stamp(seconds)
    assert stamp(1740787200.0) == "2025-03-01T00:00:00Z"
    assert clocks(1740787200.0, 1740787200.0 + 60) == "2025-03-01 00:00 and 00:01 UTC"
