"""The section ``[[heights]]``: heights over marks that are unknowns of a project's sights."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.network.identity import file_and_line
from tribrach.network.shared_heights import SharedHeight, has_shared_heights, share_heights
from tribrach.network.survey import ObservationTable, Survey, as_column
from tribrach.project import Project
from tribrach.project.sections import HeightSection
from tribrach.units import MM


def add_shared_heights(project: Project, survey: Survey, *, whole: bool) -> None:
    """Make the heights that a project names unknowns of a survey."""
    for k, section in enumerate(project.heights):
        shared = _shared(section, k)
        tables = survey.tables()
        rows = {
            i: _rows(section, table) for i, table in enumerate(tables) if has_shared_heights(table)
        }
        try:
            used = share_heights(survey, shared, rows)
        except InputError as error:
            raise project.error(("heights", k), error.what, error.cure) from error
        if not used and whole:
            raise project.error(
                ("heights", k),
                f"no zenith angle and no slope distance was made with the {shared.name}",
                "correct its marks and files, or remove it",
            )


def _shared(section: HeightSection, k: int) -> SharedHeight:
    """The height of a section."""
    words = f"height of instrument at {section.instrument_at}"
    if section.instrument_at is None:
        words = f"height of target over {section.target_at}"
    if section.seen_from:
        words += f" from {', '.join(section.seen_from)}"
    if section.sights_to:
        words += f" to {', '.join(section.sights_to)}"
    if section.files:
        words += f" ({', '.join(section.files)})"
    sigma = None if section.sigma_mm is None else section.sigma_mm * MM
    end: Literal["instrument", "target"] = "target"
    if section.instrument_at is not None:
        end = "instrument"
    return SharedHeight(end, words, section.height_m, sigma, f"heights {k + 1}")


def _rows(section: HeightSection, table: ObservationTable) -> NDArray[np.bool_]:
    """The sights (n,) of a table that a section means."""
    start, end = (_column(table, name) for name in ("start", "end"))
    if section.instrument_at is not None:
        rows = start == section.instrument_at
        others, among = end, section.sights_to
    else:
        rows = end == section.target_at
        others, among = start, section.seen_from
    if among:
        rows &= np.isin(others, among)
    if section.files:
        of = [_is_of(str(source), section.files) for source in table.columns["source"]]
        rows &= np.array(of, dtype=bool)
    out: NDArray[np.bool_] = rows
    return out


def _column(table: ObservationTable, name: str) -> NDArray[Any]:
    return as_column(table.columns[name], table.n).astype(str)


def _is_of(source: str, files: tuple[str, ...]) -> bool:
    """Was an observation written in one of the files, named with or without folders?"""
    name = PurePath(file_and_line(source)[0])
    return any(name == PurePath(one) or name.name == PurePath(one).name == one for one in files)
