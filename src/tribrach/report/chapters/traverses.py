"""The chapter on traverses: how each closes before it is adjusted."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from tribrach.network.traverses import Traverse, traverses
from tribrach.report.chapter import Chapter
from tribrach.report.columns import column
from tribrach.report.content import Head
from tribrach.report.numbers import counted
from tribrach.report.subject import Subject
from tribrach.report.tables import build_table
from tribrach.sentences import Sentence

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: names at each end of a long traverse that a table shows
_NAMED = 3


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where there are traverses."""
    found = traverses(head.adjustment)
    if not found:
        return
    sentences = [
        f"{counted(len(found), 'traverse')} computed through with observed angles and distances, "
        "before anything is adjusted. Sigmas are those of readings and centring."
    ]
    sentences += [
        Sentence(
            "{names}: an error of {one.angle:arcsec1} in the angle at {one.angle_at} alone "
            "explains how the traverse closes.",
            names=_names(one),
            one=one,
        )
        for one in found
        if one.angle_at
    ]
    of = head.columns
    columns = [
        column("Traverse", _names),
        column("set-ups", lambda one: len(set(one.points)), "0"),
        column("length", "length", "m1"),
        of.small_angle("angular misclosure", lambda one: one.angle),
        of.small_angle("its sigma", lambda one: one.sigma_angle),
        column("ΔE", "east", "mm1"),
        column("ΔN", "north", "mm1"),
        column("along", "along", "mm1"),
        column("across", "across", "mm1"),
        column("plan", "plan", "mm1"),
        column("1 :", "ratio", "0"),
    ]
    note = (
        "Misclosures are observed less given: of the angles where both ends are oriented, of the "
        "coordinates after the angles are put right by equal shares."
    )
    table = build_table("traverses", "Traverses", note, found, columns)
    yield Chapter("traverses", "Traverses", tuple(sentences), (), (table,), found)


def _names(one: Traverse) -> str:
    """Its points, those in the middle of a long one left out."""
    points = one.points
    if len(points) > 2 * _NAMED + 1:
        points = (*points[:_NAMED], "...", *points[-_NAMED:])
    return " - ".join(points)


SUBJECT = Subject("traverses", _chapters, list[Traverse])
