"""Gives the scanner observations of a survey a calibration model and its unknowns.

Centres of targets become range, horizontal angle and zenith angle with the covariance carried over
(``Jp C Jp^T``, method sections 2.1 and 2.2); polar observations get the model. Unknowns are named
``x10(scanner)``: the parameter, and the instrument or station that it belongs to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.polar import polar_by_xyz, polar_from_xyz, require_defined
from tribrach.instruments.calibration import Architecture, CalibrationModel
from tribrach.network.survey import ObservationTable, Survey, as_column
from tribrach.observations.control import ScalarPriors
from tribrach.observations.scanner import ScannerPolar, TargetCentres


@dataclass(frozen=True)
class StationModel:
    """The calibration model of a station."""

    model: CalibrationModel  #: the model and its parameters
    owner: str  #: instrument or station that the parameters belong to
    #: ``panoramic`` or ``hybrid``; a hybrid scanner has no back face
    architecture: Architecture = "panoramic"
    face: float = 1.0  #: face of target centres that do not say it, +1 or -1
    station: str = ""  #: the station, where some of the parameters are its own
    own: tuple[str, ...] = ()  #: these parameters

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, in the order of the model."""
        return tuple(
            unknown_name(p, self.station if p in self.own else self.owner)
            for p in self.model.parameters
        )

    @property
    def key(self) -> tuple[str, str]:
        """Alike for stations with the same unknowns."""
        return self.owner, self.station


def unknown_name(parameter: str, owner: str) -> str:
    """Name of a calibration unknown."""
    return f"{parameter}({owner})"


def scanned_stations(survey: Survey) -> list[str]:
    """Find the scanner stations from which a survey has readings of targets."""
    out: dict[str, None] = {}
    for table in survey.tables():
        if _scanned(table):
            out.update(dict.fromkeys(table.names("pose")))
    return list(out)


def _scanned(table: ObservationTable) -> bool:
    """True for readings that a scanner took of targets."""
    return table.kind in (TargetCentres, ScannerPolar) and not table.hard


def calibrate_survey(survey: Survey, models: Mapping[str, StationModel]) -> None:
    """Give the scanner observations of a survey their calibration models, in place.

    All parameters become free unknowns that start at zero unless the survey has them already.
    """
    joint = survey.joint_tables()
    tables: list[list[ObservationTable]] = []
    for number, table in enumerate(survey.tables()):
        if not _scanned(table) or not table.names("pose") & models.keys():
            tables.append([table])
            continue
        parts = _split(table, models)
        if number in joint and (len(parts) > 1 or table.kind is TargetCentres):
            raise InputError(
                "target centres that share one covariance matrix have no calibration",
                record=_first_source(table),
                cure="give each target its own covariance",
            )
        tables.append(parts)
    survey.replace_tables(tables)
    for station, given in models.items():
        if station in survey.stations:
            for name in given.unknowns:
                survey.scalars.setdefault(name, (0.0, True))


def add_priors(
    survey: Survey, names: Sequence[str], values: Array, covariance: Array, source: str
) -> None:
    """Add known parameters as observations of the unknowns."""
    table = survey.add(
        ScalarPriors,
        values=values,
        sigma=np.sqrt(np.diag(covariance)),
        scalar=list(names),
        source=[source] * len(names),
        group="calibration",
    )
    for name, value in zip(names, values, strict=True):
        survey.scalars[name] = (float(value), True)
    k = len(names)
    if k > 1:
        rows = np.zeros(k, dtype=np.int64)
        survey.correlate(np.full(k, table), np.arange(k), rows, covariance, source)


def _split(table: ObservationTable, models: Mapping[str, StationModel]) -> list[ObservationTable]:
    """The table in parts of one model each; what has no model stays as it is."""
    stations = as_column(table.columns["station"], table.n).astype(str)
    keys = [models[s].key if s in models else None for s in stations]
    out = []
    for key in dict.fromkeys(keys):
        rows = np.array([one == key for one in keys])
        part = table.part(rows)
        out.append(part if key is None else _with_model(part, models[str(stations[rows][0])]))
    return out


def _with_model(part: ObservationTable, given: StationModel) -> ObservationTable:
    """Observations of one model as polar ones with its unknowns."""
    columns = dict(part.columns)
    if part.kind is TargetCentres:
        columns = _polar_columns(part, given)
    face = as_column(columns.get("face", 1.0), part.n).astype(float)
    raw_back = columns["values"][:, 2] > np.pi
    back = np.flatnonzero(raw_back | (face < 0))
    if given.architecture == "hybrid" and len(back):
        raise InputError(
            f"{given.owner} is a hybrid scanner and has no back face",
            record=str(columns["source"][back[0]]) or None,
            cure="say that it is panoramic, or correct the face",
        )
    names = np.array([given.unknowns] * part.n, dtype=object).reshape(part.n, -1)
    columns |= {"face": face, "model": given.model, "parameters": names}
    return ObservationTable(ScannerPolar, part.group, columns, part.n)


def _polar_columns(part: ObservationTable, given: StationModel) -> dict[str, Any]:
    """Columns of polar observations from target centres."""
    xyz = np.asarray(part.columns["values"], dtype=float)
    scale = part.columns.get("scale")
    if scale is not None and any(as_column(scale, part.n)):
        raise InputError(
            "target centres with a scale of their own have no calibration",
            record=_first_source(part),
            cure="leave the scale or the calibration out",
        )
    polar, matrices = polar_of_centres(
        xyz, np.asarray(part.columns["covariance"]), list(part.columns["source"])
    )
    kept = {k: v for k, v in part.columns.items() if k not in ("scale", "values", "covariance")}
    return kept | {"values": polar, "covariance": matrices, "face": given.face}


def polar_of_centres(xyz: Array, covariance: Array, sources: Sequence[str]) -> tuple[Array, Array]:
    """Turn target centres into polar coordinates with their covariances."""
    polar = polar_from_xyz(xyz)
    require_defined(polar, np.asarray(sources, dtype=object))
    turn = polar_by_xyz(xyz)
    matrices = turn @ covariance @ turn.transpose(0, 2, 1)
    symmetric: Array = (matrices + matrices.transpose(0, 2, 1)) / 2
    return polar, symmetric


def _first_source(table: ObservationTable) -> str | None:
    """File and line of the first observation, None if it has none."""
    sources = table.columns.get("source", [])
    return str(sources[0]) if len(sources) and sources[0] else None
