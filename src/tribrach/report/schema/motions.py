"""What moved between two clouds: parts as bodies, the stable area, and what cannot be compared."""

from __future__ import annotations

from tribrach.report.schema.base import DocumentPart, Matrix, Number, Triple

__all__ = ["MotionsPart"]


class ComponentsPart(DocumentPart):
    """A motion in the frame of the face; null for what the distances do not show."""

    out: Number
    """Along the normal, which looks towards the scanner of B [m]."""
    right: Number
    up: Number
    """Along the face, to the right as seen from outside and upwards (east and north of ground)."""
    tilt: Number
    """How much further out the upper (northern) end is, per metre [m/m]."""
    turn: Number
    """The same of the right (eastern) end [m/m]."""
    spin: Number
    """About the normal [rad]."""


class BodyPart(DocumentPart):
    """A motion as one body, at its middle."""

    middle: Triple
    normal: Triple
    distances: int
    left_out: int
    """Distances that do not go along with the others."""
    statistic: float
    dof: int
    """The test of the motion: chi-square with as many degrees of freedom as motions are seen."""
    components: ComponentsPart
    covariance: Matrix
    """Of the components in their order."""
    unseen: list[str]
    """Components that the distances do not show."""


class MovedPartPart(DocumentPart):
    """A part of the surface, and how it moved."""

    name: str
    verdict: str
    area: float
    """About [m^2]."""
    motion: BodyPart | None
    """Against the control of both clouds."""
    against_stable: BodyPart | None
    limit: Number
    """Of the statistic of the motion."""
    detectable: Number
    """Shift outwards that would have been found with 80 % [m]."""


class StablePart(DocumentPart):
    """The largest group of patches that keep their places among each other."""

    patches: int
    share: float
    area: float
    motion: BodyPart
    """Against the control of both clouds: what the registration is wrong by."""
    limit: float
    agrees: bool
    detectable: Number


class UncomparedPlacePart(DocumentPart):
    """Cells that lie together: middle, extent [m] and area [m^2]."""

    middle: tuple[float, float, float]
    extent: tuple[float, float, float]
    area: float


class UncomparedPart(DocumentPart):
    """Surface that is not compared for one reason."""

    words: str
    area: float
    share: float
    places: list[UncomparedPlacePart]


class ComparedPart(DocumentPart):
    """Surface that is compared."""

    area: float
    share: float


class MotionsPart(DocumentPart):
    """What moved between two clouds."""

    parts: list[MovedPartPart]
    sites: bool
    """True if the parts are the sites that were given, else they were found."""
    stable: StablePart | None
    patches: int
    loose: float
    """Share of the surface in patches that is neither stable nor in a part."""
    factor: float
    """Variance factor of the points, one at least."""
    compared: ComparedPart
    not_compared: list[UncomparedPart]
    given_alike: list[str]
    """Given values that both registrations rest on."""
    one_result: bool
    sentences: list[str]
