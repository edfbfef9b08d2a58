"""A page of its own beside the report: verdict, findings, pictures, tables; one HTML file."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Literal

from tribrach.report.content import Report
from tribrach.report.environment import render_page
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.tables import ReportTable
from tribrach.sentences import PLAIN, Notation


@dataclass(frozen=True)
class FrontPage:
    """What stands first on a page."""

    #: ``good`` where all is well, ``look`` where it is and something is to be looked into, ``bad``
    #: where a test fails, ``none`` for what is neither: no test, or a result that one should see
    sort: Literal["good", "look", "bad", "none"]
    #: in some words, and why
    verdict: str
    sentence: str
    lines: tuple[tuple[str, str], ...] = ()  #: headings with what there is to know
    #: what a signature is given for, as a sentence; "" if there is nothing to sign
    signed: str = ""


def page(
    kind: str,
    title: str,
    front: FrontPage,
    findings: Sequence[Finding | str],
    pictures: Sequence[Picture],
    tables: Sequence[ReportTable],
    footer: str = "",
    first: Sequence[ReportTable] = (),
    network: Report | None = None,
    notation: Notation = PLAIN,
) -> str:
    """HTML text that needs nothing but a browser; everything put into it is escaped."""
    network_plan = None
    if network is not None:
        # trees of scipy are loaded for pages with a map alone
        from tribrach.report.map import network_map

        network_plan = network_map(network)
    told = [one if isinstance(one, Finding) else Finding(one) for one in findings]
    return render_page(
        "page.html.j2",
        kind=kind,
        title=title,
        running=running(
            f"{kind} · {title}", version("tribrach"), datetime.date.today().isoformat()
        ),
        front=front,
        findings=[one for one in told if one.words not in (front.sentence, f"{front.verdict}.")],
        map=network_plan,
        percent="" if network is None else network.percent,
        posterior=False,
        pictures=list(pictures),
        first=[table for table in first if table.rows],
        tables=[table for table in tables if table.rows],
        footer=footer,
        notation=notation,
    )


def running(left: str, program: str, date: str) -> str:
    """The words on top of every printed page, for the style of the page."""
    right = f"Tribrach {program} · {date}"
    return f'--top-left: "{_css_text(left)}"; --top-right: "{_css_text(right)}"'


def _css_text(text: str) -> str:
    """A text between quotes in a style sheet: all but letters and digits by their numbers."""
    return "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in text)
