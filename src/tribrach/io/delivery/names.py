"""Names of the formats in which a result is delivered, and what they are told besides."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal

from tribrach.errors import InputError

DeliveryFormat = Literal["dxf", "landxml", "gpkg", "geojson", "kml", "xlsx", "csv", "list"]
#: by name: suffix, module in this room, function
FORMATS: dict[str, tuple[str, str, str]] = {
    "dxf": (".dxf", "dxf", "write"),
    "landxml": (".xml", "landxml", "write"),
    "gpkg": (".gpkg", "gis", "write_gpkg"),
    "geojson": (".geojson", "gis", "write_geojson"),
    "kml": (".kml", "gis", "write_kml"),
    "xlsx": (".xlsx", "workbook", "write"),
    "csv": (".csv", "lists", "write"),
    "list": (".txt", "lists", "write_template"),
}
#: formats that GDAL writes
_GIS = ("gpkg", "geojson", "kml")
#: of a line of a list
TEMPLATE = "{point} {easting_m:.4f} {northing_m:.4f} {height_m:.4f} {code}"


@dataclass(frozen=True)
class DeliveryOptions:
    """Options of a delivery format."""

    scale: float | None = None  #: denominator of the scale of a drawing; a usual one if None
    template: str = TEMPLATE  #: of a line of a list


def suffix_of(format: str) -> str:
    """The suffix of a format."""
    return FORMATS[format][0]


def refuse_missing(format: str) -> None:
    """Refuse a format whose library is not installed, before any work."""
    if format in _GIS and find_spec("pyogrio") is None:
        raise InputError(
            f"{format} needs pyogrio, which is not installed", cure="install tribrach[gis]"
        )
