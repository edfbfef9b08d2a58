"""Our own CSV files: observations and coordinates whose header names column and unit.

What a file holds follows from its columns (:mod:`~tribrach.io.survey.csv.columns`): sights and
levelling (``from,to``), angles (``at,from,to``), GNSS vectors (``from,to,de_m,dn_m,du_m``), scanner
targets and polar observations (``station,target``), readings of a total station
(``station,target,direction_gon``), inclinations (``station,tilt_x_arcsec``), headings
(``station,heading_deg``), GNSS positions (``gnss,e_m,n_m,u_m``), targets on rods
(``mark,target,rod_m``), targets on a body that turns about one axis (``axis,target,point``) or two
(``telescope,target,point,azimuth_deg,elevation_deg``) and given coordinates
(``point,e_m,n_m,u_m``). Standard deviations stand in
``sigma_`` columns or come from the instrument of the project.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from tribrach.errors import InputError, RefusalCollector, Refusals
from tribrach.io.csv_rows import AS_FOUND, ListForm
from tribrach.io.survey.csv import columns
from tribrach.io.survey.csv.columns import TableLayout
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.places import CoordinateReader, PositionReader, RodReader, VectorReader
from tribrach.io.survey.csv.reader import Context, Reader
from tribrach.io.survey.csv.readings import ReadingsReader
from tribrach.io.survey.csv.scans import (
    HeadingReader,
    InclinationReader,
    PolarReader,
    TargetReader,
)
from tribrach.io.survey.csv.sights import AngleReader, SightReader
from tribrach.io.survey.csv.turning import CircleReader, TelescopeReader
from tribrach.network.facts import ListReading
from tribrach.network.survey import Survey

__all__ = ["Context", "read", "survey_of"]

#: who reads a table; planned observations are read by themselves
_READERS: dict[TableLayout, Callable[[CsvTable, Context], Reader]] = {
    columns.SCANNER_POLAR: PolarReader,
    columns.SCANNER_TARGETS: TargetReader,
    columns.READINGS: ReadingsReader,
    columns.RODS: RodReader,
    columns.INCLINATIONS: InclinationReader,
    columns.HEADINGS: HeadingReader,
    columns.POSITIONS: PositionReader,
    columns.COORDINATES: CoordinateReader,
    columns.ANGLES: AngleReader,
    columns.VECTORS: VectorReader,
    columns.GEOCENTRIC_VECTORS: VectorReader,
    columns.SIGHTS: SightReader,
    columns.TELESCOPE: TelescopeReader,
    columns.CIRCLES: CircleReader,
}


def read(path: Path, context: Context | None = None, form: ListForm = AS_FOUND) -> Survey:
    """Survey of one table, text or a spreadsheet, in the form somebody says or as it is found."""
    return survey_of(read_table(Path(path), form), context or Context())


def survey_of(table: CsvTable, context: Context) -> Survey:
    """Survey of a table that has been read."""
    table = replace(table, label=context.label)
    if table.layout not in _READERS:
        raise table.error(
            None,
            f"this is a table of {table.layout.name}, which nobody measured",
            "name the file under observations of [plan]",
        )
    with RefusalCollector() as refused:
        while True:
            try:
                reader = _READERS[table.layout](table, context)
                reader.read()
            except InputError as error:
                # the rows beside those that are refused may be wrong in another way
                parts = error.errors if isinstance(error, Refusals) else (error,)
                lines = {part.line for part in parts} & set(table.lines)
                if refused.count == 0 or lines:
                    refused.add(error)
                table = table.without(lines)
                if not lines or refused.full or len(table) == 0:
                    break
            else:
                break
        refused.settle()
    if table.remarks:
        reader.survey.facts += (ListReading(table.name, table.remarks),)
    return reader.survey
