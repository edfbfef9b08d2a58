"""Visits to scans: a scan is decoded once, and everything that is wanted of it is made meanwhile.

What is made is remembered, each product by its own key and made by its own task, and handed on to
whoever asks for it afterwards (:func:`tribrach.job.each.each`). A setting of one product makes that
product anew and no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tribrach._types import Progress
from tribrach.job.each import Item, product_type
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.scan.loading import LIMIT, HeldScan, hold
from tribrach.scan.no_return import find_no_return
from tribrach.scan.scan import NoReturn, Scan
from tribrach.tasks.engine import Call


@dataclass(frozen=True)
class Wish:
    """A product of one scan that is wanted."""

    #: makes it, as for :func:`tribrach.job.each.each`; its first value is the scan
    task: Callable[..., Any]
    item: Item  #: what it is

    def key(self, state: Remembered) -> str:
        """The digest of everything that the product depends on."""
        return state.key(self.task, *self.item.values)

    def known(self, state: Remembered, key: str) -> bool:
        """True if the product is remembered and nothing has changed."""
        return state.known(self.item.product, key, product_type(self.task))


#: what is wanted of a scan
Wishes = Callable[[StationScan], Sequence[Wish]]


@dataclass(frozen=True)
class _Plan:
    """Products to make of one scan during its visit.

    keys : of all of them, empty while its beams without return are not known; beams : product and
    key of these where they are sought.
    """

    number: int
    parts: tuple[int, ...]
    keys: tuple[str, ...]
    beams: tuple[str, str] | None


def visit(
    scans: Sequence[StationScan],
    wanted: Wishes,
    besides: Wishes,
    *,
    state: Remembered,
    progress: Progress,
) -> list[StationScan]:
    """Make what is wanted of every scan and not remembered, decoding the scan once."""
    out = list(scans)
    plans, calls = [], []
    for number, scan in enumerate(scans):
        beams = _beams(scan, state) if scan.unscreened else None
        known = None if beams is None else state.recall(*beams, NoReturn)
        if known is not None:
            out[number], beams = scan.screened(known), None
        scan = out[number]
        first, more = wanted(scan), besides(scan)
        wishes = [*first, *more]
        # without its beams no key of an unscreened scan is known
        keys = () if scan.unscreened else tuple(wish.key(state) for wish in wishes)
        missing = [
            k for k, wish in enumerate(wishes) if scan.unscreened or not wish.known(state, keys[k])
        ]
        missing = missing if any(k < len(first) for k in missing) else []
        if missing or scan.unscreened:
            plans.append(_Plan(number, tuple(missing), keys, beams))
            chosen = [wishes[k] for k in missing]
            parts = tuple((wish.task, wish.item.what, wish.item.values) for wish in chosen)
            values = (scan.scan, scan.unscreened, parts)
            calls.append(Call(f"{scan.name}", values, scan.scan.path, scan.scan.records or 0))
    for done, (found, made) in state.engine.completed(_visited, calls, progress):
        plan = plans[done]
        scan, keys = out[plan.number], plan.keys
        if plan.beams is not None and found is not None:
            out[plan.number] = scan = scan.screened(state.remember(*plan.beams, found))
        wishes = [*wanted(scan), *besides(scan)]
        for k, product in zip(plan.parts, made, strict=True):
            name, key = wishes[k].item.product, keys[k] if keys else wishes[k].key(state)
            state.hand_on(name, key, state.remember(name, key, product))
    return out


def _beams(scan: StationScan, state: Remembered) -> tuple[str, str]:
    """Product and key of the beams without return of a file; no calibration changes them."""
    plain = replace(scan.scan, correction=None)
    return f"beams-{plain.source}", state.key(find_no_return, plain)


#: a task, what it does in words, and its values
_Part = tuple[Callable[..., Any], str, tuple[Any, ...]]


def _visited(
    scan: Scan, unscreened: bool, parts: tuple[_Part, ...], *, progress: Progress
) -> tuple[NoReturn | None, list[Any]]:
    """What the file has for beams without return if it is sought, and what the parts made."""
    if not parts:
        return find_no_return(scan), []
    progress(f"points of {scan.source}", 0, None)
    beams, held = _held(scan, unscreened)
    made = []
    for task, what, values in parts:
        progress(what, 0, None)
        made.append(task(_with(held, values[0]), *values[1:], progress=progress))
    return beams, made


def _with(held: HeldScan, of: Any) -> Any:
    """The scan that a task gets, or what it gets of a station, with points in memory."""
    return held if isinstance(of, Scan) else replace(of, scan=held)


def _held(scan: Scan, unscreened: bool) -> tuple[NoReturn | None, HeldScan]:
    """Beams without return if they are sought, and the other points in memory."""
    if not unscreened:
        return None, hold(scan)
    if scan.records is None or scan.records > LIMIT:
        # without its beams it may be no more than can be held
        beams = find_no_return(scan)
        return beams, hold(scan.screened(beams))
    held = hold(scan, stored=True)
    beams = find_no_return(held)
    return beams, held.without(beams if beams.points else None)
