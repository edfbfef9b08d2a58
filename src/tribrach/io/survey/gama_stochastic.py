"""How well were the observations of a GNU Gama file measured?

By the observation's own ``stdev``, by a default of its section, or by the covariance matrix of
its cluster (upper band by rows). Written in mm and cc, or arc seconds where the angle is in
degrees; here metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribrach.io.survey.gama_element import Element

__all__ = ["Cluster", "distance_sigma", "observation_sigma"]

_DEFAULTS = {
    "direction": "direction-stdev",
    "angle": "angle-stdev",
    "azimuth": "azimuth-stdev",
    "z-angle": "zenith-angle-stdev",
}


def distance_sigma(section: Element, metres: float) -> float | None:
    """Default ``a + b D^c`` [mm] of a distance, D in km; ``b`` is 0 and ``c`` 1 if not given."""
    if not section.has("distance-stdev"):
        return None
    words = section.text("distance-stdev").split()
    if len(words) > 3:
        raise section.error("distance-stdev has more than three numbers", "give a, b and c")
    numbers = [section.as_number("distance-stdev", word) for word in words]
    a, b, c = (*numbers, *(0.0, 0.0, 1.0)[len(numbers) :])
    return float(a + b * (metres / 1000) ** c)


def observation_sigma(element: Element, section: Element) -> float:
    """Standard deviation of a sight as written (mm, cc or arc seconds).

    Raises
    ------
    InputError : neither the observation nor its section gives one, or it is not above zero.
    """
    default = None
    if element.tag in _DEFAULTS and section.has(_DEFAULTS[element.tag]):
        default = section.number(_DEFAULTS[element.tag])
    elif element.tag in ("distance", "s-distance"):
        default = distance_sigma(section, element.number("val"))
    if default is None and not element.has("stdev"):
        raise element.error(f"<{element.tag}> has no standard deviation", "add stdev")
    return element.positive("stdev", default)


@dataclass
class Cluster:
    """Observations of one ``<obs>`` or list, which share a covariance matrix if there is one.

    table, row: of each value as :meth:`Survey.correlate` takes them; unit: of its standard
    deviation [m or rad], negative where the file's axis or angle runs against ours.
    """

    element: Element
    table: list[int] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    unit: list[float] = field(default_factory=list)

    @cached_property
    def matrix_element(self) -> Element | None:
        """The cluster's ``<cov-mat>``.

        Raises
        ------
        InputError : there are two.
        """
        found = [child for child in self.element.children() if child.tag == "cov-mat"]
        if len(found) > 1:
            raise found[1].error("a second covariance matrix", "keep one")
        return found[0] if found else None

    def take(self, table: int, rows: int, unit: float) -> None:
        """Note the values of one observation."""
        self.table += [table] * rows
        self.row += list(range(rows))
        self.unit += [unit] * rows

    def covariance(self, element: Element) -> NDArray[np.float64]:
        """Covariance matrix (k, k) [m^2, rad^2] of the values in the file's axes.

        Raises
        ------
        InputError : dimension, band or number of elements do not fit.
        """
        unit = np.array(self.unit)
        return band_matrix(element, len(unit)) * np.outer(unit, unit)


def band_matrix(element: Element, size: int) -> NDArray[np.float64]:
    """Symmetric matrix (size, size) of a ``<cov-mat dim band>``.

    Raises
    ------
    InputError : dimension, band or number of elements do not fit.
    """
    dim, band = _whole(element, "dim"), _whole(element, "band")
    if dim != size:
        raise element.error(
            f"the covariance matrix has dimension {dim} for {size} values", "correct dim"
        )
    numbers = [element.as_number("an element", w) for w in (element.node.text or "").split()]
    upper = [(i, j) for i in range(dim) for j in range(i, min(i + band, dim - 1) + 1)]
    if len(numbers) != len(upper):
        raise element.error(
            f"the covariance matrix has {len(numbers)} elements instead of {len(upper)}",
            "give the upper band by rows",
        )
    matrix = np.zeros((dim, dim))
    row, column = np.array(upper, dtype=int).reshape(-1, 2).T
    matrix[row, column] = matrix[column, row] = numbers
    return matrix


def _whole(element: Element, name: str) -> int:
    value = element.number(name)
    if value != int(value) or value < 0:
        raise element.error(f"{name} is {value:g}", "give a whole number")
    return int(value)
