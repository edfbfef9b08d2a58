"""Geocentric frames by name, and the transformations between them.

Frames go by the names that surveyors use (``GDA2020``, ``ITRF2014``, ``WGS 84``). Parameters come
from the EPSG dataset through pyproj. The exception is the way from the older ITRF to GDA2020, where
EPSG chains through ITRF2014: there the parameters of the datum's owner are used (:data:`ICSM`),
which differ from the chain by some 3e-9 in scale and rotation. ECEF coordinates in metres, epochs
as decimal years. Method section 1.1.
"""

from __future__ import annotations

import re
from datetime import MAXYEAR, date
from functools import cache

import numpy as np
from pyproj import CRS, Transformer
from pyproj.crs import GeocentricCRS
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from pyproj.exceptions import ProjError

from tribrach._types import Array
from tribrach.errors import InputError

#: ITRF to GDA2020: shifts [mm], scale [ppb], rotations of the axes [mas], then their rates per
#: year, at epoch 2020 (ICSM, GDA2020 Technical Manual)
ICSM = {
    "ITRF96": "-480.71 75.16 574.71 6.995 10.2995 21.7458 9.8292 "
    "-21.8 4.71 26.27 0.388 2.0203 2.1735 1.6290",
    "ITRF97": "-176.68 -29.13 226.99 -3.117 1.3427 6.1880 3.9809 "
    "-8.6 0.36 11.25 0.007 1.6394 1.5198 1.3801",
    "ITRF2000": "-105.52 51.58 231.68 3.55 4.2175 6.3941 0.8617 "
    "-4.66 3.55 11.24 0.249 1.7454 1.4868 1.2240",
    "ITRF2005": "40.32 -33.85 -16.72 4.286 -1.2893 -0.8492 -0.3342 "
    "2.25 -0.62 -0.56 0.294 1.4707 1.1443 1.1701",
    "ITRF2008": "13.79 4.55 15.22 2.55 0.2808 0.2677 -0.4638 "
    "1.42 1.34 0.90 0.109 1.5461 1.1820 1.1551",
}
#: accuracy [m] of the ICSM parameters
ICSM_ACCURACY = 0.03
#: frames through which others are reached where EPSG has no direct way, the surer first
PIVOTS = ("ETRS89", "NAD83(2011)", "WGS 84")
#: the realisation of WGS 84 that stands for it towards the ITRF
WGS84_TODAY = "WGS 84 (G2139)"


@cache
def _geocentric() -> dict[str, str]:
    """EPSG codes of the geocentric systems by their names without spaces and brackets."""
    systems = query_crs_info(auth_name="EPSG", pj_types=PJType.GEOCENTRIC_CRS)
    return {_plain(info.name): info.code for info in systems}


@cache
def _geographic() -> dict[str, str]:
    """EPSG codes of geographic systems from Greenwich by names as those of :func:`_geocentric`."""
    systems = query_crs_info(auth_name="EPSG", pj_types=PJType.GEOGRAPHIC_2D_CRS)
    return {_plain(info.name): info.code for info in systems}


def _plain(name: str) -> str:
    """A frame's name as it is compared: capitals and digits only, years of ITRF with two digits."""
    letters = re.sub(r"[^A-Z0-9]", "", name.upper())
    # EPSG writes the years of the last century with two digits
    return re.sub(r"^ITRF19(\d\d)$", r"ITRF\1", letters)


@cache
def frame(name: str) -> CRS:
    """Geocentric coordinate reference system of a frame."""
    code = _geocentric().get(_plain(name))
    if code is not None:
        return CRS.from_epsg(code)
    code = _geographic().get(_plain(name))
    geographic = None if code is None else CRS.from_epsg(code)
    zero = None if geographic is None else geographic.prime_meridian
    if geographic is None or geographic.datum is None or (zero and zero.longitude):
        raise InputError(
            f"reference frame {name!r} is not known",
            cure="use a name such as GDA2020, ITRF2014 or WGS 84",
        )
    # a datum of old, which EPSG lists with latitude and longitude only
    return GeocentricCRS(name=geographic.name, datum=geographic.datum)


def identifier(name: str) -> str:
    """A frame's geocentric system as others read it: ``EPSG:7789`` of ITRF2014, or WKT."""
    system = frame(name)
    number = system.to_epsg()
    wkt: str = system.to_wkt()
    return wkt if number is None else f"EPSG:{number}"


@cache
def is_dynamic(name: str) -> bool:
    """True if coordinates of ground points change with time in this frame, as in any ITRF."""
    datum = frame(name).datum
    return datum is not None and "Dynamic" in datum.type_name


def ellipsoid(name: str) -> tuple[float, float]:
    """Semi-major axis [m] and flattening of a frame's ellipsoid."""
    body = frame(name).ellipsoid
    assert body is not None
    return body.semi_major_metre, 1 / body.inverse_flattening


def decimal_year(text: str) -> float:
    """Decimal year of a date."""
    parts = text.strip().split(".")
    try:
        if len(parts) == 3:
            day = date(int(parts[2]), int(parts[1]), int(parts[0]))
            first, last = date(day.year, 1, 1), date(day.year + 1, 1, 1)
            return day.year + (day - first) / (last - first)
        year = float(text)
        if not 0 <= year < MAXYEAR:
            raise ValueError("no year")
        return year
    except (ValueError, OverflowError):
        raise InputError(
            f"epoch {text!r} is not a date",
            cure="write it as day.month.year, such as 01.01.2020",
        ) from None


@cache
def _transformer(source: str, target: str) -> Transformer:
    published = ICSM.get(_plain(source)) if _plain(target) == "GDA2020" else None
    if published is None:
        return Transformer.from_crs(frame(source), frame(target), allow_ballpark=False)
    keys = [f"{rate}{key}" for rate in ("", "d") for key in ("x", "y", "z", "s", "rx", "ry", "rz")]
    # millimetres, ppb and milliarcseconds to metres, ppm and arcseconds
    values = [float(word) / 1000 for word in published.split()]
    words = [f"+{key}={value:.9g}" for key, value in zip(keys, values, strict=True)]
    return Transformer.from_pipeline(
        "+proj=helmert +convention=coordinate_frame +t_epoch=2020 " + " ".join(words)
    )


@cache
def _way(source: str, target: str) -> tuple[tuple[str, str], ...]:
    """Changes of frame from one to another: directly, or through those between.

    EPSG gives parameters for the numbered versions of a datum (NAD83(CSRS)v8) where a grid names
    the datum alone, and for older datums to ETRS89, NAD83(2011) or WGS 84 only.
    """
    ways: list[tuple[tuple[str, str], ...]] = [
        (_leg(source, target),),
        *((_leg(source, newest),) for newest in _versions(target)),
        *((_leg(newest, target),) for newest in _versions(source)),
    ]
    if is_dynamic(source) or is_dynamic(target):
        # satellites on one side; two regional datums would be tied by nothing but an identity
        ways += [(_leg(source, middle), _leg(middle, target)) for middle in PIVOTS]
    for way in ways:
        try:
            for leg in way:
                _transformer(*leg)
        except ProjError:
            continue
        return way
    raise InputError(
        f"no transformation from {source} to {target} is known",
        cure=f'give coordinates in {target}, or frame = "{target}" to take them as they are',
    )


def connected(source: str, target: str) -> bool:
    """True if a transformation between two frames is known."""
    frame(source), frame(target)
    try:
        _way(source, target)
    except InputError:
        return False
    return True


def _leg(source: str, target: str) -> tuple[str, str]:
    """One change of frame; WGS 84 as its newest realisations, which agree with the ITRF.

    The ensemble is tied to regional datums with an uncertainty of metres, and PROJ would go through
    them: 1.8 m from ITRF2014 in North America.
    """
    ensemble = [_plain(name) == "WGS84" for name in (source, target)]
    if ensemble == [True, False] and _plain(target).startswith("ITRF"):
        return WGS84_TODAY, target
    if ensemble == [False, True] and _plain(source).startswith("ITRF"):
        return source, WGS84_TODAY
    return source, target


def _versions(name: str) -> list[str]:
    """Frames that are numbered versions of a datum, the newest first."""
    head = _plain(name)
    found = {k: re.fullmatch(rf"{re.escape(head)}V(\d+)", k) for k in _geocentric()}
    return sorted((k for k, m in found.items() if m), key=lambda k: -int(k[len(head) + 1 :]))


def transform(xyz: Array, source: str, target: str, epoch: Array | float) -> tuple[Array, float]:
    """ECEF (n, 3) [m] in another frame at the epochs of observation, and accuracy [m] or NaN."""
    if frame(source) == frame(target):
        return xyz, 0.0
    when = np.broadcast_to(np.asarray(epoch, dtype=float), (len(xyz),))
    moved, variance = xyz, 0.0
    for start, end in _way(source, target):
        try:
            transformer = _transformer(start, end)
            x, y, z = moved.T
            there = transformer.transform(x, y, z, when, errcheck=True)
        except ProjError as error:
            raise InputError(f"no transformation from {source} to {target} is known") from error
        moved = np.stack(there[:3], axis=1)
        variance += _accuracy(transformer, start) ** 2
    return moved, float(np.sqrt(variance))


def _accuracy(transformer: Transformer, source: str) -> float:
    """Stated accuracy of the transformation that was just used [m]; NaN if unknown."""
    try:
        accuracy = float(transformer.get_last_used_operation().accuracy)
    except ProjError:
        # a null transformation is none for PROJ, yet its accuracy is stated
        accuracy = float(transformer.accuracy)
    if accuracy >= 0:
        return accuracy
    return ICSM_ACCURACY if _plain(source) in ICSM else float("nan")
