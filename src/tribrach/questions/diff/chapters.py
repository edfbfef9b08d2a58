"""What the difference of two results says: findings, and tables of what differs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np

from tribrach.answers import Form
from tribrach.questions.diff.difference import Common, PlaceChange, ResultDifference
from tribrach.report.answer import Answer
from tribrach.report.columns import column, component
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import Style, counted
from tribrach.report.tables import ReportTable, Worst, build_table

FORM = Form("diff", ResultDifference, 1, sentences=list[str])
#: rows of a table; places with a figure in a sentence
_SHOWN, _NAMED = 40, 5
_NOTE = (
    "Sigmas are 3D. σ before and after are those of the place; σ of shift is that of the "
    "difference, which is smaller where both results share measurements. Test: the squared shift "
    "in the metric of its covariance, in as many directions as it has degrees of freedom."
)
_COMMON: dict[Common, str] = {
    "same": (
        "Both rest on the same measurements with the same sigmas: what differs comes from the "
        "model, the options or the start, and no test can call it moved."
    ),
    "nested": (
        "One rests on measurements of the other and on further ones: the covariance of the "
        "difference is the difference of both covariances. Nothing moved on site between them: "
        "what differs is due to the values that only one of them uses."
    ),
    "disjoint": (
        "They share no measurement: the covariance of the difference is the sum of both, as far "
        "as nothing else is common to them."
    ),
    "overlapping": (
        "They share some measurements, and each has others: the covariance of the difference is "
        "not known from both results. It is at most twice the sum of both, whatever they share; "
        "moved is what stands out of that. Of two epochs with one list of control tribrach epochs "
        "tells more, given the files of both."
    ),
    "model": (
        "They have different unknowns besides points and stations (calibrations, lever arms, "
        "planes): the covariance of the difference is at most twice the sum of both."
    ),
    "datum": (
        "The datum differs: coordinates move with it, so that nothing is called moved. Compare "
        "distances, or adjust both in one datum."
    ),
}


def answer_of(found: ResultDifference, angle: Literal["gon", "deg"] = "gon") -> Answer:
    """The difference as people read it."""
    findings = list(_findings(found))
    tables = [table for table in _tables(found, angle) if table.rows]
    terminal: list[str | Finding | ReportTable] = []
    for table in tables:
        terminal.append(table)
        if table.left_out:
            terminal.append(f"{table.left_out} more rows in the JSON file")
    return Answer(
        "Difference of two results",
        f"{found.second} less {found.first}",
        None,
        found,
        FORM,
        {"sentences": words(findings)},
        findings,
        tables=tables,
        terminal=[*terminal, *findings],
    )


def _findings(found: ResultDifference) -> Iterator[Finding]:
    """Findings on the differences."""
    places, before, after = found.places, *found.sigma0.posterior
    still = all(p.length == 0 and np.array_equal(*p.sigma, equal_nan=True) for p in places)
    if found.common == "same" and still and not found.observations and before == after:
        yield Finding.of(
            "alike",
            "Both rest on the same measurements, and they are the same: {places} with their "
            "sigmas, all observed values, sigma0.",
            places=counted(len(places), "place"),
        )
        return
    yield Finding(_COMMON[found.common], key=found.common)
    yield from _moved(found)
    if places:
        yield from _largest(found, max(places, key=lambda place: place.length))
    ratios = [(p.sigma[1] / p.sigma[0], p.name) for p in places if min(p.sigma) > 0]
    if ratios:
        yield Finding.of(
            "sigmas",
            "Sigmas are {low[0]:3} ({low[1]}) to {high[0]:3} ({high[1]}) times what they were.",
            low=min(ratios),
            high=max(ratios),
        )
    if found.observations:
        yield Finding.of(
            "observations",
            "{changed} changed, {states} of them their state.",
            changed=counted(len(found.observations), "observed value"),
            states=sum(change.change == "state" for change in found.observations),
        )
    was, now = ("not estimated" if v is None else f"{{s.posterior[{k}]:4}}"
                for k, v in enumerate((before, after)))  # fmt: skip
    yield Finding.of(
        "sigma0",
        f"Sigma0 a posteriori was {was} with redundancy {{s.dof[0]}} and is {now} with redundancy "
        "{s.dof[1]}.",
        s=found.sigma0,
    )


def _moved(found: ResultDifference) -> Iterator[Finding]:
    """Places beyond their limits, and those that cannot be told."""
    places, nested = found.places, found.common == "nested"
    moved, tested = [p for p in places if p.moved], [p for p in places if p.tested]
    if moved:
        each = (
            f"{{p[{k}].name}} by {{p[{k}].length:mm2}} (test {{p[{k}].test:1}} against "
            f"{{p[{k}].limit:1}} with {counted(p.freedom or 0, 'degree')} of freedom)"
            for k, p in enumerate(moved[:_NAMED])
        )
        more = " and {more} more" if len(moved) > _NAMED else ""
        yield Finding.of(
            "moved",
            f"{{moved}} of {{places}} {{verb}}: {', '.join(each)}{more}.",
            moved=len(moved),
            places=len(places),
            verb=("place" if len(moved) == 1 else "places")
            + (" shifted beyond the limit" if nested else " moved"),
            p=moved,
            more=len(moved) - _NAMED,
        )
    elif tested:
        yield Finding.of(
            "none_moved",
            "None of {tested} moved beyond its limit.",
            tested=counted(len(tested), "tested place"),
        )
    untold = sum(place.freedom == 0 for place in places)
    if untold:
        yield Finding.of(
            "untold",
            "Of {places} it cannot be told whether the shift is more than chance: the covariances "
            "of both results, or what coordinates are exact to, leave no variance of the "
            "difference that could be divided by.",
            places=counted(untold, "place"),
        )


def _largest(found: ResultDifference, largest: PlaceChange) -> Iterator[Finding]:
    """The largest shift, in metres and beside the sigma of its place."""
    most = "at most " if found.common in ("overlapping", "model") else ""
    tail = f", the sigma of the shift {most}{{p.difference_sigma:mm2}}"
    yield Finding.of(
        "largest",
        "The largest shift is that of {p.name}, {p.length:mm2}"
        + ("" if np.isnan(largest.difference_sigma) else tail)
        + ".",
        p=largest,
    )
    shares = [(p.length / p.sigma[0], p.name) for p in found.places if p.sigma[0] > 0]
    if shares:
        yield Finding.of(
            "largest_share",
            "Measured by the sigma of the place itself, the largest shift is {most[0]:g2} of it "
            "({most[1]}).",
            most=max(shares),
        )


def _tables(found: ResultDifference, angle: Literal["gon", "deg"]) -> Iterator[ReportTable]:
    """Places, observations and edits that differ."""
    style, nested = Style(angle), found.common == "nested"

    def verdict(place: PlaceChange) -> str:
        if not place.tested:
            return "not tested" if place.freedom is None else "cannot be told"
        return ("beyond its limit" if nested else "moved") if place.moved else "within its limit"

    columns = [
        column("Name", "name"),
        *(
            column(head, component("shift", k), "mm2")
            for k, head in enumerate(("Shift E", "N", "U"))
        ),
        column("Turn", "turn", lambda v, _: style.small(v, "rad"), unit=style.small_unit("rad")),
        column("σ of shift", "difference_sigma", "mm2"),
        column("test", "test", "2"),
        column("limit", "limit", "2"),
        column("freedom", "freedom", "0"),
        column("σ before", component("sigma", 0), "mm2"),
        column("σ after", component("sigma", 1), "mm2"),
        column("Verdict", verdict, mark=lambda p: "bad" if p.moved else ""),
    ]
    worst = Worst("those with the largest test for its limit")
    title = "Points and stations"
    yield build_table("places", title, _NOTE, found.places, columns, most=_SHOWN, worst=worst)
    columns = [
        column("Observation", lambda o: f"{o.kind.replace('_', ' ')} {o.component}".strip()),
        column("From", "from_"),
        column("To", "to"),
        column(
            "What changed", lambda o: " to ".join(o.states) if o.change == "state" else o.change
        ),
        column("w before", component("w", 0), "2"),
        column("w after", component("w", 1), "2"),
        column("Reason", "reason"),
    ]
    yield build_table("changed", "Observations", "", found.observations, columns, most=_SHOWN)
    edits: Sequence[Any] = [
        *(("the first", e) for e in found.edits_only_first),
        *(("the second", e) for e in found.edits_only_second),
    ]
    columns = [
        column("Edit of", lambda e: e[1]["id"]),
        column("Only in", lambda e: e[0]),
        column("Action", lambda e: e[1]["action"]),
        column("Reason", lambda e: e[1]["reason"]),
    ]
    yield build_table("edits", "Edits", "", edits, columns, most=_SHOWN)
