"""Visits to scans: a scan is decoded once, and everything that is wanted of it is made meanwhile.

What is made is remembered, each product by its own key and made by its own task, so that whoever
asks for it afterwards (:func:`tribrach.job.each.each`) finds it there. A setting of one product
makes that product anew and no other.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tribrach._types import Progress
from tribrach.io.keeping import refuse_loss
from tribrach.io.outputs import take_over
from tribrach.job.each import Item, Made, make
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.scan.loading import LIMIT, HeldScan, hold
from tribrach.scan.no_return import find_no_return
from tribrach.scan.scan import Scan
from tribrach.tasks.engine import Call

__all__ = ["Wish", "Wishes", "visit"]


@dataclass(frozen=True)
class Wish:
    """A product of one scan that is wanted.

    Parameters
    ----------
    task
        Makes it, as for :func:`tribrach.job.each.each`; its first value is the scan.
    item
        What it is.
    """

    task: Callable[..., dict[str, Any]]
    item: Item

    def key(self, state: Remembered) -> str:
        """The digest of everything that the product depends on."""
        return state.key(self.task, *self.item.values)

    def known(self, state: Remembered) -> bool:
        """True if the product is remembered and nothing has changed."""
        return state.recall(self.item.product, self.key(state), *self.item.files) is not None


#: what is wanted of a scan
Wishes = Callable[[StationScan], Sequence[Wish]]


@dataclass(frozen=True)
class _Plan:
    """What is to be made of the scan of a number: which of the products that are wanted of it."""

    number: int
    parts: tuple[int, ...]


def visit(
    scans: Sequence[StationScan],
    wanted: Wishes,
    besides: Wishes,
    *,
    state: Remembered,
    progress: Progress,
) -> list[StationScan]:
    """Make what is wanted of every scan and not remembered, decoding the scan once.

    Parameters
    ----------
    scans
        As their files have them, or screened already.
    wanted
        Products that a scan is read for.
    besides
        Products that are made as well while a scan is read for others.
    state
        What is remembered, and who does what is not.
    progress
        Told of what is done.

    Returns
    -------
    list of StationScan
        The scans without their beams without return, as far as these are to be left out.

    Raises
    ------
    InputError
        A scan that cannot be read, or has too many points to be searched at once.
    """
    out = list(scans)
    plans, calls = [], []
    mark = f"{state.MADE}{uuid.uuid4().hex[:8]}-"
    for number, scan in enumerate(scans):
        out[number] = scan = _recalled(scan, state)
        first, more = wanted(scan), besides(scan)
        wishes = [*first, *more]
        # without its beams no key of an unscreened scan is known
        missing = [k for k, wish in enumerate(wishes) if scan.unscreened or not wish.known(state)]
        missing = missing if any(k < len(first) for k in missing) else []
        if missing or scan.unscreened:
            plans.append(_Plan(number, tuple(missing)))
            parts = tuple(_part(wishes[k], state, mark) for k in missing)
            values = (scan.scan, scan.unscreened, parts)
            calls.append(Call(f"{scan.name}", values, scan.scan.path, scan.scan.records or 0))
    try:
        for done, (beams, made) in state.engine.completed(_visited, calls, progress):
            plan = plans[done]
            scan = out[plan.number]
            if beams is not None:
                product, key = _beams(scan, state)
                state.remember(product, key, beams)
                out[plan.number] = scan = scan.screened(beams)
            wishes = [*wanted(scan), *besides(scan)]
            for k, (facts, path) in zip(plan.parts, made, strict=True):
                item = wishes[k].item
                if item.file is not None and path is not None:
                    take_over(path, item.file)
                state.remember(item.product, wishes[k].key(state), facts, *item.files)
    finally:
        state.drop(mark)
    return out


def _recalled(scan: StationScan, state: Remembered) -> StationScan:
    """A scan, screened if it is remembered what its beams without return are."""
    facts = state.recall(*_beams(scan, state)) if scan.unscreened else None
    return scan if facts is None else scan.screened(facts)


def _beams(scan: StationScan, state: Remembered) -> tuple[str, str]:
    """Product and key of the beams without return of a file; no calibration changes them."""
    plain = replace(scan.scan, correction=None)
    return f"beams-{plain.source}", state.key(find_no_return, plain)


#: a task, its values, and where it writes
_Part = tuple[Callable[..., dict[str, Any]], str, tuple[Any, ...], tuple[Path, str, Path] | None]


def _part(wish: Wish, state: Remembered, mark: str) -> _Part:
    item, place = wish.item, None
    if item.file is not None:
        refuse_loss(item.file)
        place = (state.folder, mark, item.file)
    return wish.task, item.what, item.values, place


def _visited(
    scan: Scan, unscreened: bool, parts: tuple[_Part, ...], *, progress: Progress
) -> tuple[dict[str, Any] | None, list[Made]]:
    """What the file has for beams without return if it is sought, and what the parts made."""
    if not parts:
        return asdict(find_no_return(scan)), []
    progress(f"points of {scan.source}", 0, None)
    beams, held = _held(scan, unscreened)
    made = []
    for task, what, values, place in parts:
        progress(what, 0, None)
        made.append(make(task, (_with(held, values[0]), *values[1:]), place, progress=progress))
    return beams, made


def _with(held: HeldScan, of: Any) -> Any:
    """The scan that a task gets, or what it gets of a station, with points in memory."""
    return held if isinstance(of, Scan) else replace(of, scan=held)


def _held(scan: Scan, unscreened: bool) -> tuple[dict[str, Any] | None, HeldScan]:
    """Beams without return if they are sought, and the other points in memory."""
    if not unscreened:
        return None, hold(scan)
    if scan.records is None or scan.records > LIMIT:
        # without its beams it may be no more than can be held
        beams = find_no_return(scan)
        return asdict(beams), hold(replace(scan, no_return=beams if beams.points else None))
    held = hold(scan, stored=True)
    beams = find_no_return(held)
    return asdict(beams), held.without(beams if beams.points else None)
