"""The points of a GNU Gama file: which coordinates are given, fixed, adjusted or constrained.

``fix`` names coordinates held as they are, ``adj`` those to be determined; capitals in ``adj`` mark
*constrained* coordinates, which carry the inner constraints of a free network. Where both name a
coordinate, ``fix`` counts. A coordinate that neither names is not part of the network.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import isnan

import numpy as np
from numpy.typing import NDArray

from tribrach.io.survey.gama.axes import Axes
from tribrach.io.survey.gama.element import Element

_ROLES = ("", "xy", "XY", "z", "Z", "xyz", "XYZ", "xyZ", "XYz")


@dataclass(frozen=True)
class GamaPoint:
    """A point as the file has it."""

    #: where it is defined
    element: Element
    #: of the point
    name: str
    #: (3,), coordinates in the file's axes [m], NaN where not given
    xyz: NDArray[np.float64]
    #: letters of the coordinates
    fixed: str
    adjusted: str

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which of x, y, z (3,) are part of the network."""
        return _masks(self.fixed, self.adjusted)[0]

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of x, y, z (3,) are to be determined."""
        return _masks(self.fixed, self.adjusted)[1]

    @property
    def constrained(self) -> NDArray[np.bool_]:
        """Which of x, y, z (3,) carry inner constraints."""
        return _masks(self.fixed, self.adjusted)[2]

    def world(self, axes: Axes) -> NDArray[np.float64]:
        """E, N, U (3,) [m]; zero if not part of the network, NaN if part of it and not given."""
        return axes.world_from_file(np.where(self.used, self.xyz, 0.0))


@cache
def _masks(fixed: str, adjusted: str) -> tuple[NDArray[np.bool_], ...]:
    """Which of x, y, z (3,) are used, free and constrained: there are few combinations."""
    used = np.array([axis in (fixed + adjusted).lower() for axis in "xyz"])
    free = used & [axis not in fixed.lower() for axis in "xyz"]
    masks = used, free, free & [axis in adjusted for axis in "XYZ"]
    for mask in masks:
        mask.flags.writeable = False
    return masks


def read_points(sections: list[Element]) -> dict[str, GamaPoint]:
    """Points by name.

    They come from ``<point>`` elements that define one, and from observed coordinates. The role may
    stand with the point's definition or with its observed coordinates, whose values serve as start
    values of a point without any.

    Refused are a name that occurs twice, a role that does not exist, coordinates that are missing
    or not numbers.
    """
    points: dict[str, GamaPoint] = {}
    for section in sections:
        for element in section.named("point"):
            with element.refused.record():
                _define(points, element)
    for section in sections:
        for element in section.named("coordinates"):
            for child in element.named("point"):
                with child.refused.record():
                    _with_observed(points, _record(child))
    for record in points.values():
        with record.element.refused.record():
            _complete(record)
    return points


def _define(points: dict[str, GamaPoint], element: Element) -> None:
    """Add the point that an element defines."""
    name = element.text("id")
    first = points.get(name)
    if first is None:
        # also where the rest of it is refused: observations of it are none the less of a point
        points[name] = GamaPoint(element, name, np.full(3, np.nan), "", "")
    record = _record(element)
    if first is not None:
        raise element.error(
            f"point {name} is defined twice (first at {first.element.source})",
            "keep one definition",
        )
    points[name] = record


def _record(element: Element) -> GamaPoint:
    xyz = np.array([element.number(axis, np.nan) for axis in "xyz"])
    if element.has("x") != element.has("y"):
        raise element.error("x and y must be given together", "give both or none")
    fixed = element.choice("fix", _ROLES, "")
    adjusted = element.choice("adj", _ROLES, "")
    return GamaPoint(element, element.text("id"), xyz, fixed, adjusted)


def _with_observed(points: dict[str, GamaPoint], observed: GamaPoint) -> None:
    """Add to the points what their observed coordinates say about them."""
    known = points.get(observed.name)
    if known is None:
        if observed.used.any():
            points[observed.name] = observed
        return
    role = known if known.used.any() else observed
    points[observed.name] = replace(
        known,
        xyz=np.where(np.isnan(known.xyz), observed.xyz, known.xyz),
        fixed=role.fixed,
        adjusted=role.adjusted,
    )


def _complete(record: GamaPoint) -> None:
    """Refuse a point that is fixed without a coordinate."""
    for axis, value in zip("xyz", record.xyz.tolist(), strict=True):
        if axis in record.fixed.lower() and isnan(value):
            raise record.element.error(
                f"point {record.name} is fixed without {axis}", f"give {axis}"
            )
