"""A result as layers of a GIS through pyogrio: GeoPackage, GeoJSON and KML.

A GeoPackage has the layers points, sights, ellipses and displacements in the reference system of
the result, and a style that QGIS opens it with, coloured by sigma. GeoJSON and KML are longitude
and latitude in WGS 84.
"""

from __future__ import annotations

import io
import sqlite3
import struct
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.io.delivery.content import Delivery
from tribrach.io.delivery.lists import columns_of

#: vertices of an ellipse
_ROUND = 48
#: enlargement of ellipses in layers, as their column says
_ENLARGED = 1000.0
_TYPES: dict[str, int] = {"Point": 1, "LineString": 2, "Polygon": 3}
#: limits of the colours [mm] and the colours, from good to bad
_COLOURS = ((1.0, "26,150,65"), (2.0, "166,217,106"), (5.0, "255,223,128"), (10.0, "253,141,60"))
_WORST = "215,25,28"


@dataclass(frozen=True)
class _Layer:
    """A layer with its geometries."""

    name: str
    kind: Literal["Point", "LineString", "Polygon"]
    geometry: list[bytes]
    fields: Mapping[str, NDArray[Any]]


def write_gpkg(delivery: Delivery) -> bytes:
    """The bytes of a GeoPackage."""
    ogr = import_module("pyogrio.raw")
    places = np.array([p.xyz for p in delivery.plan])
    places[:, :2] /= delivery.unit
    layers = list(_layers(delivery, places, geographic=False))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "result.gpkg"
        for k, layer in enumerate(layers):
            _write(ogr, path, layer, "GPKG", delivery.crs or None, append=k > 0)
        _style(path, [layer.name for layer in layers])
        return path.read_bytes()


def write_geojson(delivery: Delivery) -> bytes:
    """The points as the bytes of a GeoJSON file."""
    return _of_points(delivery, "GeoJSON", RFC7946="YES", COORDINATE_PRECISION="11")


def write_kml(delivery: Delivery) -> bytes:
    """The points as the bytes of a KML file."""
    return _of_points(delivery, "KML")


def _of_points(delivery: Delivery, driver: str, **options: str) -> bytes:
    """Points in WGS 84 by a driver."""
    ogr = import_module("pyogrio.raw")
    layer = next(_layers(delivery, delivery.wgs84(), geographic=True))
    fields = layer.fields
    if driver == "KML":
        fields = {"Name": fields["point"], **fields}
    made = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ogr.write(
            made,
            geometry=np.array(layer.geometry, dtype=object),
            field_data=list(fields.values()),
            fields=np.array(list(fields), dtype=object),
            layer="points",
            driver=driver,
            geometry_type="Point Z",
            crs="EPSG:4326",
            layer_options=options,
        )
    return made.getvalue()


def _write(
    ogr: Any, path: Path, layer: _Layer, driver: str, crs: str | None, *, append: bool
) -> None:
    """Write one layer; a second one goes behind the first."""
    with warnings.catch_warnings():
        # a local frame has no reference system
        warnings.simplefilter("ignore")
        ogr.write(
            str(path),
            geometry=np.array(layer.geometry, dtype=object),
            field_data=list(layer.fields.values()),
            fields=np.array(list(layer.fields), dtype=object),
            layer=layer.name,
            driver=driver,
            geometry_type=f"{layer.kind} Z",
            crs=crs,
            append=append,
        )


def _layers(delivery: Delivery, places: Array, *, geographic: bool) -> Iterator[_Layer]:
    """Points first; lines and ellipses only in the frame of the result."""
    plan = delivery.plan
    at = {p.name: _solid(place) for p, place in zip(plan, places, strict=True)}
    own = Delivery(delivery.title, plan, crs=delivery.crs, scale=delivery.scale)
    shapes = np.array([p.ellipse for p in plan])
    fields = _columns(own)
    fields |= {
        "ellipse_major_mm": 1e3 * shapes[:, 0],
        "ellipse_minor_mm": 1e3 * shapes[:, 1],
        "ellipse_azimuth_deg": np.degrees(shapes[:, 2]),
        "sigmas": _texts([delivery.scale] * len(plan)),
    }
    yield _Layer("points", "Point", [_point(place) for place in at.values()], fields)
    if geographic:
        return
    if delivery.lines:
        ends = {"from": _texts([a.name for a, _ in delivery.lines])}
        ends["to"] = _texts([b.name for _, b in delivery.lines])
        lines = [_line([at[a.name], at[b.name]]) for a, b in delivery.lines]
        yield _Layer("sights", "LineString", lines, ends)
    rings = []
    for p, (major, minor, azimuth) in zip(plan, shapes, strict=True):
        turn = np.linspace(0, 2 * np.pi, _ROUND + 1)
        u, v = _ENLARGED * major * np.cos(turn), _ENLARGED * minor * np.sin(turn)
        e = u * np.sin(azimuth) - v * np.cos(azimuth)
        n = u * np.cos(azimuth) + v * np.sin(azimuth)
        ring = np.stack([e, n, np.zeros_like(e)], axis=1) / delivery.unit + at[p.name]
        ring[-1] = ring[0]
        rings.append(_polygon(ring))
    drawn = np.flatnonzero(shapes[:, 0] > 0)
    if len(drawn) and not delivery.moves:
        fields = {name: column[drawn] for name, column in fields.items()}
        fields["enlarged"] = np.full(len(drawn), _ENLARGED)
        yield _Layer("ellipses", "Polygon", [rings[k] for k in drawn], fields)
    placed = tuple(m for m in delivery.moves if np.isfinite(m.xyz[:2]).all())
    if placed:
        moved = Delivery(delivery.title, plan, moves=placed)
        lines = []
        for m in placed:
            start = _solid(m.xyz)
            lines.append(_line([start, start + _ENLARGED * m.vector]))
        enlarged = {"enlarged": np.full(len(placed), _ENLARGED)}
        yield _Layer("displacements", "LineString", lines, _columns(moved) | enlarged)


def _columns(delivery: Delivery) -> dict[str, NDArray[Any]]:
    """Columns of the list by their heads, which have the units."""
    heads, rows = columns_of(delivery)
    return {
        head: _texts([row[head] for row in rows])
        if digits is None
        else np.array([np.nan if row[head] is None else row[head] for row in rows], dtype=float)
        for head, digits in heads.items()
    }


def _texts(values: Sequence[str]) -> NDArray[Any]:
    """A column of texts."""
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out


def _solid(xyz: Array) -> Array:
    """A place whose height is zero where it is not known."""
    return np.where(np.isfinite(xyz), xyz, 0.0)


def _point(xyz: Array) -> bytes:
    """A point as well-known bytes with a height."""
    return struct.pack("<BI3d", 1, 1000 + _TYPES["Point"], *xyz)


def _line(places: Sequence[Array]) -> bytes:
    """A line as well-known bytes."""
    flat = np.concatenate(places)
    head = struct.pack("<BII", 1, 1000 + _TYPES["LineString"], len(places))
    return head + flat.astype("<f8").tobytes()


def _polygon(ring: Array) -> bytes:
    """A polygon of one ring (n, 3) as well-known bytes."""
    head = struct.pack("<BIII", 1, 1000 + _TYPES["Polygon"], 1, len(ring))
    return head + ring.astype("<f8").tobytes()


def _style(path: Path, layers: Sequence[str]) -> None:
    """The table of styles that QGIS looks for, with one of points by their largest sigma."""
    # a file whose dates follow from nothing but its content
    undated = "1980-01-01T00:00:00.000Z"
    base = sqlite3.connect(path)
    try:
        with base:
            base.execute(
                "CREATE TABLE layer_styles (id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "
                "f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), "
                "f_geometry_column TEXT(256), styleName TEXT(30), styleQML TEXT, styleSLD TEXT, "
                "useAsDefault BOOLEAN, description TEXT, owner TEXT(30), ui TEXT(30), "
                "update_time DATETIME)"
            )
            base.execute(
                "INSERT INTO gpkg_contents (table_name, data_type, identifier, last_change) "
                "VALUES ('layer_styles', 'attributes', 'layer_styles', ?)",
                (undated,),
            )
            for layer in layers:
                if layer in ("points", "ellipses"):
                    symbol = "marker" if layer == "points" else "fill"
                    base.execute(
                        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, "
                        "f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, "
                        "description, owner, update_time) "
                        "VALUES ('', '', ?, 'geom', 'sigma', ?, '', 1, ?, '', ?)",
                        (layer, _qml(symbol), "coloured by the largest sigma", undated),
                    )
            base.execute("UPDATE gpkg_contents SET last_change = ?", (undated,))
    finally:
        base.close()


def _qml(symbol: str) -> str:
    """A style of QGIS: classes of the largest of the three sigmas [mm]."""
    limits = [0.0, *(limit for limit, _ in _COLOURS), 1e9]
    colours = [*(colour for _, colour in _COLOURS), _WORST]
    ranges, symbols = [], []
    for k, colour in enumerate(colours):
        low, high = limits[k], limits[k + 1]
        label = f"up to {high:g} mm" if k < len(_COLOURS) else f"over {low:g} mm"
        ranges.append(
            f'<range lower="{low}" upper="{high}" symbol="{k}" label="{label}" render="true"/>'
        )
        layer = "SimpleMarker" if symbol == "marker" else "SimpleFill"
        alpha = 255 if symbol == "marker" else 80
        options = f'<Option type="QString" name="color" value="{colour},{alpha}"/>'
        if symbol == "marker":
            options += '<Option type="QString" name="size" value="3"/>'
        symbols.append(
            f'<symbol type="{symbol}" name="{k}" alpha="1"><layer class="{layer}" enabled="1" '
            f'pass="0" locked="0"><Option type="Map">{options}</Option></layer></symbol>'
        )
    largest = (
        "max(coalesce(sigma_easting_mm,0), coalesce(sigma_northing_mm,0), "
        "coalesce(sigma_height_mm,0))"
    )
    labels = (
        '<labeling type="simple"><settings><text-style fieldName="point" fontSize="9"/>'
        "</settings></labeling>"
    )
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>"
        '<qgis version="3.28" styleCategories="Symbology|Labeling" labelsEnabled="1">'
        f'<renderer-v2 type="graduatedSymbol" attr="{largest}" graduatedMethod="GraduatedColor" '
        f'symbollevels="0"><ranges>{"".join(ranges)}</ranges>'
        f"<symbols>{''.join(symbols)}</symbols></renderer-v2>{labels}</qgis>"
    )
