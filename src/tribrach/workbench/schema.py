"""What the page is drawn from: the scene, schema 1. Tables are columns, names are keys.

Coordinates are those of the delivered clouds, absolute, so that a cloud and a point of the network
lie where they belong without any conversion; ``frame`` turns their axes into east, north, up. What
a person reads with its unit is in words here, so that page and report write it alike.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix, Triple
from tribrach.report.schema.result import Sigma0Part

__all__ = ["SCHEMA", "SceneDocument"]

#: version of the layout
SCHEMA = 1

Names = list[str]
Numbers = list[Finite]


class SceneSummary(Sigma0Part):
    """Sigma of unit weight with the verdict of the global test in words."""

    verdict: str


class ScenePoints(DocumentPart):
    """Points of the network."""

    name: Names
    role: list[Literal["control", "check", "free"]]
    xyz: list[Triple]
    covariance: list[Matrix]
    frames: dict[str, list[list[str] | None]]
    """Coordinates as they are read by a person, by the name of the frame."""


class SceneStations(DocumentPart):
    """Scanner stations, and set-ups on points."""

    name: Names
    kind: list[Literal["scanner", "set-up"]]
    pose: list[Matrix | None]
    """World from scanner, 4 x 4."""
    pose_of_clouds: list[Matrix | None] = Field(default_factory=list)
    """By which the clouds were placed, 4 x 4; what a session moves carries them along."""
    xyz: list[Triple | None]
    covariance: list[Matrix | None]
    """6 x 6 of the translation [m] and of left rotation increments [rad]."""
    clouds: list[Names]


class SceneObservations(DocumentPart):
    """Observed values, one a row; figures are null where they do not exist."""

    id: Names
    kind: Names
    title: Names
    """Of the kind and component, as the report calls them."""
    component: Names
    from_: Names = Field(alias="from")
    to: Names
    unit: Names
    value: Numbers
    sigma: Numbers
    residual: Numbers
    redundancy: Numbers
    w: Numbers
    tau: Numbers
    mdb: Numbers
    external: Numbers
    external_at: list[str | None]
    suspicious: list[bool]
    group: Names
    state: list[Literal["active", "check", "off"]]
    source: Names
    reason: Names
    words: dict[str, Names]
    """Value, sigma, residual, mdb, external as the report prints them, with their units."""


class SceneRays(DocumentPart):
    """Pairs of positions that observations join; w : the largest size of a test value."""

    from_: Names = Field(alias="from")
    to: Names
    w: Numbers
    suspicious: list[bool]
    rows: list[list[int]]
    """Of the observations."""


class ScenePlanes(DocumentPart):
    """Planes ``normal x = offset``; where they were seen, if the run says so [m]."""

    name: Names
    normal: list[Triple]
    offset: Numbers
    centre: list[Triple | None]
    extent: list[Finite]
    """Radius about the centre."""
    axes: list[Matrix | None] = Field(default_factory=list)
    """2 x 3: unit vectors along the sides of the rectangle that holds the plane."""
    half: list[tuple[float, float] | None] = Field(default_factory=list)
    """Half the widths of that rectangle."""


class SceneTargets(DocumentPart):
    """Targets that were found in scans [m, rad]."""

    scan: Names
    number: list[int]
    kind: Names
    name: Names
    """Point of the network, "" if nothing else saw it."""
    center: list[Triple]
    """In the scanner frame."""
    xyz: list[Triple | None]
    sigma: list[Triple | None]
    """Along the axes of the scanner."""
    range: Numbers
    incidence: Numbers
    points: list[int | None]
    rms: Numbers
    coverage: Numbers
    remark: Names
    accepted: list[bool]
    picture: list[str | None]
    words: list[dict[str, str]]
    """Numbers of the fit with their units, by what they are."""


class SceneRejected(DocumentPart):
    """What looked like a target and was none."""

    scan: Names
    kind: Names
    center: list[Triple]
    xyz: list[Triple | None]
    reason: Names
    picture: list[str | None]


class SceneAttribute(DocumentPart):
    """What points can be coloured by: most of its values are between low (5 %) and high (95 %)."""

    low: float
    high: float
    unit: str
    title: str


class SceneCloud(DocumentPart):
    """A cloud in COPC."""

    name: str
    station: str
    """"" for a cloud of several stations."""
    scans: Names
    url: str
    points: int
    bounds: tuple[Triple, Triple]
    attributes: dict[str, SceneAttribute | bool]
    """``rgb`` is true or false."""
    further: bool = False
    """Given besides the clouds of the run, such as distances of a comparison."""


class SceneEpochs(DocumentPart):
    """What became of points between two epochs, in the frame of the clouds [m]."""

    first: str
    second: str
    confidence: float
    axes: list[Literal["E", "N", "U"]]
    """That were compared; along others displacements and covariances are zero."""
    name: Names
    xyz: list[Triple]
    """At the first epoch."""
    moved: list[Triple]
    covariance: list[Matrix]
    """Of the displacement."""
    test: Numbers
    limit: Numbers
    verdict: list[Literal["moved", "not moved", "cannot tell"]]
    reference: list[bool]
    detectable: Numbers
    """Found with the stated power in the hardest direction."""
    sentences: list[str]


class SceneJoint(DocumentPart):
    """The joint covariance of places that have a name, in a file beside the scene.

    It holds the lower triangle row by row, numbers of eight bytes, the last byte the highest
    [m^2]; three rows a name, along the axes of the coordinates.
    """

    names: Names
    file: str


class SceneDocument(Document):
    """What ``tribrach view`` and ``tribrach workbench`` draw."""

    title: str
    confidence: float
    """Probability of ellipsoids."""
    ellipsoid: float
    """Factor from standard deviations to the semi-axes of ellipsoids of this probability."""
    angle: Literal["gon", "deg"]
    crs: str | None
    axes: tuple[str, str, str]
    """Short names of the coordinates."""
    origin: tuple[int, int, int]
    """Near the middle; everything is drawn about it [m]."""
    frame: Matrix
    """3 x 3: axes of the coordinates to east, north, up."""
    datum: str
    covariances: Literal["prior", "posterior"]
    summary: SceneSummary
    warnings: list[str]
    points: ScenePoints
    stations: SceneStations
    observations: SceneObservations
    rays: SceneRays
    planes: ScenePlanes
    edges: list[dict[str, Any]]
    """Pairs of stations, as ``registration.edges`` of the result."""
    targets: SceneTargets
    rejected: SceneRejected
    clouds: list[SceneCloud]
    pending: list[str] = Field(default_factory=list)
    """Clouds that are being converted."""
    lacking: str = ""
    """What cannot be shown, and what to do about it; empty where nothing lacks."""
    epochs: list[SceneEpochs] = Field(default_factory=list)
    joint: SceneJoint | None = None
    """In a static folder, for the sigmas of distances."""
    comparisons: list[dict[str, Any]]
    """As in the result, without their regressions."""
    edits: list[dict[str, Any]]
    session: bool
    """Whether observations can be switched off here."""
    sigmas_of: str
    """Of which run the sigmas of the points in the clouds are."""
