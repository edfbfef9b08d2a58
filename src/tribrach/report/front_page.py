"""What stands first on a report: the verdict, what was measured, and what is to be signed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach.observations.registry import kind_named
from tribrach.report.chapters.adjustment import Marked, marked
from tribrach.report.content import Control, Point, Report, StationRow
from tribrach.report.epochs import moved_sentence
from tribrach.report.names import some_of, spoken
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.sentences import Sentence, capital, joined

#: lines of ``[facts]`` that have a place of their own in the head
_HEAD = ("job", "client", "author", "logo")
_AXES = ("E", "N", "U")
#: marked observations that the verdict names, and those that the line below it names
_IN_VERDICT, _IN_LINE = 2, 4


@dataclass(frozen=True)
class Letterhead:
    """Job, client and author as the project gives them, and its logo as an address of data."""

    job: str
    client: str
    author: str
    logo: str


def letterhead(facts: Mapping[str, str], logo: str) -> tuple[Letterhead, tuple[str, ...]]:
    """The head of the pages, and the names of the facts that it shows."""
    known = {name.strip().lower(): name for name in facts}
    used = tuple(known[key] for key in _HEAD if key in known)
    job, client, author = (facts.get(known.get(key, ""), "") for key in _HEAD[:3])
    return Letterhead(job, client, author, logo), used


def front_page(content: Report) -> FrontPage:
    """What stands first."""
    found = marked(content)
    sort, verdict = _verdict(content, found)
    shown = letterhead(dict(content.facts), "")[1]
    lines = [
        ("Measured", _measured(content)),
        ("Datum", content.datum.sentence),
        ("Fit", _fit(content)),
        ("Marked", _marked(found)),
        ("Least certain", _worst(content)),
        ("Check points", _checks(content)),
        *(("What moved", moved_sentence(one.comparison)) for one in content.job.epochs),
        ("Clouds", _clouds(content)),
        ("Sigmas", content.sigma_origin),
        *((name, value) for name, value in content.facts if name not in shown),
    ]
    return FrontPage(
        sort,
        verdict,
        content.summary.test.sentence,
        tuple((name, text) for name, text in lines if text),
        _signed(content),
    )


def _verdict(content: Report, found: Marked) -> tuple[Literal["good", "look", "bad", "none"], str]:
    """How it ended, by the global test and by what was found besides."""
    test, todo = content.summary.test, _todo(content, found)
    if test.accepted is None:
        return "none", "Not checked: no redundancy"
    if not test.accepted:
        return "bad", f"Global test failed{todo if found.act else ''}"
    return ("look" if todo else "good"), f"Global test passed{todo}"


def _todo(content: Report, found: Marked) -> str:
    """Things to look into, by name where observations are marked."""
    grave = content.grave
    if not found.act:
        things = f"; {counted(grave, 'thing')} to look into before you sign"
        return things if grave else ""
    others = f" and at {counted(grave - 1, 'other thing')}" if grave > 1 else ""
    return f"; before you sign look at {some_of(found.names, _IN_VERDICT)}{others}"


def _marked(found: Marked) -> str:
    """Which observations are beyond their limits, and where they are seen."""
    if not found.names:
        return ""
    chance = "" if found.act else "no more than chance makes in a network of this size; "
    said = Sentence(
        "{names} ({found.counted}): {chance}what to do about each stands under Worst observations.",
        names=some_of(found.names, _IN_LINE),
        found=found,
        chance=chance,
    )
    return _begun(said)


def _measured(content: Report) -> str:
    """How much was measured, of which kinds, from where."""
    counts: dict[str, int] = {}
    for kind in content.summary.kinds:
        title = kind_named(kind.kind).facts.title
        counts[title] = counts.get(title, 0) + kind.active
    parts = [f"{title} {n}" for title, n in counts.items() if n]
    summary = content.summary
    held = [
        f"{n} {words}"
        for n, words in ((summary.n_check, "held out"), (summary.n_off, "switched off"))
        if n
    ]
    where = [
        counted(n, noun)
        for n, noun in ((len(content.points), "point"), (len(content.stations), "scanner station"))
        if n
    ]
    more = f" ({', '.join(held)})" if held else ""
    return (
        f"{counted(summary.n_observations, 'observed value')}{more} on {' and '.join(where)}: "
        f"{', '.join(parts)}."
    )


def _fit(content: Report) -> str:
    """Sigma0 in words."""
    summary = content.summary
    after = summary.sigma0_posterior
    if after is None:
        return "There is no redundancy: nothing was measured a second time."
    ratio = after / summary.sigma0 if summary.sigma0 else after
    return Sentence(
        "σ₀ is {after:3} where {summary.sigma0:g} was expected, with redundancy "
        "{summary.dof}: the observations fit {times}.",
        after=after,
        summary=summary,
        times=_times(ratio),
    )


def _times(ratio: float) -> str:
    """The ratio of sigma0 in words."""
    if 0.95 <= ratio <= 1.05:
        return "as well as the given sigmas say"
    side = "worse" if ratio > 1 else "better"
    return Sentence("{ratio:%} {side} than the given sigmas say", ratio=abs(ratio - 1), side=side)


def _worst(content: Report) -> str:
    """The largest sigma of a point and of a station."""
    parts = []
    for noun, items in (("point", content.points), ("station", content.stations)):
        worst = _largest(items)
        if worst is not None:
            name, sigma, axis = worst
            parts.append(
                Sentence(
                    "{noun} {name} with σ {sigma:mm2} in {axis}",
                    noun=noun,
                    name=name,
                    sigma=sigma,
                    axis=axis,
                )
            )
    return _begun(joined(", ", parts) + f" ({content.origin}).") if parts else ""


def _begun(text: str) -> str:
    """A sentence that begins with the word of a kind, which no name is."""
    return capital(text)


def _largest(items: tuple[Point, ...] | tuple[StationRow, ...]) -> tuple[str, float, str] | None:
    """Name, sigma [m] and axis of the coordinate that is known least."""
    found = [
        (sigma, item.name, axis)
        for item in items
        for sigma, axis in zip(item.sigma, _AXES, strict=True)
        if sigma is not None
    ]
    if not found:
        return None
    sigma, name, axis = max(found, key=lambda one: one[0])
    return name, sigma, axis


def _checks(content: Report) -> str:
    """What the check points say."""
    checks = [c for c in content.control if c.use == "check"]
    if not checks:
        return "There are none: nothing independent confirms these figures."
    judged = [c for c in checks if c.verdict is not None]
    agree = sum(c.verdict.agrees for c in judged if c.verdict is not None)
    rms = [_rms(checks, k) for k in range(3)]
    words = joined(
        ", ",
        (
            Sentence("{value:mm2} in {axis}", value=value, axis=axis)
            for value, axis in zip(rms, _AXES, strict=True)
            if value
        ),
    )
    told = f"{agree} of {len(judged)} agree with the network" if judged else "none can be judged"
    return (
        Sentence("{told}; root mean square of the differences {words}.", told=told, words=words)
        if words
        else f"{told}."
    )


def _rms(checks: list[Control], k: int) -> float | None:
    """Root mean square of the differences along an axis [m]."""
    values = [c.difference[k] for c in checks]
    known = [v for v in values if v is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known else None


def _clouds(content: Report) -> str:
    """How many clouds, how exact their points."""
    placed = content.job.placed
    if placed is None or not placed.products:
        return ""
    summaries = [product.summary for product in placed.products]
    total = sum(summary.points for summary in summaries)
    known = [(s.quantile(0.95), p) for p, s in zip(placed.products, summaries, strict=True)
             if len(s.sample)]  # fmt: skip
    words = Sentence(
        "{counted} with {total:,} points", counted=counted(len(summaries), "cloud"), total=total
    )
    if not known:
        return Sentence("{words}, without sigmas.", words=words)
    worst, product = max(known, key=lambda one: one[0])
    name = ", ".join(spoken(scan) for scan in product.scans[:2])
    return Sentence(
        "{words}; in each of them 95 % of the points have a 3D σ of {worst:mm1} or "
        "less, the largest in {name}.",
        words=words,
        worst=worst,
        name=name,
    )


def _signed(content: Report) -> str:
    """What a signature is given for."""
    parts = [
        counted(n, noun)
        for n, noun in (
            (sum(p.role != "control" for p in content.points), "point"),
            (len(content.stations), "station"),
            (len(content.job.placed.products) if content.job.placed is not None else 0, "cloud"),
        )
        if n
    ]
    listed = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
    what = f"Coordinates and sigmas of {listed}" if parts else "The figures of this report"
    return f"{what}, in the datum and with the standard deviations stated here."
