"""What a survey covers as people read it: findings, maps of the cells, stations, gaps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Form
from tribrach.questions.complete.completeness import SEEN_BY, Completeness
from tribrach.report.answer import Answer
from tribrach.report.charts import (
    TESTED,
    Chart,
    Drawing,
    beside,
    colour_bar,
    ends_of,
    legend,
    shade,
)
from tribrach.report.columns import column, component
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.sentences import Sentence, joined
from tribrach.units import DEG, MM

FORM = Form("complete", Completeness, 1, sentences=list[str])
#: cells shown in a map, drawn at random from more
_SHOWN = 60_000
#: shares of the colours from well within to well beyond, by the number of stations
_SHARES = np.array([1.0, 0.66, 0.33, 0.0])
#: kinds of gaps in their order: name of the table, and what they are
_GAPS = {
    "unseen": "Seen by no station",
    "single": "Seen by one station only",
    "weak": "Sigma not reached",
}


def answer_of(title: str, found: Completeness) -> Answer:
    """The completeness as an answer; its title names the clouds."""
    said = list(_findings(found))
    pictures = [_map(found)] if found.required_sigma is None else [_map(found), _sigma_map(found)]
    gaps = [getattr(found.gaps, field.name) for field in fields(found.gaps)]
    lines = [
        *words(said),
        *(Sentence("{n} sees {share:%}", n=n, share=share) for n, share in found.stations.items()),
    ]
    for what, some in zip(_GAPS.values(), gaps, strict=True):
        lines += [
            Sentence(
                "{what}: {gap.area:1} m² around {gap.middle[0]:m1~}, {gap.middle[1]:m1~}, "
                "{gap.middle[2]:m1~} ({gap.extent[0]:m1~} x {gap.extent[1]:m1~} x "
                "{gap.extent[2]:m1})",
                what=what,
                gap=gap,
            )
            for gap in some[:3]
        ]
    axes = [
        column(f"{along}{axis}", component(path, k), "m2")
        for along, path in (("", "middle"), ("along ", "extent"))
        for k, axis in enumerate("xyz")
    ]
    return Answer(
        "Completeness",
        title,
        _front(found, said),
        found,
        FORM,
        {"sentences": words(said)},
        said,
        first=_shares(found),
        pictures=pictures,
        tables=[
            build_table(
                name,
                f"Largest places: {what.lower()}",
                "",
                some,
                [*axes, column("area", "area", "2", unit="m²"), column("cells", "cells", "0")],
            )
            for (name, what), some in zip(_GAPS.items(), gaps, strict=True)
        ],
        footer=Sentence(
            "Cells of {found.cell:mg}; shares are those of the area of the surface in them. A "
            "station sees a cell if it has points in it, in the next one across the surface, or "
            "in most of those around it.",
            found=found,
        ),
        terminal=[joined("\n", lines)],
    )


def _findings(found: Completeness) -> Iterator[Finding]:
    """What a reader should take from it."""
    told = [
        Sentence("{share:%} by {name}", share=_share(area, found.area), name=name)
        for name, area in found.area_seen_by.items()
    ]
    yield Finding.of(
        "seen",
        "{all.area:1,} m² in {all.cells:,} cells of {all.cell:mg6} {what}; seen: {seen}.",
        all=found,
        what="of the model" if found.modelled else "were scanned",
        seen=joined(", ", told if found.modelled else told[1:]),
    )
    if not found.modelled:
        yield Finding(
            "What no station saw cannot be told from the clouds alone: give a model for that.",
            key="no_model",
        )
    if found.area_of_sigma is not None:
        there = sum(found.area_of_sigma.values())
        reached, missed, unknown = (_share(one, there) for one in found.area_of_sigma.values())
        yield Finding.of(
            "sigma_reached",
            "A sigma of {required:mmg6} is required (3D, of the best station in a cell): "
            "{reached:%} of what is seen reaches it, {missed:%} does not"
            f"{', of {unknown:%} it is not known' if unknown else ''}.",
            required=found.required_sigma,
            reached=reached,
            missed=missed,
            unknown=unknown,
        )


def _front(found: Completeness, said: list[Finding]) -> FrontPage:
    """How much was seen, or is as exact as required; the sentence is one of the findings."""
    everywhere = False
    if found.sigma is None and found.modelled:
        seen = 1 - _share(found.area_seen_by["no station"], found.area)
        verdict = Sentence("{seen:%} of the model seen", seen=seen)
    elif found.sigma is None:
        seen = 1 - _share(found.area_seen_by["one station"], found.area)
        verdict = Sentence("{seen:%} seen by two stations or more", seen=seen)
    else:
        areas = found.area_of_sigma or {}
        everywhere = not found.sigma["not reached"] + found.sigma["unknown"]
        everywhere = everywhere and not found.seen_by["no station"]
        where = (
            "everywhere"
            if everywhere
            else Sentence(
                "on {reached:%}",
                reached=_share(areas.get("reached", 0.0), sum(areas.values())),
            )
        )
        verdict = Sentence("The required sigma is reached {where}", where=where)
    sentence = said[0 if found.sigma is None else -1].words
    signed = "What these clouds cover, in cells of the size and with the sigma stated here."
    return FrontPage("good" if everywhere else "none", verdict, sentence, signed=signed)


def _shares(found: Completeness) -> list[ReportTable]:
    """Cells by what is known of them, and what each station sees."""
    areas = {**found.area_seen_by, **(found.area_of_sigma or {})}
    rows = [
        *((name, name, count) for name, count in found.seen_by.items()),
        *((f"sigma {name}", name, count) for name, count in (found.sigma or {}).items()),
    ]
    note = "Shares of the area of the surface. The sigma is that of the best station in a cell."
    cells = [
        column("Seen by", lambda row: row[0]),
        column("cells", lambda row: row[2], "0"),
        column("area", lambda row: areas[row[1]], "1", unit="m²"),
        column("share", lambda row: _share(areas[row[1]], found.area), "%1"),
    ]
    stations = [column("Station", lambda row: row[0]), column("sees", lambda row: row[1], "%1")]
    return [
        build_table("classes", "Cells", note, rows, cells),
        build_table("stations", "Stations", "", list(found.stations.items()), stations),
    ]


def _share(part: float, whole: float) -> float:
    """Part of a whole, 0 of nothing."""
    return part / whole if whole else 0.0


def _chosen(count: int) -> NDArray[np.int64]:
    """Cells of a map: all, or some at random, the same ones each time."""
    if count <= _SHOWN:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, _SHOWN, replace=False))


def _panels(found: Completeness, which: NDArray[np.int64], shares: Array) -> list[Chart]:
    """Plan and side view of cells with shares of the colours, the largest on top."""
    xyz = found.centres[which]
    plan = xyz[:, :2] - xyz[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(plan[:: max(1, len(plan) // 5000)], full_matrices=False)
    azimuth = np.degrees(np.arctan2(axes[0, 0], axes[0, 1])) % 180
    origin = np.round(xyz[:, :2].mean(axis=0), -1)
    views = (
        (
            (xyz[:, :2] - origin).T,
            (
                Sentence("x - {origin[0]:0} [m]", origin=origin),
                Sentence("y - {origin[1]:0} [m]", origin=origin),
            ),
        ),
        (
            (plan @ axes[0], xyz[:, 2]),
            (Sentence("along {azimuth:°0} [m]", azimuth=azimuth * DEG), "height [m]"),
        ),
    )
    panels = []
    for (u, v), names in views:
        panel = Chart(ends_of(u), ends_of(v), names, (600.0, 460.0), equal=True)
        panel.cloud(u, v, shares, TESTED)
        panels.append(panel)
    return panels


def _map(found: Completeness) -> Picture:
    """Cells by the number of stations, those that lack most on top."""
    which = _chosen(found.cells)
    panels = _panels(found, which, _SHARES[np.minimum(found.seen[which], 3)])
    entries = [(shade(float(s), TESTED), text) for s, text in zip(_SHARES, SEEN_BY, strict=True)]
    title = "Seen by how many stations"
    caption = Sentence(
        "{which:,} of {found.cells:,} cells in plan and from the side; what fewer "
        "stations see lies on top.",
        which=len(which),
        found=found,
    )
    drawing = beside([panels], title, legend(entries, 1200.0))
    return Picture("seen", title, drawing, caption, wide=True)


def _sigma_map(found: Completeness) -> Picture:
    """Sigma of the best station, the worst on top."""
    which = _chosen(found.cells)
    which = which[np.isfinite(found.sigmas[which])]
    top = 2e3 * (found.required_sigma or 0.0)
    title = "Required sigma"
    if not len(which):
        return Picture("sigma", title, Drawing(600.0, 0.0, (), title), "No cell has a sigma.")
    panels = _panels(found, which, 1e3 * found.sigmas[which] / top)
    scale = colour_bar(0.0, top, "3D sigma [mm]", 1200.0, TESTED)
    caption = Sentence(
        "Sigma of the best station in every cell; yellow is the {top:mmg} that are "
        "required, red twice as much or more.",
        top=top / 2 * MM,
    )
    return Picture("sigma", title, beside([panels], title, scale), caption, wide=True)
