"""The chapter on instruments: the figures of all of them with their sources."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tribrach.answers import Result
from tribrach.network.facts import is_assumed
from tribrach.report.chapter import Chapter
from tribrach.report.content import Head
from tribrach.report.subject import Subject
from tribrach.report.tables import ColumnHead, build_table, number_cell, text_cell
from tribrach.report.warnings import Severity, warned
from tribrach.sentences import Sentence

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

_NOTE = Sentence(
    "Sources of the a-priori sigmas and of the beam's footprint. Angles by ISO 17123-3 or DIN "
    "18723 are of the mean of both faces, and one reading in one face has {more:2} times as much. "
    "Makers state other figures for good conditions, as one sigma or as a limit: compare them "
    "with the sheet of your instrument and with a field check. Defaults stand where the maker "
    "publishes nothing. Units are those of sheets and project files.",
    more=math.sqrt(2),
)
#: ends of keys with the units that they name, the longest first
_UNITS = {
    "_mm_per_sqrt_km": "mm per √km",
    "_arcsec": "″",
    "_arcmin": "′",
    "_mrad": "mrad",
    "_ppm": "ppm",
    "_mm": "mm",
    "_deg": "°",
}
_WORDS = {
    "direction": "direction, one face",
    "zenith": "zenith angle, one face",
    "direction_both_faces": "direction, mean of both faces",
    "zenith_both_faces": "zenith angle, mean of both faces",
    "centring": "centring of either end",
    "height": "height of either end",
    "range": "noise of ranges",
    "scan_angle": "noise of both angles",
    "scan_angle_accuracy": "both angles, noise and systematic part",
    "range_scale_common": "scale of ranges, common to all stations",
    "range_zero_common": "zero of ranges, common to all stations",
    "beam_exit": "diameter of the beam at its exit",
    "beam_divergence": "full divergence of the beam",
    "levelling": "levelling",
    "compass": "heading of the compass",
    "compass_common": "what headings of the compass share",
    "refraction": "coefficient of refraction",
    "refraction_sigma": "sigma of the coefficient of refraction",
    "target_floor": "added to centres of targets",
    "shared_share": "share of the noise of ranges that neighbours have in common",
    "shared_angle": "angle over which they have it",
    "gnss_plan": "GNSS position in plan",
    "gnss_up": "GNSS position in height",
    "gnss_common_share": "share of its variance common to a session",
}


@dataclass(frozen=True, kw_only=True)
class InstrumentFigure(Result):
    """A figure of an instrument: its key with the unit, its source; sheet, standard "" if none."""

    instrument: str
    sheet: str
    key: str
    value: float
    source: str
    standard: str
    published: bool


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; its table has no rows where no instrument is given."""
    instruments = {} if job.project is None else job.project.instruments
    figures = [
        InstrumentFigure(
            instrument=name,
            sheet=instrument.sheet or "",
            key=figure.key,
            value=figure.value,
            source=figure.source,
            standard=figure.standard,
            published=figure.published,
        )
        for name, instrument in instruments.items()
        for figure in instrument.figures()
    ]
    columns = [
        (
            ColumnHead("Instrument", numeric=False),
            lambda f: text_cell(f.instrument.replace("_", " ")),
        ),
        (ColumnHead("Sheet", numeric=False), lambda f: text_cell(f.sheet)),
        (ColumnHead("Figure", numeric=False), lambda f: text_cell(_named(f.key)[0])),
        (ColumnHead("value"), lambda f: number_cell(f.value, f"{f.value:g}")),
        (ColumnHead("unit", numeric=False), lambda f: text_cell(_named(f.key)[1])),
        (ColumnHead("By", numeric=False), lambda f: text_cell(f.standard)),
        (ColumnHead("Source", numeric=False), lambda f: text_cell(f.source)),
    ]
    table = build_table("instruments", "Instruments", _NOTE, figures, columns)
    assumed = sorted({f.instrument for f in figures if is_assumed(f.source)})
    yield Chapter(
        "instruments",
        "Instruments",
        tables=(table,),
        data=figures,
        warnings=warned(
            Severity.DOUBT,
            [
                f"figures of the {name.replace('_', ' ')} are assumed: sigmas rest on them where "
                "the files give none; name its model (sheet) or state its figures, and their source"
                for name in assumed
            ],
            "assumed",
        ),
    )


def _named(key: str) -> tuple[str, str]:
    """A key of a project in words, and its unit."""
    for end, unit in _UNITS.items():
        if key.endswith(end):
            bare = key.removesuffix(end)
            return _WORDS.get(bare, bare.replace("_", " ")), unit
    return _WORDS.get(key, key.replace("_", " ")), ""


SUBJECT = Subject("instruments", _chapters, list[InstrumentFigure])
