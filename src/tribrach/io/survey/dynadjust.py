"""A survey from DynAdjust's records, whichever of its two file formats they came in.

The work frame is East-North-Up at the centroid of the stations, on the ellipsoid of the
stations' reference frame. Stations marked ``F`` are free; ``C`` components are fixed. Without
any ``C`` and any point cluster the given coordinates carry inner constraints, which is what the
weak prior that DynAdjust gives its free stations amounts to.
"""

from __future__ import annotations

from collections.abc import Sequence

from tribrach.io.survey.dynadjust_gnss import add_clusters
from tribrach.io.survey.dynadjust_records import Records
from tribrach.io.survey.dynadjust_sights import add_sights
from tribrach.io.survey.dynadjust_stations import Stations
from tribrach.network.network import Datum
from tribrach.network.survey import Survey

__all__ = ["assemble"]


def assemble(files: Sequence[Records]) -> Survey:
    """The survey of all files of one network.

    Raises
    ------
    InputError : no stations, an unknown station, frame or coordinate type, epochs that do not
        fit, a covariance that is not positive definite, a measurement type that is not read.
    """
    stations = Stations(files)
    clusters = [cluster for file in files for cluster in file.clusters]
    sights = [sight for file in files for sight in file.sights]
    active, ignored = _measured(stations, files)
    survey = Survey(site=stations.site)
    survey.warnings += [text for file in files for text in file.warnings]
    stations.add_to(survey, active, ignored)
    add_clusters(survey, stations, clusters)
    add_sights(survey, sights)
    points = any(c.type == "Y" and not all(e.ignored for e in c.entries) for c in clusters)
    if not points and not stations.constrained & active:
        survey.datum = Datum("free")
        survey.warnings.append(
            "no station is constrained and no point is measured: the given coordinates of all "
            "stations carry inner constraints"
        )
    survey.info |= {
        "format": "DynAdjust",
        "files": [file.file for file in files],
        "frame": stations.frame,
        "epoch": stations.year,
    }
    return survey


def _measured(stations: Stations, files: Sequence[Records]) -> tuple[set[str], set[str]]:
    """Names of stations in active and in ignored measurements.

    Raises
    ------
    InputError : a station that is in no station file.
    """
    names: dict[bool, set[str]] = {False: set(), True: set()}
    for file in files:
        for cluster in file.clusters:
            for entry in cluster.entries:
                ends = (entry.first,) if cluster.type == "Y" else (entry.first, entry.second)
                names[entry.ignored] |= stations.known(ends, entry.place)
        for sight in file.sights:
            names[sight.ignored] |= stations.known(sight.names, sight.place)
    return names[False], names[True]
