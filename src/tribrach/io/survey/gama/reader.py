"""GNU Gama local networks (``.gkf``): all observation kinds, covariance matrices and axes.

The file's x and y become E and N by the letters of ``axes-xy``; horizontal angles and azimuths
that run counter-clockwise (``angles="right-handed"``) change sign. Angles are gon, or degrees
written ``D-M-S``; standard deviations are mm and cc (or arc seconds with degrees). Format:
GNU Gama manual, "XML input data format for gama-local".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import isnan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError, RefusalCollector
from tribrach.io import xml_file
from tribrach.io.survey.gama.adjusted import read_adjusted
from tribrach.io.survey.gama.axes import AXES, HANDS, Axes
from tribrach.io.survey.gama.element import NAMESPACE, Element, checked
from tribrach.io.survey.gama.observations import ObservationReader
from tribrach.network.facts import Fact
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.sights import face_two_words

# ``fix`` names coordinates held as they are, ``adj`` those to be determined; capitals in ``adj``
# mark *constrained* coordinates, which carry the inner constraints of a free network. Where both
# name a coordinate, ``fix`` counts. A coordinate that neither names is not part of the network.

_ROLES = ("", "xy", "XY", "z", "Z", "xyz", "XYZ", "xyZ", "XYz")


@dataclass(frozen=True)
class GamaPoint:
    """A point as the file has it."""

    element: Element  #: where it is defined
    name: str  #: of the point
    xyz: NDArray[np.float64]  #: (3,), coordinates in the file's axes [m], NaN where not given
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


#: older files leave the namespace out
ROOTS = (NAMESPACE + "gama-local", "gama-local")
#: of a result; those of version 1 have no namespace
ADJUSTED = (
    "{http://www.gnu.org/software/gama/gama-local-adjustment}gama-local-adjustment",
    "gama-local-adjustment",
)


#: observations that a sentence names
_NAMED = 20

#: attributes of <parameters> that say how to compute or print, not what
INDIFFERENT = (
    "tol-abs",
    "update-constrained-coordinates",
    "algorithm",
    "language",
    "encoding",
    "angles",
    "cov-band",
    "iterations",
)


def read(path: Path, label: str = "") -> Survey:
    """Survey of a ``.gkf`` file with :class:`GamaFacts`, or a result's coordinates as control."""
    path = Path(path)
    with RefusalCollector() as refused:
        root = Element(xml_file.load(path, *ROOTS, *ADJUSTED), path, label, refused)
        if root.node.tag in ADJUSTED:
            survey = read_adjusted(root)
            refused.settle()
            return survey
        networks = list(root.children(("network",)))
        if len(networks) != 1:
            raise root.error(f"there are {len(networks)} <network> elements", "give one")
        survey = _Reader(networks[0]).survey
    return survey


@dataclass(frozen=True)
class GamaFacts(Fact):
    """What a file of GNU Gama says about its results."""

    axes: Axes  #: axes of the file, for results in its own x and y
    #: ``apriori`` or ``aposteriori``: the sigma0 that covariances are scaled with
    sigma_act: str = "aposteriori"
    confidence: float = 0.95  #: confidence level of its intervals


class _Reader:
    """Walks the file and fills the survey."""

    def __init__(self, network: Element) -> None:
        self.axes = Axes(network.choice("axes-xy", AXES, "ne"))
        hand = HANDS[network.choice("angles", HANDS, "left-handed")]
        self.survey = Survey(sigma0=10.0, leaves_out_unplaced=True)
        self.facts = GamaFacts(self.axes)
        parts = list(network.children(("description", "parameters", "points-observations")))
        for part in parts:
            if part.tag == "description":
                self.survey.title = " ".join("".join(part.node.itertext()).split())
            elif part.tag == "parameters":
                with part.refused.record():
                    self._parameters(part)
        self.survey.facts = (self.facts,)
        sections = [part for part in parts if part.tag == "points-observations"]
        if not sections:
            raise network.error("there is no <points-observations>", "add points and observations")
        self.points = read_points(sections)
        used = {name: self._point(record) for name, record in self.points.items()}
        self.observations = ObservationReader(self.survey, self.axes, hand, used)
        for section in sections:
            self.observations.section(section)
        self.observations.finish(network.refused, network.path)
        if self.observations.undefined and not self.survey.tables():
            raise InputError(
                "all that is observed is of points that the file does not define "
                f"({', '.join(list(self.observations.undefined)[:_NAMED])})",
                file=network.path,
                cure='define each of them, as <point id="P" adj="xy"/>',
            )
        self._say_undefined()
        self._say_off()
        if turned := self.observations.face_two:
            self.survey.warnings.append(face_two_words(turned))
        self._choose_datum()

    def _parameters(self, element: Element) -> None:
        self.survey.sigma0 = element.positive("sigma-apr", self.survey.sigma0)
        words = ("apriori", "aposteriori")
        sigma_act = element.choice("sigma-act", words, self.facts.sigma_act)
        confidence = element.positive("conf-pr", self.facts.confidence)
        if confidence >= 1:
            raise element.error(f"conf-pr is {confidence:g}", "give it below one")
        self.facts = GamaFacts(self.axes, sigma_act, confidence)
        for name in element.node.attrib:
            if name in ("latitude", "ellipsoid"):
                self.survey.warnings.append(
                    f"{element.source}: {name} is given, but the network is adjusted on a plane "
                    "with parallel verticals; angles are not reduced."
                )
            elif name not in ("sigma-apr", "sigma-act", "conf-pr", *INDIFFERENT):
                self.survey.warnings.append(f"{element.source}: {name} has no effect.")

    def _point(self, record: GamaPoint) -> NDArray[np.bool_]:
        """Add a point; (3,) E, N, U that are part of the network."""
        swap = np.abs(self.axes.matrix()) > 0.5
        constrained = swap @ record.constrained
        checked(
            record.element,
            lambda: self.survey.point(
                record.name,
                record.world(self.axes),
                free=swap @ record.free,
                role="control" if record.fixed else "free",
                datum=constrained if constrained.any() else None,
                source=record.element.source,
            ),
        )
        used: NDArray[np.bool_] = swap @ record.used
        return used

    def _say_undefined(self) -> None:
        for name, sources in self.observations.undefined.items():
            listed = ", ".join(sources[:_NAMED])
            more = f" and {len(sources) - _NAMED} more" if len(sources) > _NAMED else ""
            one = len(sources) == 1
            self.survey.warnings.append(
                f"Point {name} is not defined: the observation{'' if one else 's'} of it "
                f"{'is' if one else 'are'} left out ({listed}{more})."
            )

    def _say_off(self) -> None:
        off = self.observations.off
        if off:
            more = f" and {len(off) - _NAMED} more" if len(off) > _NAMED else ""
            listed = ", ".join(off[:_NAMED]) + more
            one = len(off) == 1
            self.survey.warnings.append(
                f"{len(off)} observation{' is' if one else 's are'} off because a coordinate "
                f"that {'it needs' if one else 'they need'} is neither fixed nor adjusted "
                f"({listed})."
            )

    def _choose_datum(self) -> None:
        """Constrained coordinates carry inner constraints; all points if there is no control."""
        records = self.points.values()
        held = self.observations.controls or any(record.fixed for record in records)
        if any(record.constrained.any() for record in records):
            self.survey.datum = Datum("free")
        elif not held:
            self.survey.datum = Datum("free")
            self.survey.warnings.append(
                "No coordinate is fixed, observed or constrained: all points carry the datum."
            )
