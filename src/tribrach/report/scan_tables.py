"""The tables of targets, clouds and tolerance classes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tribrach.report.budget_tables import budget_table
from tribrach.report.columns import ColumnSet, Spec
from tribrach.report.scan_content import ScanChapter, WrittenCloud
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)

__all__ = ["scan_tables"]


def scan_tables(chapter: ScanChapter, columns: ColumnSet, most: int | None) -> list[ReportTable]:
    """Every table about scans, empty ones as well."""
    return [
        _truth(chapter, columns, most),
        _targets(chapter, columns, most),
        _rejections(chapter, columns, most),
        _clouds(chapter, columns, most),
        _classes(chapter, columns),
        budget_table(chapter.error_budget, columns),
    ]


def _truth(chapter: ScanChapter, columns: ColumnSet, most: int | None) -> ReportTable:
    note = (
        "The job is simulated and its truth is known. Squared errors in the metric of their stated "
        "covariances against chi-square: single ones at a level at which all of one kind pass in "
        "99 % of jobs, all jointly on both sides at 99 %, since smaller errors than stated are "
        "wrong statements too. Of clouds the mean squared normalised error."
    )
    specs: list[Spec] = [
        columns.word("What", "what"),
        columns.word("Name", "name"),
        columns.word("Error", "words"),
        columns.plain("test", "statistic"),
        columns.plain("least", "least"),
        columns.plain("most", "limit"),
        (
            ColumnHead("verdict", numeric=False),
            lambda r: text_cell(r.verdict, "good" if r.agrees else "bad"),
        ),
    ]
    return build_table("truth", "Against the truth", note, chapter.truth, specs, most=most)


def _targets(chapter: ScanChapter, columns: ColumnSet, most: int | None) -> ReportTable:
    specs: list[Spec] = [
        columns.word("Scan", "scan"),
        columns.plain("No.", "number", 0),
        columns.word("Kind", "kind"),
        columns.word("Point", "name"),
        *(columns.metres(a, _item("center", k)) for k, a in enumerate("xyz")),
        *(columns.mm(f"σ {a}", _item("sigma", k)) for k, a in enumerate("xyz")),
        columns.metres("range", lambda t: t.range),
        columns.bearing("incidence", lambda t: t.incidence),
        columns.plain("points", "points", 0),
        columns.mm("rms of the fit", lambda t: t.rms),
        columns.plain("coverage", "coverage", wide=True),
        columns.word("Remark", "remark", wide=True),
    ]
    note = (
        "Centres in the scanner frame with the sigmas that enter the adjustment. The rms is that "
        "of the surface points about the fitted shape: a noise of points, not an accuracy of the "
        "centre. Numbers are those in the pictures."
    )
    return build_table("targets", "Targets found", note, chapter.targets, specs, most=most)


def _rejections(chapter: ScanChapter, columns: ColumnSet, most: int | None) -> ReportTable:
    specs: list[Spec] = [
        columns.word("Scan", "scan"),
        columns.word("Kind", "kind"),
        *(columns.metres(a, _item("center", k)) for k, a in enumerate("xyz")),
        columns.word("Why it is none", "reason"),
    ]
    return build_table(
        "rejections", "Candidates rejected", "", chapter.rejections, specs, most=most
    )


def _clouds(chapter: ScanChapter, columns: ColumnSet, most: int | None) -> ReportTable:
    specs: list[Spec] = [
        columns.word("Cloud", "name"),
        columns.word("File", "file"),
        columns.plain("points", "points", 0),
        *(columns.mm(f"σ{k + 1}", _item("sigma", k), 2) for k in range(3)),
        columns.mm("median 3D σ", lambda c: c.median),
        columns.mm("95 % of points", lambda c: c.p95),
        columns.mm("largest", lambda c: c.largest),
        columns.mm("weakest σ", _item("weakest", 0)),
        columns.bearing("along azimuth", _item("weakest", 1)),
        columns.bearing("elevation", _item("weakest", 2)),
        columns.mm("step on disk", lambda c: c.step, 3),
    ]
    note = (
        "σ1 to σ3: root mean square along the axes of the delivered frame. 3D σ is the root of the "
        "sum of the three variances of a point. Weakest: what the station leaves uncertain of the "
        "cloud as a whole, along its worst direction. All are predicted from the network and the "
        "instrument, not observed."
    )
    return build_table("clouds", "Clouds", note, chapter.clouds, specs, most=most)


def _classes(chapter: ScanChapter, columns: ColumnSet) -> ReportTable:
    names = [name for name, _ in chapter.clouds[0].shares] if chapter.clouds else []
    specs: list[Spec] = [columns.word("Cloud", "name")]
    specs += [(ColumnHead(name, "%"), _share(k)) for k, name in enumerate(names)]
    note = (
        "Share of the points whose predicted 95 % uncertainty (twice the 3D σ) is within the "
        "class: USIBD LOA 10 to 50 are 150, 50, 15, 5 and 1 mm, GSA levels 1 to 4 are 51, 13, 6 "
        "and 3 mm. A class is reached by 95 % or more."
    )
    rows = [cloud for cloud in chapter.clouds if cloud.sigma is not None]
    return build_table("classes", "Tolerance classes", note, rows, specs)


def _share(k: int) -> Callable[[WrittenCloud], Cell]:
    def cell(cloud: WrittenCloud) -> Cell:
        share = 100 * cloud.shares[k][1]
        return number_cell(share, f"{share:.1f}", "good" if share >= 95 else "")

    return cell


def _item(name: str, k: int) -> Callable[[Any], float | None]:
    """Takes one number of a triple, None where there is none."""

    def get(row: Any) -> float | None:
        triple = getattr(row, name)
        return None if triple is None else float(triple[k])

    return get
