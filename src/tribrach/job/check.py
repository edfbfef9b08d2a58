"""From a project, a table or scans to the readings of a scanner that a field check tests."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from tribrach._types import Progress
from tribrach.calibration.calibrated import polar_of_centres
from tribrach.calibration.field_check import Earlier
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
from tribrach.observations.scanner import ScannerPolar, TargetCentres

__all__ = ["read_earlier", "readings_of", "survey_to_check"]


def survey_to_check(path: Path, precision: Precision, progress: Progress) -> tuple[Survey, str]:
    """Observations of scanners from a project or a table, and a title.

    precision : of tables without sigmas; a project has its own instruments.

    Raises
    ------
    InputError : what the file says wrong.
    """
    if path.suffix.lower() != ".toml":
        return csv_tables.read(path, Context(precision=precision)), path.name
    job = open_job(path, progress)
    project = job.project
    if not project.scans:
        return job.surveyed(), project.title
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
    return survey, project.title


def readings_of(survey: Survey) -> ScannerReadings:
    """Active readings of all scanner stations of a survey.

    Raises
    ------
    InputError : there are none.
    """
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


def read_earlier(path: Path) -> Earlier:
    """The series of an earlier check, from the JSON that it wrote.

    Raises
    ------
    InputError : not JSON of a check, or a check without series.
    """
    cure = "give the file that check wrote with --json"
    try:
        data = read_json(path)
        part = data["series"]
        if part is None:
            raise InputError(
                "the earlier check has no repeated series", file=path, cure="compare full checks"
            )
        s, dof, title = float(part["s"]), int(part["dof"]), str(data["title"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError("this is no JSON of a check", file=path, cure=cure) from error
    if not (math.isfinite(s) and s > 0 and 0 < dof < 1_000_000):
        raise InputError("this is no JSON of a check", file=path, cure=cure)
    return Earlier(s, dof, title)
