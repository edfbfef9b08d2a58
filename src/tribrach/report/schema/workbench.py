"""What the workbench needs beside the result: schema 1 of ``workbench.json``."""

from __future__ import annotations

from typing import Literal

from tribrach.report.schema.base import Document, DocumentPart, Matrix

__all__ = ["SCHEMA", "WorkbenchDocument"]

#: version of the layout
SCHEMA = 1


class MapPart(DocumentPart):
    """A change of coordinates over a box, as cubic polynomials: exact to 0.1 mm in it.

    A mapped point is ``origin`` and the sum of ``cubic`` times the products of powers of the
    coordinates, which go from -1 to 1 over the box; exponents (i, j, k) with i + j + k of 3 at
    most, k fastest, then j.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    origin: tuple[float, float, float]
    cubic: Matrix
    """20 x 3."""


class FramePart(DocumentPart):
    """The frame of the clouds and its way to others."""

    kind: Literal["work", "projected", "ecef"]
    crs: str | None
    epoch: float | None
    axes: tuple[str, str, str]
    upright: Matrix
    """3 x 3: axes of the coordinates to east, north, up."""
    names: dict[str, str]
    """Of the frames, as a person reads them: work, projected, geodetic, ecef."""
    from_work: MapPart | None
    """From the work frame; null where they are the same."""
    maps: dict[str, MapPart]
    """To the other frames; latitude and longitude are times ``radius``."""
    radius: float
    """[m]"""


class SeenPlanePart(DocumentPart):
    """Where a plane was seen, in the work frame [m]."""

    centre: tuple[float, float, float]
    extent: float
    """Radius about the centre that holds it."""
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    """Unit vectors along the sides of the rectangle that holds it; results of earlier versions
    have none."""
    half: tuple[float, float] | None = None
    """Half the widths of that rectangle along its axes."""


class JointPart(DocumentPart):
    """Rows of ``workbench_covariance.npy``: of the points, three each, along the clouds' axes.

    Its columns are the rows of ``poses_covariance.npy`` of the clouds, then those of the points.
    """

    points: list[str]
    file: str
    shared: int
    """Rows of the joint covariance of the poses."""


class WorkbenchDocument(Document):
    """What ``tribrach run`` leaves for ``tribrach view`` beside ``result.json``."""

    date: str
    confidence: float
    angle: Literal["gon", "deg"]
    frame: FramePart | None
    """Null where no clouds were placed."""
    planes: dict[str, SeenPlanePart]
    pictures: dict[str, dict[str, str]]
    """By scan and number the picture of a target; rejected candidates have numbers below zero."""
    shares: dict[str, dict[str, Matrix]]
    """Covariance (6 x 6) of a station by what it comes from, along the clouds' axes."""
    joint: JointPart | None
