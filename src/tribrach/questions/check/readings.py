"""From a project, a table or scans to the readings of a scanner that a field check tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.calibration.calibrated import polar_of_centres
from tribrach.calibration.field_check import Earlier
from tribrach.calibration.known_lengths import KnownLengths
from tribrach.calibration.scanner_readings import ScannerReadings, folded
from tribrach.errors import InputError
from tribrach.instruments.precision import Precision
from tribrach.io.json_file import read_json
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.csv.scans import SERIES
from tribrach.job.opened import open_job
from tribrach.job.polar_targets import observe_readings
from tribrach.job.steps import find_and_name
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinates
from tribrach.observations.scanner import ScannerPolar, TargetCentres
from tribrach.observations.sights import Distances

#: roles of points whose coordinates are known
_KNOWN = frozenset({"control", "fixed", "check"})
#: points whose distances are known lengths, evenly chosen from more
_MOST = 40


def survey_to_check(
    path: Path, precision: Precision, progress: Progress
) -> tuple[Survey, Survey, str]:
    """Observations of scanners, what is given, a title; ``precision`` is of bare tables."""
    if path.suffix.lower() != ".toml":
        table = csv_tables.read(path, Context(precision=precision))
        return table, table, path.name
    job = open_job(path, progress)
    project = job.project
    if not project.scans:
        return job.survey, job.survey, project.title
    work = find_and_name(job, project.results, progress)
    survey = Survey()
    if work.named is None:
        raise InputError(
            "the project looks for no targets", file=path, cure="add a section [targets]"
        )
    for station, names in work.named.identification.names.items():
        detections = zip(names, work.named.targets[station], strict=True)
        own = {name: d for name, d in detections if name}
        survey.station(station)
        observe_readings(survey, station, own, work.scans, work.findings)
    return survey, job.survey, project.title


def noise_of(path: Path, precision: Precision) -> ScannerReadings | None:
    """Readings of a table with the noise of their angles alone; None if that is all there is."""
    if path.suffix.lower() == ".toml" or not precision.scan_angle_systematic:
        return None
    noise = replace(precision, scan_angle_systematic=0.0)
    return readings_of(csv_tables.read(path, Context(precision=noise)))


def readings_of(survey: Survey) -> ScannerReadings:
    """Active readings of all scanner stations of a survey."""
    parts: list[ScannerReadings] = []
    if not survey.tables():
        raise InputError("there are no observations", cure="give a table of scanned targets")
    network = survey.network()
    for o in network.observations:
        if not isinstance(o, ScannerPolar | TargetCentres):
            continue
        active = np.flatnonzero(o.use == Use.ACTIVE)
        if isinstance(o, ScannerPolar):
            polar, face = folded(o.values[active], o.face[active])
            covariance = o.covariance[active]
        else:
            polar, covariance = polar_of_centres(
                o.values[active], o.covariance[active], list(o.source[active])
            )
            face = np.ones(len(active))
        ends = [o.ends(network.start.layout)[i] for i in active]
        split = [
            start.rpartition(SERIES) if SERIES in start else (start, "", "") for start, _ in ends
        ]
        parts.append(
            ScannerReadings(
                np.array([name for name, _, _ in split], dtype=object),
                np.array([one for _, _, one in split], dtype=object),
                np.array([end for _, end in ends], dtype=object),
                face,
                polar,
                covariance,
                o.source[active],
            )
        )
    if not parts or not sum(len(part) for part in parts):
        raise InputError(
            "there are no targets that a scanner saw", cure="give a table of scanned targets"
        )
    names = ScannerReadings.__dataclass_fields__
    return ScannerReadings(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


def known_lengths(survey: Survey, targets: Sequence[str]) -> KnownLengths:
    """Lengths between targets that a survey knows: measured distances, and points with coordinates.

    Coordinates count with the covariances that are stated for them, also those between points, so
    that lengths with a common end are correlated. Coordinates without sigmas make no known length:
    taken as exact they would blame their own errors on the scanner.
    """
    wanted = set(targets)
    pairs, lengths, variances = list[tuple[str, str]](), list[float](), list[float]()
    for table in survey.tables():
        if table.kind is not Distances:
            continue
        ends = zip(table.columns["start"], table.columns["end"], strict=True)
        use = np.broadcast_to(table.columns.get("use", Use.ACTIVE), table.n)
        for k, (a, b) in enumerate(ends):
            if use[k] == Use.ACTIVE and a != b and {a, b} <= wanted:
                pairs.append((str(a), str(b)))
                lengths.append(float(np.ravel(table.columns["values"][k])[0]))
                variances.append(float(table.columns["covariance"][k, 0, 0]))
    names, xyz, own = _coordinates(survey, wanted)
    without = tuple(
        name
        for name in dict.fromkeys(targets)
        if name not in names
        and (point := survey.points.get(name)) is not None
        and point.role in _KNOWN
        and np.isfinite(point.xyz).all()
    )
    count = len(pairs)
    entries: list[tuple[str, tuple[int, ...]]]
    entries = [(f"{a} to {b}", (k,)) for k, (a, b) in enumerate(pairs)]
    index = np.array(list(combinations(range(len(names)), 2)), dtype=np.int64).reshape(-1, 2)
    chord = xyz[index[:, 1]] - xyz[index[:, 0]]
    long = np.linalg.norm(chord, axis=1)
    apart = long > 0
    index, chord, long = index[apart], chord[apart], long[apart]
    by = np.zeros((len(index), len(names), 3))
    rows = np.arange(len(index))
    by[rows, index[:, 1]] = chord / long[:, None]
    by[rows, index[:, 0]] = -chord / long[:, None]
    flat = by.reshape(len(index), 3 * len(names))
    covariance = np.zeros((count + len(index), count + len(index)))
    covariance[:count, :count] = np.diag(variances)
    covariance[count:, count:] = flat @ own @ flat.T
    for k, name in enumerate(names):
        touched = count + np.flatnonzero((index == k).any(axis=1))
        entries.append((f"the coordinates of {name}", tuple(int(row) for row in touched)))
    pairs += [(names[i], names[j]) for i, j in index]
    lengths += long.tolist()
    known = tuple((what, rows) for what, rows in entries if rows)
    return KnownLengths(tuple(pairs), np.array(lengths), covariance, known, without)


def _coordinates(survey: Survey, wanted: set[str]) -> tuple[list[str], Array, Array]:
    """Points with stated coordinates: names (p), coordinates (p, 3), covariance (3 p, 3 p)."""
    found: dict[str, tuple[Array, Array, int, int]] = {}
    for name, point in survey.points.items():
        if point.covariance is not None and point.role in _KNOWN:
            found[name] = (point.xyz, point.covariance, -1, -1)
    for number, table in enumerate(survey.tables()):
        if table.kind is not Coordinates:
            continue
        use = np.broadcast_to(table.columns.get("use", Use.ACTIVE), table.n)
        for item, name in enumerate(str(n) for n in table.columns["position"]):
            given = survey.points.get(name)
            # a coordinate that was rejected or switched off is not known
            if name in found or use[item] not in (Use.ACTIVE, Use.CHECK):
                continue
            if given is None or given.role not in _KNOWN or not given.stated:
                continue
            values, covariance = table.columns["values"], table.columns["covariance"]
            found[name] = (values[item], covariance[item], number, item)
    names = [name for name in found if name in wanted and np.isfinite(found[name][0]).all()]
    if len(names) > _MOST:
        names = [names[int(k)] for k in np.linspace(0, len(names) - 1, _MOST)]
    own = np.zeros((3 * len(names), 3 * len(names)))
    place: dict[tuple[int, int], int] = {}
    for k, name in enumerate(names):
        own[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = found[name][1]
        place[found[name][2], found[name][3]] = 3 * k
    for joint in survey.joint_covariances():
        at = [
            place.get((int(t), int(i)), -4) + int(r)
            for t, i, r in zip(joint.table, joint.item, joint.row, strict=True)
        ]
        inside = np.flatnonzero(np.array(at) >= 0)
        rows = np.array(at)[inside]
        own[np.ix_(rows, rows)] = joint.covariance[np.ix_(inside, inside)]
    return names, np.array([found[name][0] for name in names]).reshape(-1, 3), own


def read_lengths(path: Path, targets: Sequence[str]) -> KnownLengths:
    """Known lengths between targets from a table of distances or of coordinates."""
    found = known_lengths(csv_tables.read(path, Context(role="control")), targets)
    if not len(found):
        held = ", ".join(found.without_sigma)
        raise InputError(
            "there is no length between two targets of the check"
            + (f" whose sigma is known: {held} stand there without" if held else ""),
            file=path,
            cure="give a table from,to,distance_m,sigma_mm, or coordinates of the targets with "
            "their sigmas",
        )
    return found


def read_earlier(path: Path) -> Earlier:
    """The series of an earlier check, from the JSON that it wrote."""
    cure = "give the file that check wrote with --json"
    try:
        data = read_json(path)
        part = data["series"]
        if part is None:
            raise InputError(
                "the earlier check has no repeated series", file=path, cure="compare full checks"
            )
        s, dof, title = float(part["s"]), float(part["dof_equivalent"]), str(data["title"])
        shown = [one["repeated"] for one in data["statistics"] if one["repeated"] is not None]
        u = [(float(one["u"]), float(one["dof_equivalent"])) for one in shown]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError("this is no JSON of a check", file=path, cure=cure) from error
    if not all(math.isfinite(a) and a > 0 and 0 < b < 1_000_000 for a, b in [(s, dof), *u]):
        raise InputError("this is no JSON of a check", file=path, cure=cure)
    return Earlier(s, dof, title, *u[0]) if len(u) == 1 else Earlier(s, dof, title)
