"""What the page is drawn from: the scene, schema 1. Tables are columns, names are keys.

Coordinates are those of the delivered clouds, absolute, so that a cloud and a point of the network
lie where they belong without any conversion; ``frame`` turns their axes into east, north, up. What
a person reads with its unit is in words here, so that page and report write it alike.
"""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from types import GenericAlias
from typing import Any, Literal, get_type_hints

from tribrach.answers import Form, Number, Result, written
from tribrach.network.observation_rows import ObservationRow

Names = list[str]
Triple = tuple[Number, Number, Number]
Matrix = list[list[Number]]


@dataclass(frozen=True, kw_only=True)
class ScenePoints(Result):
    """Points of the network."""

    name: Names
    role: list[Literal["control", "check", "free"]]
    xyz: list[Triple]
    covariance: list[Matrix]
    #: coordinates as they are read by a person, by the name of the frame
    frames: dict[str, list[list[str] | None]]


@dataclass(frozen=True, kw_only=True)
class SceneStations(Result):
    """Scanner stations, and set-ups on points."""

    name: Names
    kind: list[Literal["scanner", "set-up"]]
    pose: list[Matrix | None]  #: world from scanner, 4 x 4
    #: by which the clouds were placed, 4 x 4; what a session moves carries them along
    pose_of_clouds: list[Matrix | None] = field(default_factory=list)
    xyz: list[Triple | None]
    #: 6 x 6 of the translation [m] and of left rotation increments [rad]
    covariance: list[Matrix | None]
    clouds: list[Names]


_ROW: dict[str, Any] = get_type_hints(ObservationRow, include_extras=True)
_ROW |= {"external_at": str | None, "title": str}
_COLUMNS = {*written(ObservationRow), "title"} - {"block_test"}
#: observed values in columns: those of the rows of an adjustment, and what a person reads, such as
#: the title of kind and component, and in words value, sigma, residual, mdb, external with units
SceneObservations = make_dataclass(
    "SceneObservations",
    [
        *((n, GenericAlias(list, _ROW[n])) for n in _ROW if n in _COLUMNS),
        ("words", dict[str, Names]),
    ],
    bases=(Result,),
    namespace={"__doc__": "Observed values in columns.", "_keys": written(ObservationRow)},
    frozen=True,
)


@dataclass(frozen=True, kw_only=True)
class SceneRays(Result):
    """Pairs of positions that observations join; w : the largest size of a test value."""

    from_: Names
    to: Names
    w: list[Number]
    suspicious: list[bool]
    rows: list[list[int]]  #: of the observations


@dataclass(frozen=True, kw_only=True)
class ScenePlanes(Result):
    """Planes ``normal x = offset``; where they were seen, if the run says so [m]."""

    name: Names
    normal: list[Triple]
    offset: list[Number]
    centre: list[Triple | None]
    extent: list[Number]  #: radius about the centre
    #: 2 x 3: unit vectors along the sides of the rectangle that holds the plane
    axes: list[Matrix | None] = field(default_factory=list)
    #: half the widths of that rectangle
    half: list[tuple[float, float] | None] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class SceneTargets(Result):
    """Targets that were found in scans [m, rad]."""

    scan: Names
    number: list[int]
    kind: Names
    name: Names  #: point of the network, "" if nothing else saw it
    #: in the scanner frame
    center: list[Triple]
    xyz: list[Triple | None]
    #: along the axes of the scanner
    sigma: list[Triple | None]
    range: list[Number]
    incidence: list[Number]
    points: list[int | None]
    rms: list[Number]
    coverage: list[Number]
    remark: Names
    accepted: list[bool]
    picture: list[str | None]
    words: list[dict[str, str]]  #: numbers of the fit with their units, by what they are


@dataclass(frozen=True, kw_only=True)
class SceneRejected(Result):
    """What looked like a target and was none."""

    scan: Names
    kind: Names
    center: list[Triple]
    xyz: list[Triple | None]
    reason: Names
    picture: list[str | None]


@dataclass(frozen=True, kw_only=True)
class SceneAttribute(Result):
    """What points can be coloured by: most of its values are between low (5 %) and high (95 %)."""

    low: float
    high: float
    unit: str
    title: str


@dataclass(frozen=True, kw_only=True)
class SceneCloud(Result):
    """A cloud in COPC."""

    name: str
    #: "" for a cloud of several stations
    station: str
    scans: Names
    url: str
    points: int
    bounds: tuple[Triple, Triple]
    attributes: dict[str, SceneAttribute | bool]  #: ``rgb`` is true or false
    further: bool = False  #: given besides the clouds of the run, such as distances of a comparison


@dataclass(frozen=True, kw_only=True)
class SceneEpochs(Result):
    """What became of points between two epochs, in the frame of the clouds [m]."""

    first: str
    second: str
    confidence: float
    #: that were compared; along others displacements and covariances are zero
    axes: list[Literal["E", "N", "U"]]
    name: Names
    #: at the first epoch
    xyz: list[Triple]
    moved: list[Triple]
    #: of the displacement
    covariance: list[Matrix]
    test: list[Number]
    limit: list[Number]
    verdict: list[Literal["moved", "not moved", "cannot tell"]]
    reference: list[bool]
    #: found with the stated power in the hardest direction
    detectable: list[Number]
    sentences: list[str]


@dataclass(frozen=True, kw_only=True)
class SceneJoint(Result):
    """The joint covariance of places that have a name, in a file beside the scene.

    It holds the lower triangle row by row, numbers of eight bytes, the last byte the highest
    [m^2]; three rows a name, along the axes of the coordinates.
    """

    names: Names
    file: str


@dataclass(frozen=True, kw_only=True)
class SceneDocument(Result, maybe=("joint",)):
    """What ``tribrach view`` and ``tribrach workbench`` draw."""

    title: str
    confidence: float  #: probability of ellipsoids
    #: factor from standard deviations to the semi-axes of ellipsoids of this probability
    ellipsoid: float
    angle: Literal["gon", "deg"]
    crs: str | None
    axes: tuple[str, str, str]  #: short names of the coordinates
    origin: tuple[int, int, int]  #: near the middle; everything is drawn about it [m]
    #: 3 x 3: axes of the coordinates to east, north, up
    frame: Matrix
    datum: str
    covariances: Literal["prior", "posterior"]
    #: with the verdict of the global test in words
    summary: dict[str, Any]
    warnings: list[str]
    points: ScenePoints
    stations: SceneStations
    observations: SceneObservations  # type: ignore[valid-type]
    rays: SceneRays
    planes: ScenePlanes
    #: pairs of stations, as ``registration.edges`` of the result
    edges: list[dict[str, Any]]
    targets: SceneTargets
    rejected: SceneRejected
    clouds: list[SceneCloud]
    pending: list[str] = field(default_factory=list)  #: clouds that are being converted
    #: what cannot be shown, and what to do about it; empty where nothing lacks
    lacking: str = ""
    epochs: list[SceneEpochs] = field(default_factory=list)
    joint: SceneJoint | None = None  #: in a static folder, for the sigmas of distances
    #: as in the result, without their regressions
    comparisons: list[dict[str, Any]]
    edits: list[dict[str, Any]]
    session: bool  #: whether observations can be switched off here
    sigmas_of: str  #: of which run the sigmas of the points in the clouds are


FORM = Form("scene", SceneDocument, 1, quick=True)
