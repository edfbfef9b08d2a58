"""Times as people read them: dates and hours in UTC, and ticks at round ones along a chart."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

#: months as they stand at ticks, whatever language the machine speaks
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_MINUTE, _HOUR, _DAY = 60, 3600, 86400
#: steps of ticks that divide a day [s], whole days, months
_OF_DAY = (
    *(k * _MINUTE for k in (1, 2, 5, 10, 15, 30)),
    *(k * _HOUR for k in (1, 2, 3, 6, 12)),
)
_DAYS = (1, 2, 7, 14)
_OF_YEAR = (1, 2, 3, 6)
#: shortest month and year [s], so that ticks are never more than asked for
_MONTH, _YEAR = 28 * _DAY, 365 * _DAY


def _at(seconds: float) -> datetime:
    """A time in UTC; seconds since 1970."""
    # times that were kept in days lack a rounding error to the full minute
    return datetime.fromtimestamp(round(seconds, 3), UTC)


def clock(seconds: float) -> str:
    """A time to the minute that it lies in, without its zone, which is UTC.

    Examples
    --------
    >>> clock(1740787207.0)
    '2025-03-01 00:00'
    """
    return f"{_at(seconds):%Y-%m-%d %H:%M}"


def clocks(one: float, two: float) -> str:
    """A span of time; a day that both ends share is written once.

    Examples
    --------
    >>> clocks(1740787200.0, 1740801600.0)
    '2025-03-01 00:00 and 04:00 UTC'
    >>> clocks(1740787200.0, 1740888000.0)
    '2025-03-01 00:00 and 2025-03-02 04:00 UTC'
    """
    day, last = clock(one)[:10], clock(two)
    return f"{clock(one)} and {last.removeprefix(day).strip()} UTC"


def time_label(low: float, high: float) -> str:
    """What the ticks of a time axis leave out: its day where it is one, else its years."""
    first, last = _at(low), _at(high)
    if first.date() == last.date():
        return f"{_date(first)} {first.year}, UTC"
    years = f"{first.year}" if first.year == last.year else f"{first.year} to {last.year}"
    return f"{years}, UTC"


def time_ticks(low: float, high: float, most: int = 6) -> list[tuple[float, str]]:
    """Round times from low to high with their words, at most ``most`` steps.

    Minutes, hours, days, months or years, whatever fits. Midnights among hours are named by their
    date, the first of January among months by its year.

    Examples
    --------
    >>> [words for _, words in time_ticks(1740787200.0, 1740830400.0)]
    ['1 Mar', '02:00', '04:00', '06:00', '08:00', '10:00', '12:00']
    """
    return [(at.timestamp(), words) for at, words in next(_choices(low, high, most))]


def _choices(low: float, high: float, most: int) -> Iterator[list[tuple[datetime, str]]]:
    """Ticks of every step that is wide enough, the narrowest first."""
    least = max(high - low, float(_MINUTE)) / most
    for step in _OF_DAY:
        if step >= least:
            times = [_at(k * step) for k in range(-int(-low // step), int(high // step) + 1)]
            yield [(t, f"{t:%H:%M}" if t.hour or t.minute else _date(t)) for t in times]
    midnights = range(-int(-low // _DAY), int(high // _DAY) + 1)
    for days in _DAYS:
        if days * _DAY >= least:
            yield [(t, _date(t)) for t in (_at(k * _DAY) for k in midnights[::days])]
    firsts = list(_firsts(low, high))
    for months in _OF_YEAR:
        if months * _MONTH >= least:
            chosen = [t for t in firsts if (t.month - 1) % months == 0]
            yield [(t, _MONTHS[t.month - 1] if t.month > 1 else f"{t.year}") for t in chosen]
    for years in (k * 10**p for p in range(4) for k in (1, 2, 5)):
        if years * _YEAR >= least:
            chosen = [t for t in firsts if t.month == 1 and t.year % years == 0]
            yield [(t, f"{t.year}") for t in chosen]


def _firsts(low: float, high: float) -> Iterator[datetime]:
    """The firsts of the months from low to high."""
    at = _at(low).replace(day=1, hour=0, minute=0, second=0, microsecond=0)
    while at.timestamp() <= high:
        if at.timestamp() >= low:
            yield at
        at = (at + timedelta(days=32)).replace(day=1)


def _date(at: datetime) -> str:
    """A day as it stands at ticks."""
    return f"{at.day} {_MONTHS[at.month - 1]}"
