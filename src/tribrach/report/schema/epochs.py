"""Epochs: coordinates with their joint covariance."""

from __future__ import annotations

from typing import Literal

from tribrach.report.schema.base import Document, DocumentPart, Number

__all__ = ["EpochDocument"]


class EpochSitePart(DocumentPart):
    """Where the frame of an epoch lies [rad, m]."""

    latitude: float
    longitude: float
    ellipsoidal_height: float
    ellipsoid: list[float]


class EpochDocument(Document):
    """What ``tribrach adjust --epoch`` writes, for ``tribrach epochs``."""

    kind: Literal["epoch"]
    label: str
    datum: str
    site: EpochSitePart | None
    names: list[str]
    xyz: list[list[Number]]
    """E, N, U [m]; null where the network has no such coordinate."""
    covariance: list[list[float]]
    """Of all coordinates, a priori: rows of the lower triangle [m^2]."""
    motions: list[str]
    """Motions of the whole that the observations leave open."""
    dof: int
    variance_factor: Number
