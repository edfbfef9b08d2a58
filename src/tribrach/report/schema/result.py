"""The result of an adjustment: schema 2."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Matrix, Number, Triple

__all__ = [
    "SCHEMA",
    "AdjustedObservation",
    "AdjustedPlane",
    "AdjustedPoint",
    "AdjustedScalar",
    "AdjustedStation",
    "AdjustedVector",
    "DatumPart",
    "EditPart",
    "GlobalTestPart",
    "OrientationPart",
    "ReferencePart",
    "ResultHead",
    "Sigma0Part",
]

#: version of the layout; 2 has ``id`` and ``suspicious`` of observations and is checked by models
SCHEMA = 2


class DatumPart(DocumentPart):
    """What fixes the frame."""

    kind: str
    names: list[str]
    """Points and stations that carry it."""
    statement: str


class ReferencePart(DocumentPart):
    """The reference system of the coordinates, null where they have none."""

    crs: str | None
    frame: str | None
    epoch: Number


class GlobalTestPart(DocumentPart):
    """The weighted sum of squares against its chi-square bounds."""

    statistic: float
    lower: Number
    upper: Number
    alpha: float
    accepted: bool | None
    """Null where there is no redundancy."""


class Sigma0Part(DocumentPart):
    """Sigma of unit weight, redundancy, global test."""

    prior: float
    posterior: Number
    dof: int
    vtpv: float
    covariances: Literal["prior", "posterior"]
    """What all covariances of unknowns in this document are scaled by."""
    iterations: int
    global_test: GlobalTestPart


class AdjustedPoint(DocumentPart):
    """A point of the network."""

    xyz: Triple
    """E, N, U of the work frame [m]; null where the network has no such coordinate."""
    covariance: Matrix
    """3 x 3 [m^2]."""
    role: Literal["control", "free", "check"]
    geodetic: tuple[float, float, float] | None = None
    """Latitude, longitude [rad] and ellipsoidal height [m]."""
    ecef: tuple[float, float, float] | None = None
    ecef_covariance: Matrix | None = None
    projected: tuple[float, float, float] | None = None
    """Easting, northing and height in the grid of the site [m]."""


class OrientationPart(DocumentPart):
    """An orientation unknown [rad]."""

    value: float
    sigma: Number


class AdjustedStation(DocumentPart):
    """A scanner station by its pose; a set-up on a point by its orientation unknowns."""

    world_from_scanner: Matrix | None
    """4 x 4."""
    covariance: Matrix | None
    """6 x 6 of the translation [m] and of left rotation increments [rad]."""
    orientation: dict[str, OrientationPart] | None = None


class AdjustedScalar(DocumentPart):
    """A calibration parameter, scale, refraction coefficient or the like."""

    value: float
    sigma: Number
    unit: str
    role: str


class AdjustedVector(DocumentPart):
    """A lever arm or common shift [m, m^2]."""

    xyz: list[float]
    covariance: Matrix
    role: str


class AdjustedPlane(DocumentPart):
    """A plane ``n x = d``."""

    normal: list[float]
    offset: float
    covariance: Matrix
    """Of two turns of the normal [rad] and of the offset [m]."""


class AdjustedObservation(DocumentPart):
    """One observed value; figures that need it to take part are null for others."""

    id: str
    """Stable id of the observation; the components of a vector share it."""
    kind: str
    component: str
    from_: str = Field(alias="from")
    to: str
    unit: str
    value: float
    sigma: float
    residual: Number
    """Adjusted minus observed."""
    redundancy: Number
    w: Number
    tau: Number
    mdb: Number
    """Minimal detectable bias."""
    external: Number
    """What an undetected bias of that size would do to a position [m]."""
    external_at: str | None
    block_test: Number
    suspicious: bool
    group: str
    state: Literal["active", "check", "off"]
    source: str
    """File and line, or scan and detection."""
    reason: str = ""
    """Why it is off or a check."""


class EditPart(DocumentPart):
    """What somebody changed in the network by hand."""

    id: str
    """Of the observation; the name of a point; scan and place of a target."""
    action: str
    """``off``, ``check`` or ``active``; ``sigma`` with the new values [m, rad]; ``role`` of a
    point; ``name`` of a target, or ``rejected``."""
    reason: str
    by: str
    at: str = ""
    """When it was decided, as it was written; empty if that is not known."""


class ResultHead(Document):
    """The adjusted network; chapters of the report add their keys."""

    title: str
    datum: DatumPart
    reference: ReferencePart
    sigma0: Sigma0Part
    points: dict[str, AdjustedPoint]
    stations: dict[str, AdjustedStation]
    calibrations: dict[str, AdjustedScalar]
    lever_arms: dict[str, AdjustedVector]
    planes: dict[str, AdjustedPlane]
    observations: list[AdjustedObservation]
    edits: list[EditPart]
    """Observations switched off or given another sigma by hand."""
    warnings: list[str]
    """Sentences, the gravest first."""
