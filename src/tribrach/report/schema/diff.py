"""What differs between two results."""

from __future__ import annotations

from typing import Literal

from tribrach.report.schema.base import Document, DocumentPart, Finite

__all__ = ["SCHEMA", "DiffDocument", "EditPart", "ObservationChange", "PlaceChange", "Sigma0Change"]

#: version of the layout
SCHEMA = 1


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


class Sigma0Change(DocumentPart):
    """Sigma of unit weight of both."""

    posterior: tuple[Finite, Finite]
    dof: tuple[int, int]
    accepted: tuple[bool | None, bool | None]


class PlaceChange(DocumentPart):
    """A point or station that both have."""

    name: str
    what: Literal["point", "station"]
    shift: tuple[Finite, Finite, Finite]
    """Second minus first along E, N, U [m]."""
    length: float
    """Of the shift [m]."""
    turn: Finite
    """Of a station [rad]."""
    sigma: tuple[Finite, Finite]
    """Root of the sum of the variances of the coordinates, first and second [m]."""
    difference_sigma: Finite
    """The same of the shift, at most where the covariance of both is not known; null where no
    measurement differs."""
    test: Finite
    """Squared shift in the metric of its covariance, a lower bound where that is an upper one."""
    limit: Finite
    freedom: int | None
    """Directions in which the shift can be tested; 0 where it cannot be told, null where nothing is
    tested."""
    moved: bool
    """The test is beyond its limit."""


class ObservationChange(DocumentPart):
    """An observed value that is not the same in both."""

    id: str
    component: str
    kind: str
    from_: str
    to: str
    change: Literal["only in the first", "only in the second", "state", "value", "sigma"]
    states: tuple[str, str]
    """State in both, "" where it is absent."""
    reason: str
    w: tuple[Finite, Finite]


class DiffDocument(Document):
    """What ``tribrach diff`` writes."""

    first: str
    second: str
    common: Literal["same", "nested", "disjoint", "overlapping", "model", "datum"]
    """How the measurements of both belong together."""
    sentences: list[str]
    sigma0: Sigma0Change
    places: list[PlaceChange]
    only_first: list[str]
    only_second: list[str]
    """Points and stations of one of them alone."""
    observations: list[ObservationChange]
    edits_only_first: list[EditPart]
    edits_only_second: list[EditPart]
