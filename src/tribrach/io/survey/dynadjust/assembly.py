"""A survey from DynAdjust's records, whichever of its two file formats they came in.

The work frame is East-North-Up at the centroid of the stations, on the ellipsoid of the stations'
reference frame. Stations marked ``F`` are free; ``C`` components are fixed. Without any ``C`` and
any point cluster the given coordinates carry inner constraints, which is what the weak prior that
DynAdjust gives its free stations amounts to.

**GNSS.** Measurements of other frames are transformed at their own epoch (method section 1.1), a
baseline by both its ends. Covariances are scaled in latitude, longitude and height by P, L and H,
then as a whole by V; those of geographic points are in rad^2 and m^2.

**Terrestrial measurements.** Angles, azimuths, directions, zenith and vertical angles refer to the
ellipsoid's normal; DynAdjust models no refraction and none is assumed here. With a geoid file,
angles are read along the plumb lines of its stations, astronomic values are reduced by their
deflections, heights and their differences are orthometric and distances at sea level are on the
geoid; without one all of these are taken as on the ellipsoid.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import RefusalCollector
from tribrach.geodesy import frames
from tribrach.geodesy.site import ecef_from_geodetic
from tribrach.io.survey.dynadjust.records import (
    IGNORED,
    Entry,
    GnssCluster,
    Records,
    TerrestrialRecord,
    number,
    packed_dms,
)
from tribrach.io.survey.dynadjust.stations import Stations
from tribrach.network.facts import Reference
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Heights
from tribrach.observations.ellipsoidal import (
    EllipsoidArcs,
    EllipsoidChords,
    Latitudes,
    Longitudes,
)
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Angles, Azimuths, Directions, SlopeDistances, ZenithAngles
from tribrach.sentences import Sentence

#: epochs closer than this are taken as one [years]
SAME_EPOCH = 1e-3
#: a transformation of positions less accurate than this is warned about [m]
ACCURATE = 0.1
#: kinds of the terrestrial measurement types
_KINDS: dict[str, type[Observations]] = {
    "A": Angles,
    "B": Azimuths,
    "C": EllipsoidChords,
    "D": Directions,
    "E": EllipsoidArcs,
    "H": Heights,
    "I": Latitudes,
    "J": Longitudes,
    "K": Azimuths,
    "L": HeightDifferences,
    "M": EllipsoidArcs,
    "P": Latitudes,
    "Q": Longitudes,
    "R": Heights,
    "S": SlopeDistances,
    "V": ZenithAngles,
    "Z": ZenithAngles,
}


def add_clusters(
    survey: Survey, stations: Stations, clusters: Sequence[GnssCluster], refused: RefusalCollector
) -> None:
    """Add all GNSS measurements."""
    for cluster in clusters:
        if min(cluster.scales) <= 0:
            refused.add(
                cluster.place.error(
                    Sentence("a covariance scale is {cluster:g}", cluster=min(cluster.scales)),
                    "give scales above zero",
                )
            )
        for entry in cluster.entries:
            with refused.record():
                # all of them are looked at before the first is used
                (_geographic if _is_geographic(cluster) else _cartesian)(entry)
    refused.settle()
    _add_baselines(survey, stations, [c for c in clusters if c.type != "Y"])
    _add_points(survey, stations, [c for c in clusters if c.type == "Y"])


def _add_baselines(survey: Survey, stations: Stations, clusters: Sequence[GnssCluster]) -> None:
    """Add baselines with the covariances of their clusters."""
    entries = [entry for cluster in clusters for entry in cluster.entries]
    if not entries:
        return
    owner = [cluster for cluster in clusters for _ in cluster.entries]
    start = np.array([stations.ecef[entry.first] for entry in entries])
    vector = np.array([_cartesian(entry) for entry in entries])
    ends = np.concatenate([start, start + vector])
    a, b = np.split(_in_network_frame(survey, stations, [*owner, *owner], ends, positions=False), 2)
    w_from_ecef = stations.site.w_from_ecef
    maps = w_from_ecef @ _scaling(stations, owner, start + vector / 2)
    _add(
        survey,
        GnssBaselines,
        clusters,
        (b - a) @ w_from_ecef.T,
        maps,
        start=[entry.first for entry in entries],
        end=[entry.second for entry in entries],
    )


def _add_points(survey: Survey, stations: Stations, clusters: Sequence[GnssCluster]) -> None:
    """Add measured points with the covariances of their clusters."""
    entries = [entry for cluster in clusters for entry in cluster.entries]
    if not entries:
        return
    owner = [cluster for cluster in clusters for _ in cluster.entries]
    geographic = np.array([_is_geographic(cluster) for cluster in owner])
    xyz = np.zeros((len(entries), 3))
    for i, entry in enumerate(entries):
        if geographic[i]:
            latitude, longitude, height = _geographic(entry)
            if owner[i].coordinates == "LLH":
                height = height + stations.geoid_height(entry.first)
            xyz[i] = ecef_from_geodetic(latitude, longitude, height, stations.ellipsoid)
        else:
            xyz[i] = _cartesian(entry)
    scaling = _scaling(stations, owner, xyz)
    scaling[geographic] = scaling[geographic] @ _ecef_by_geodetic(stations, xyz[geographic])
    moved = _in_network_frame(survey, stations, owner, xyz, positions=True)
    if not stations.geoid and any(cluster.coordinates == "LLH" for cluster in clusters):
        survey.warnings.append(
            "heights of points measured as LLH are orthometric; they are taken as ellipsoidal, "
            "no geoid model is read"
        )
    _add(
        survey,
        GnssPositions,
        clusters,
        stations.site.from_ecef(moved),
        stations.site.w_from_ecef @ scaling,
        position=[entry.first for entry in entries],
    )


def _add(
    survey: Survey,
    kind: type[Observations],
    clusters: Sequence[GnssCluster],
    values: Array,
    maps: Array,
    **columns: Any,
) -> None:
    """Add values (N, 3) in W; ``maps`` (N, 3, 3) take the covariances of the file to W."""
    covariances, first = [], 0
    for cluster in clusters:
        n = len(cluster.entries)
        given = cluster.covariance().reshape(n, 3, n, 3)
        m = maps[first : first + n]
        covariances.append(cluster.scales[0] * np.einsum("aij,ajbk,blk->aibl", m, given, m))
        first += n
    entries = [entry for cluster in clusters for entry in cluster.entries]
    ignored = np.array([entry.ignored for entry in entries])
    table = survey.add(
        kind,
        values=values,
        covariance=np.concatenate([np.einsum("aiaj->aij", c) for c in covariances]),
        source=[str(entry.place) for entry in entries],
        use=np.where(ignored, Use.OFF, Use.ACTIVE).astype(np.int8),
        reason=np.where(ignored, IGNORED, "").astype(object),
        **columns,
    )
    first = 0
    for cluster, covariance in zip(clusters, covariances, strict=True):
        n = len(cluster.entries)
        if n > 1:
            item, row = np.divmod(np.arange(3 * n), 3)
            survey.correlate(
                np.full(3 * n, table),
                first + item,
                row,
                covariance.reshape(3 * n, 3 * n),
                str(cluster.place),
            )
        first += n


def _scaling(stations: Stations, owner: Sequence[GnssCluster], xyz: Array) -> Array:
    """Matrices (N, 3, 3) that stretch ECEF errors at ``xyz`` by the roots of L, P and H."""
    roots = np.sqrt(np.array([(c.scales[2], c.scales[1], c.scales[3]) for c in owner]))
    axes = stations.axes(xyz)
    out: Array = np.einsum("nki,nk,nkj->nij", axes, roots, axes)
    return out


def _ecef_by_geodetic(stations: Stations, xyz: Array) -> Array:
    """Derivatives (n, 3, 3) of ECEF by latitude, longitude [rad] and height [m]."""
    a, f = stations.ellipsoid
    e2 = f * (2 - f)
    latitude, _, height = stations.geodetic(xyz).T
    w2 = 1 - e2 * np.sin(latitude) ** 2
    columns = np.zeros((len(xyz), 3, 3))
    columns[:, 1, 0] = a * (1 - e2) / w2**1.5 + height
    columns[:, 0, 1] = (a / np.sqrt(w2) + height) * np.cos(latitude)
    columns[:, 2, 2] = 1.0
    return stations.axes(xyz).transpose(0, 2, 1) @ columns


def _in_network_frame(
    survey: Survey,
    stations: Stations,
    owner: Sequence[GnssCluster],
    xyz: Array,
    *,
    positions: bool,
) -> Array:
    """Carry ECEF positions (N, 3) from each entry's frame and epoch to those of the stations."""
    out = xyz.copy()
    for name in dict.fromkeys(cluster.frame for cluster in owner):
        rows = np.array([cluster.frame == name for cluster in owner])
        place = next(cluster.place for cluster in owner if cluster.frame == name)
        with place.named():
            moving = frames.is_dynamic(name)
        years = np.array([_year(c) if moving else stations.year for c in owner if c.frame == name])
        with place.named():
            out[rows], accuracy = frames.transform(xyz[rows], name, stations.frame, years)
        if positions and not accuracy <= ACCURATE:
            survey.warnings.append(
                Sentence(
                    "{name} and {stations.frame} differ by an uncertain amount (stated accuracy "
                    "{accuracy:mg}): measured points carry it",
                    name=name,
                    stations=stations,
                    accuracy=accuracy,
                )
            )
        late = np.abs(years - stations.year).max() > SAME_EPOCH
        if moving and stations.dynamic and late:
            _other_epoch(survey, stations, name, owner, positions)
    return out


def _other_epoch(
    survey: Survey,
    stations: Stations,
    name: str,
    owner: Sequence[GnssCluster],
    positions: bool,
) -> None:
    """Refuse positions of another epoch, and warn about baselines: velocities are not known."""
    cluster = next(
        c for c in owner if c.frame == name and abs(_year(c) - stations.year) > SAME_EPOCH
    )
    what = f"epoch {cluster.epoch} of {name} is not that of the stations, {stations.epoch}"
    if positions:
        raise cluster.place.error(
            f"{what}, and no station velocities are known",
            "give stations and measurements in a plate-fixed frame or at one epoch",
        )
    survey.warnings.append(
        f"{cluster.place}: {what}: the turn of the plate in between is neglected in the baselines"
    )


def _year(cluster: GnssCluster) -> float:
    with cluster.place.named():
        return frames.decimal_year(cluster.epoch)


def _is_geographic(cluster: GnssCluster) -> bool:
    if cluster.coordinates in ("LLH", "LLh"):
        return True
    if cluster.coordinates != "XYZ":
        raise cluster.place.error(
            f"coordinate type {cluster.coordinates!r} of the point cluster is not known",
            "use XYZ, LLH or LLh",
        )
    return False


def _cartesian(entry: Entry) -> Array:
    return np.array(
        [
            number(text, f"{axis} of the measurement", entry.place)
            for text, axis in zip(entry.values, "XYZ", strict=True)
        ]
    )


def _geographic(entry: Entry) -> tuple[Any, Any, Any]:
    latitude = packed_dms(entry.values[0], "the latitude", entry.place)
    longitude = packed_dms(entry.values[1], "the longitude", entry.place)
    height = number(entry.values[2], "the height", entry.place)
    return np.float64(latitude), np.float64(longitude), np.float64(height)


def add_sights(survey: Survey, stations: Stations, sights: Sequence[TerrestrialRecord]) -> None:
    """Add all terrestrial measurements."""
    for kind in dict.fromkeys(sight.type for sight in sights):
        _add_sights(survey, stations, kind, [sight for sight in sights if sight.type == kind])
    active = {sight.type for sight in sights if not sight.ignored}
    if stations.geoid:
        _apply_geoid(survey, stations)
        return
    if "M" in active:
        survey.warnings.append(
            "distances at sea level are taken as on the ellipsoid, no geoid model is read"
        )
    if any(sight.type in "HL" and not sight.ignored for sight in sights):
        survey.warnings.append(
            "measured heights and height differences are orthometric; they are taken as "
            "ellipsoidal, no geoid model is read"
        )
    if active & set("IJK"):
        survey.warnings.append(
            "astronomic latitudes, longitudes and azimuths are taken as geodetic, no deflections "
            "of the vertical are read"
        )


def _apply_geoid(survey: Survey, stations: Stations) -> None:
    """Plumb lines and geoid heights of the stations that the geoid file knows."""
    for name, (undulation, xi, eta) in stations.geoid.items():
        if name in survey.points:
            survey.undulations[name] = undulation
            survey.deflections[name] = (xi, eta)
    missing = [name for name in survey.points if name not in stations.geoid]
    if missing:
        some = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        survey.warnings.append(
            f"the geoid file has nothing for {len(missing)} stations: {some}; their heights are "
            "taken as ellipsoidal and their plumb lines as normals; add them to it"
        )
        # as ellipsoidal as the heights: no difference of levels is half reduced
        survey.undulations |= dict.fromkeys(missing, 0.0)


def _reductions(stations: Stations, kind: str, sights: Sequence[TerrestrialRecord]) -> Array:
    """What makes orthometric heights and astronomic places (n,) those of the ellipsoid."""
    none = (0.0, 0.0, 0.0)
    geoid = np.array([stations.geoid.get(sight.names[0], none) for sight in sights]).reshape(-1, 3)
    if kind == "H":
        return geoid[:, 0]
    if kind == "I":
        return -geoid[:, 1]
    if kind == "J":
        xyz = np.array([stations.ecef[sight.names[0]] for sight in sights])
        longitude: Array = -geoid[:, 2] / np.cos(stations.geodetic(xyz)[:, 0])
        return longitude
    return np.zeros(len(sights))


def _add_sights(
    survey: Survey, stations: Stations, kind: str, sights: Sequence[TerrestrialRecord]
) -> None:
    ignored = np.array([sight.ignored for sight in sights])
    values = np.array([sight.value for sight in sights]) + _reductions(stations, kind, sights)
    survey.add(
        _KINDS[kind],
        # a vertical angle is counted from the horizon
        values=pi / 2 - values if kind == "Z" else values,
        sigma=np.array([sight.sigma for sight in sights]),
        source=[str(sight.place) for sight in sights],
        use=np.where(ignored, Use.OFF, Use.ACTIVE).astype(np.int8),
        reason=np.where(ignored, IGNORED, "").astype(object),
        **_fields(stations, kind, sights),
    )


def _fields(stations: Stations, kind: str, sights: Sequence[TerrestrialRecord]) -> dict[str, Any]:
    """The fields of the kind that name stations and heights, of the geoid too."""
    first = [sight.names[0] for sight in sights]
    if kind in "HIJPQR":
        return {"position": first}
    out: dict[str, Any] = {"start": first, "end": [sight.names[1] for sight in sights]}
    if kind == "M":
        for k, name in enumerate(("geoid_start", "geoid_end")):
            out[name] = np.array([stations.geoid_height(sight.names[k]) for sight in sights])
    if kind in "CELM":
        return out
    out["height_instrument"] = np.array([sight.height_instrument for sight in sights])
    out["height_target"] = np.array([sight.height_target for sight in sights])
    if kind in "BK":
        out["astronomic"] = 1.0 if kind == "K" else 0.0
    if kind == "A":
        out["foresight"] = [sight.names[2] for sight in sights]
    if kind == "D":
        out["orientation"] = [sight.set_name for sight in sights]
    return out


def assemble(files: Sequence[Records], refused: RefusalCollector) -> Survey:
    """The survey of all files of one network."""
    stations = Stations(files, refused)
    clusters = [cluster for file in files for cluster in file.clusters]
    sights = [sight for file in files for sight in file.sights]
    active, ignored = _measured(stations, files, refused)
    refused.settle()
    survey = Survey(site=stations.site)
    survey.warnings += [text for file in files for text in file.warnings]
    stations.add_to(survey, active, ignored)
    refused.settle()
    add_clusters(survey, stations, clusters, refused)
    add_sights(survey, stations, sights)
    points = any(c.type == "Y" and not all(e.ignored for e in c.entries) for c in clusters)
    if not points and not stations.constrained & active:
        survey.datum = Datum("free")
        survey.warnings.append(
            "no station is constrained and no point is measured: the given coordinates of all "
            "stations carry inner constraints"
        )
    survey.reference = Reference(frame=stations.frame, epoch=stations.year)
    return survey


def _measured(
    stations: Stations, files: Sequence[Records], refused: RefusalCollector
) -> tuple[set[str], set[str]]:
    """Names of stations in active and in ignored measurements.

    A station that is in no station file is refused.
    """
    names: dict[bool, set[str]] = {False: set(), True: set()}
    for file in files:
        for cluster in file.clusters:
            for entry in cluster.entries:
                ends = (entry.first,) if cluster.type == "Y" else (entry.first, entry.second)
                with refused.record():
                    names[entry.ignored] |= stations.known(ends, entry.place)
        for sight in file.sights:
            with refused.record():
                names[sight.ignored] |= stations.known(sight.names, sight.place)
    return names[False], names[True]
