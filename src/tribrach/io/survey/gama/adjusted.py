"""Results of GNU Gama (``gama-local-adjustment``) as control with its whole covariance.

The adjusted coordinates of one epoch are control of another job, or one of the two epochs of a
deformation. Fixed points stay held, adjusted ones are weighted by the covariance matrix of the
file, which has the coordinates in the order in which they are listed [mm^2] and the orientations
behind them, scaled as the file says. The covariance of a free network is singular and holds in its
own datum only: as control such a file is refused, as an epoch (:func:`adjusted_coordinates`) it
is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.io.survey.gama.axes import AXES, Axes
from tribrach.io.survey.gama.element import Element, checked
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinate
from tribrach.units import MM


@dataclass(frozen=True, eq=False)
class AdjustedCoordinates:
    """The coordinates of a result."""

    #: of each of the k adjusted coordinates: point, 0 to 2 for E, N, U, value [m], place
    names: list[str]
    axis: NDArray[np.int64]
    values: Array
    sources: list[str]
    covariance: Array  #: (k, k), of all of them [m^2], scaled as the file says
    #: points that are held with their coordinates (3,) [m], NaN where not given
    fixed: dict[str, Array]
    #: redundancy, and the a-posteriori variance factor over the a-priori one; 0 and NaN where the
    #: file does not say it
    dof: int
    factor: float
    used: str  #: ``apriori`` or ``aposteriori``, what the covariance is scaled by
    element: Element  #: of the matrix


def read_adjusted(root: Element) -> Survey:
    """The survey of a file with adjusted coordinates."""
    general = _child(root, "network-general-parameters")
    axes = Axes(general.choice("axes-xy", AXES, "ne"))
    coordinates = _child(root, "coordinates")
    survey = Survey()
    description = [c for c in root.children() if c.tag == "description"]
    survey.title = " ".join(" ".join("".join(d.node.itertext()).split()) for d in description)
    for element, name, xyz in _points(coordinates, "fixed"):
        world = axes.world_from_file(xyz)
        with element.refused.record():
            _add_point(survey, element, name, world, held=np.isfinite(world))
    _weighted(survey, axes, coordinates)
    return survey


def _weighted(survey: Survey, axes: Axes, coordinates: Element) -> None:
    """Adjusted points with their covariance; the matrix has further rows for orientations."""
    found = _coordinates(survey, axes, coordinates)
    names, values, sources = found.names, found.values, found.sources
    matrix, element = found.covariance, found.element
    positive = bool((np.diag(matrix) > 0).all())
    scale = np.sqrt(np.diag(matrix)) if positive else np.ones(len(matrix))
    if not positive or np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] < 1e-9:
        raise element.error(
            "the covariance matrix of the adjusted coordinates is singular, as that of a free "
            "network is: it holds in the datum of that network only",
            "adjust the network with fixed points, or give coordinates with sigmas as CSV",
        )
    table = checked(
        element,
        lambda: survey.add(
            Coordinate,
            values=values,
            sigma=scale,
            position=names,
            axis=found.axis,
            source=sources,
            group="control",
        ),
    )
    rows = np.arange(len(names))
    checked(
        element,
        lambda: survey.correlate(
            np.full(len(rows), table), rows, np.zeros(len(rows)), matrix, element.source
        ),
    )


def adjusted_coordinates(root: Element) -> AdjustedCoordinates:
    """The coordinates of a result with their covariance, singular or not."""
    general = _child(root, "network-general-parameters")
    axes = Axes(general.choice("axes-xy", AXES, "ne"))
    coordinates = _child(root, "coordinates")
    return _coordinates(Survey(), axes, coordinates, root)


def _coordinates(
    survey: Survey, axes: Axes, coordinates: Element, root: Element | None = None
) -> AdjustedCoordinates:
    """Adjusted points, which come into the survey, with their covariance."""
    names: list[str] = []
    values: list[float] = []
    axis: list[int] = []
    sign: list[float] = []
    sources: list[str] = []
    to = np.argmax(np.abs(axes.matrix()), axis=0)
    signs = axes.matrix()[to, np.arange(3)]
    for element, name, xyz in _points(coordinates, "adjusted"):
        with element.refused.record():
            _add_point(survey, element, name, axes.world_from_file(xyz), held=None)
        for k in np.flatnonzero(np.isfinite(xyz)).tolist():
            names.append(name)
            axis.append(int(to[k]))
            sign.append(float(signs[k]))
            values.append(float(signs[k] * xyz[k]))
            sources.append(element.source)
    if not names:
        raise coordinates.error("there are no adjusted coordinates", "give a result with them")
    coordinates.refused.settle()
    matrix, element = _matrix(coordinates, len(names))
    fixed = {}
    if root is not None:
        fixed = {name: axes.world_from_file(xyz) for _, name, xyz in _points(coordinates, "fixed")}
    dof, factor, used = (0, float("nan"), "apriori") if root is None else _precision(root)
    return AdjustedCoordinates(
        names,
        np.array(axis, dtype=np.int64),
        np.array(values),
        sources,
        matrix * np.outer(sign, sign) * MM**2,
        fixed,
        dof,
        factor,
        used,
        element,
    )


def _precision(root: Element) -> tuple[int, float, str]:
    """Redundancy, variance factor, and what covariances are scaled by, where the file says it."""
    words: dict[str, str] = {}
    for node in root.node.iter():
        if isinstance(node.tag, str) and node.text:
            words.setdefault(node.tag.rpartition("}")[2], node.text.strip())
    try:
        dof = int(words["degrees-of-freedom"])
        factor = (float(words["aposteriori"]) / float(words["apriori"])) ** 2
    except (KeyError, ValueError, ZeroDivisionError):
        return 0, float("nan"), words.get("used", "apriori")
    return max(dof, 0), factor, words.get("used", "apriori")


def _add_point(
    survey: Survey, element: Element, name: str, world: Array, held: NDArray[np.bool_] | None
) -> None:
    """A point with its free coordinates; those that the file does not have stay open."""
    free = np.ones(3, dtype=bool) if held is None else ~held
    checked(
        element,
        lambda: survey.point(name, world, free=free, role="control", source=element.source),
    )


def _points(coordinates: Element, group: str) -> Iterator[tuple[Element, str, Array]]:
    """Points of a group: element, name and x, y, z (3,) [m], NaN where not given."""
    groups = [child for child in coordinates.children() if child.tag == group]
    for parent in groups:
        for element in parent.children(("point",)):
            with element.refused.record():
                # capitals mark constrained coordinates
                texts = {child.tag.lower(): child for child in element.children()}
                name = (texts["id"].node.text or "").strip() if "id" in texts else ""
                if not name:
                    raise element.error("a point has no <id>")
                xyz = np.full(3, np.nan)
                for k, letter in enumerate("xyz"):
                    if letter in texts:
                        xyz[k] = element.as_number(letter, texts[letter].node.text or "")
                yield element, name, xyz


def _matrix(coordinates: Element, count: int) -> tuple[Array, Element]:
    """The covariance (count, count) of the coordinates as written, and its element."""
    element = _child(coordinates, "cov-mat")
    whole = {child.tag: child for child in element.children() if child.tag in ("dim", "band")}
    dim, band = (
        int(element.as_number(tag, (whole[tag].node.text or "") if tag in whole else ""))
        for tag in ("dim", "band")
    )
    numbers = [
        element.as_number("an element", child.node.text or "")
        for child in element.children()
        if child.tag == "flt"
    ]
    if dim < count or not 0 <= band < max(dim, 1):
        raise element.error(
            f"the covariance matrix has dimension {dim} and band {band} for {count} coordinates"
        )
    expected = dim * (band + 1) - band * (band + 1) // 2
    if len(numbers) != expected:
        raise element.error(
            f"the covariance matrix has {len(numbers)} elements instead of {expected}"
        )
    if band < count - 1:
        raise element.error(
            f"the covariance matrix has only {band} bands of {count - 1}",
            "let gama-local write it whole (cov-band -1)",
        )
    first = np.cumsum([0, *(min(band, dim - 1 - i) + 1 for i in range(dim))])
    matrix = np.zeros((count, count))
    for i in range(count):
        matrix[i, i:] = matrix[i:, i] = numbers[first[i] : first[i] + count - i]
    return matrix, element


def _child(parent: Element, tag: str) -> Element:
    """The one child of a name."""
    found = [child for child in parent.children() if child.tag == tag]
    if len(found) != 1:
        raise parent.error(f"<{parent.tag}> has {len(found)} elements <{tag}>", "give one")
    return found[0]
