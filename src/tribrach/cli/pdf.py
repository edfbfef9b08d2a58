"""The command pdf: a page as a document to print, sign and keep."""

from __future__ import annotations

import datetime
import re
from pathlib import Path
from typing import Annotated

import typer

from tribrach.errors import InputError
from tribrach.io.opened_files import contents
from tribrach.io.paper import paper_of
from tribrach.io.pdf_file import pdf_document
from tribrach.report.answer import Answer
from tribrach.report.findings import Finding
from tribrach.shell.command import WRITTEN, command

_RESULT = "result.json"


def page_of(given: Path) -> Path:
    """The page that is meant by a file, a folder of results, or the folder of a project."""
    places = (given / "report.html", given / "out" / "report.html")
    return next((path for path in places if path.is_file()), given)


@command(json=None, html=None)
def pdf(
    page: Annotated[
        Path, typer.Argument(help="A page of tribrach, or the folder of a run."), page_of
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The document; beside the page with .pdf if not given."),
        WRITTEN,
    ] = None,
    attach: Annotated[
        Path | None,
        typer.Option(help="JSON to be inside; result.json beside a report if not given."),
    ] = None,
) -> Answer:
    """Make a PDF/A-3 of a page: equal figures, JSON inside, a field for a signature."""
    if not page.is_file():
        raise InputError("there is no page here", file=page, cure="give a report.html")
    beside = page.with_name(_RESULT)
    carried = attach or (beside if page.name == "report.html" and beside.is_file() else None)
    text = contents(page).decode("utf-8", "replace")
    try:
        paper = paper_of(text, () if carried is None else (carried.name,))
    except InputError as error:
        raise InputError(error.what, file=page, cure=error.cure) from error
    files = dict(paper.files)
    if carried is not None:
        files[carried.name] = contents(carried)
    made = re.search(r"<time[^>]*>(\d{4}-\d\d-\d\d)", text)
    date = datetime.date.fromisoformat(made[1]) if made else datetime.date.today()
    place = out or page.with_suffix(".pdf")
    inside = "" if carried is None else f" with {carried.name} inside"
    return Answer(
        "Document",
        paper.title,
        None,
        None,
        files={place: pdf_document(paper.source, files, date)},
        terminal=[Finding.of("made", "{name}{inside}", name=place.name, inside=inside)],
    )
