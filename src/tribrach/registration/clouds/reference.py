"""Prepares what scans are placed on: an earlier or airborne cloud, a model, terrain.

A reference has surfels as a scan has, and no scanner: it contradicts nothing by what was seen
through, and either side of its surfaces may be seen. It is one more set-up of the network, turned
as its file says; its place is known up to an offset that all of it shares (method section 2.16).
Frame of the reference, metres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.geometry.pose import Pose
from tribrach.geometry.triangle_tree import TriangleTree
from tribrach.geometry.triangles import covering_pieces
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.registration.clouds.fine import Indexed, matched
from tribrach.registration.clouds.pair import ApproximateSigma, CloudPair, PairFit, register_pair
from tribrach.registration.clouds.prepared import ASKEW, PreparedScan, RangeView, upright
from tribrach.registration.clouds.prepared import GATES as PREPARED
from tribrach.registration.clouds.relative_covariance import at_origin, pieces
from tribrach.registration.clouds.surfels import CellSum, Surfels, coarser
from tribrach.sentences import Sentence
from tribrach.statistics import chi2


@dataclass(frozen=True)
class ReferenceGates:
    """How surfels of references are made, and what of a scan lies on them.

    Chosen by hand with test_reference.
    """

    #: points in a cube that holds any, on the average, and the largest edge for that [m]
    cube_points: float = 8.0
    largest_m: float = 1.0
    #: samples of a model to a cube, along an edge, and cubes at most
    samples: float = 3.0
    cubes: int = 400_000
    piece_m: float = 10.0  #: edge of the pieces that are wrong each for itself [m]
    #: surfaces of the scan that are nearer to the reference are compared with it [m]
    beside_m: float = 0.5
    #: what scans among each other say of their places to the reference: at least [m], [rad]
    chained: tuple[float, float] = (0.05, float(np.radians(0.2)))
    #: an offset is tested where others tell it by this share of its variance at least
    told_share: float = 1e-3
    alpha: float = 0.001  #: probability that a good reference is said not to fit


GATES = ReferenceGates()


@dataclass(frozen=True, eq=False)
class ReferencePlace:
    """Where a reference lies."""

    name: str  #: unique among scans
    origin: Array  #: (3,), of its surfels, in the frame of the network [m]
    shared: float = 0.0  #: what all of it is wrong by along each axis [m]; 0 holds it

    def observe(self, survey: Survey) -> None:
        """Add it to a survey: turned as it is, at its place up to its offset."""
        free = np.repeat([self.shared > 0, False], 3)
        survey.station(self.name, translation=self.origin, rotation=np.eye(3), free=free)
        if self.shared > 0:
            survey.add(
                Coordinates,
                values=[self.origin],
                sigma=self.shared,
                position=[self.name],
                source=[f"reference {self.name}"],
            )


@dataclass(frozen=True, eq=False)
class ScanReference:
    """A reference that is ready to be matched."""

    scan: PreparedScan  #: its surfels, about the origin of its place
    place: ReferencePlace
    sigma: float = 0.0  #: what pieces of it are wrong by, each for itself [m]

    @property
    def name(self) -> str:
        """Its name, unique among scans."""
        return self.scan.name


@dataclass(frozen=True)
class ReferenceOffset(Result):
    """What the network says of the place of a reference."""

    name: str  #: name of the reference
    prior: Number  #: prior sigma of its offset along each axis [m]
    #: the offset along x, y and z, from its file to the result [m]
    offset: tuple[Number, Number, Number]
    sigma: tuple[Number, Number, Number]  #: their sigmas [m]
    #: squared offset over its expectation, its degrees of freedom and its limit; null where
    #: nothing but the prior tells the offset
    statistic: Number | None
    dof: int
    limit: Number | None

    @property
    def fits(self) -> bool | None:
        """None where nothing tells."""
        if self.statistic is None or self.limit is None:
            return None
        return self.statistic <= self.limit

    @classmethod
    def of(cls, reference: ReferencePlace, adjustment: Adjustment) -> ReferenceOffset:
        """The estimate in an adjusted network."""
        at = adjustment.layout.index("pose", reference.name)
        offset = adjustment.state.pose_t[at] - reference.origin
        posterior = adjustment.covariance(reference.name)[:3, :3]
        sigma = np.sqrt(np.maximum(np.diag(posterior), 0.0))
        prior = reference.shared**2
        told, axes = np.linalg.eigh(prior * np.eye(3) - posterior)
        good = told > GATES.told_share * prior
        dof = int(good.sum()) if prior else 0
        along = axes.T @ offset
        statistic = float((along[good] ** 2 / told[good]).sum()) if dof else None
        limit = float(chi2.ppf(1 - GATES.alpha, dof)) if dof else None
        x, y, z = (float(v) for v in offset)
        sx, sy, sz = (float(v) for v in sigma)
        return cls(reference.name, reference.shared, (x, y, z), (sx, sy, sz), statistic, dof, limit)


@dataclass(frozen=True)
class UsedReference(Result, null=("crs",)):
    """A reference as it was used."""

    name: str
    file: str
    model: bool  #: true for surfaces, false for points
    count: int  #: points, or triangles, near the scans
    sigma: Number  #: what pieces of 10 m are wrong by, each for itself [m]
    shared: Number  #: what all of it is wrong by along each axis [m]
    crs: str  #: its reference system as WKT, null where its file does not say
    sentences: tuple[str, ...]  #: what was left out or assumed of it


@dataclass(frozen=True)
class PlacedOn(Result):
    """A scan on a reference: how much of it lies there."""

    reference: str
    scan: str
    area: Number  #: area of the scan within half a metre of the reference [m^2]
    #: shares of it that agree, and that were left out by the test
    agrees: Number
    left_out: Number

    @classmethod
    def of(cls, reference: ScanReference, scan: PreparedScan, fit: PairFit) -> PlacedOn:
        """Of a fit of the scan in the reference."""
        beside = matched(reference.scan.fine, scan.fine, fit.pose, GATES.beside_m)
        mine = beside.subset(beside.forward)
        area = scan.fine.surfels.area[mine.second]
        inside = np.abs(mine.residual) < fit.alignment.gate
        whole = float(area.sum())
        share = float(area[inside].sum()) / whole if whole else float("nan")
        return cls(reference.name, scan.name, whole, share, 1 - share)


def prepare_reference(
    name: str, chunks: Iterable[Array], *, sigma: float = 0.0, shared: float = 0.0
) -> ScanReference:
    """Prepare a cloud as a reference."""
    origin: Array | None = None
    cubes = CellSum(PREPARED.fine_m)
    total = 0
    for xyz in chunks:
        if origin is None and len(xyz):
            origin = np.floor(xyz.mean(axis=0))
        if origin is not None:
            cubes.add(ASKEW @ (xyz - origin))
        total += len(xyz)
    if origin is None:
        raise InputError(f"the reference {name} has no points", cure="give another")
    return _prepared(name, cubes, origin, total, sigma, shared, _upwards)


def reference_of_mesh(
    name: str,
    mesh: Mesh,
    *,
    sigma: float = 0.0,
    shared: float = 0.0,
    cut: Callable[[Mesh], Mesh] = lambda mesh: mesh,
) -> ScanReference:
    """Sample a model as a reference: the whole ``mesh`` tells sides, ``cut`` takes a part."""
    seen, known = mesh.outwards()
    mesh = cut(seen)
    origin = np.floor(np.mean(mesh.corners, axis=0))
    size = PREPARED.fine_m
    while mesh.areas.sum() / size**2 > GATES.cubes:
        size *= 2
    cubes, total = CellSum(size), 0
    for xyz, _ in covering_pieces(mesh.triangles - origin, size / GATES.samples):
        cubes.add(ASKEW @ xyz)
        total += len(xyz)
    tree = TriangleTree(replace(mesh, triangles=mesh.triangles - origin))

    def faces(surfels: Surfels) -> Surfels:
        """Turned to the sides of the faces that they lie on."""
        normals = tree.mesh.normals[tree.nearest(surfels.center).triangle]
        return replace(_turned(surfels, normals), two_sided=not known)

    return _prepared(name, cubes, origin, total, sigma, shared, faces)


def _upwards(surfels: Surfels) -> Surfels:
    """Turned upwards: from above most of a site is seen."""
    return _turned(surfels, np.broadcast_to([0.0, 0.0, 1.0], surfels.normal.shape))


def _turned(surfels: Surfels, outwards: Array) -> Surfels:
    """Surfels with their normals to given sides (n, 3)."""
    sign = np.where(np.einsum("ni,ni->n", surfels.normal, outwards) < 0, -1.0, 1.0)[:, None]
    normal = sign * surfels.normal
    return replace(surfels, normal=normal, gradient=normal, two_sided=True)


def _prepared(
    name: str,
    cubes: CellSum,
    origin: Array,
    total: int,
    sigma: float,
    shared: float,
    turned: Callable[[Surfels], Surfels],
) -> ScanReference:
    """Surfels of cubes, fine enough for the density of the points."""
    cells = cubes.cells
    while cells.size < GATES.largest_m and total / max(len(cells), 1) < GATES.cube_points:
        cells = coarser(cells)
    fine = turned(upright(cells, PREPARED.fine_merges).thinned(PREPARED.most_fine))
    while cells.size < PREPARED.coarse_m - 1e-6:
        cells = coarser(cells)
    coarse = upright(cells, PREPARED.coarse_merges)
    while len(coarse) > PREPARED.most_coarse:
        cells = coarser(cells)
        coarse = upright(cells, PREPARED.coarse_merges)
    if min(len(fine), len(coarse)) < PREPARED.fewest_surfels:
        raise InputError(
            f"the reference {name} makes {len(fine)} pieces of surface, too few to place scans on",
            cure="give more of it",
        )
    view = RangeView()
    whole = Indexed.of(fine)
    most = PREPARED.most_some
    some = whole if len(fine) <= most else Indexed.of(fine.thinned(most))
    rough = Indexed.of(turned(coarse))
    scan = PreparedScan(name, total, whole, some, rough, view)
    return ScanReference(scan, ReferencePlace(name, origin, shared), sigma)


def on_references(
    scans: Sequence[PreparedScan],
    references: Sequence[ScanReference],
    priors: Mapping[str, Pose],
    together: Mapping[str, Pose],
    sigma: ApproximateSigma,
    floor: tuple[float, float],
) -> list[CloudPair]:
    """Register scans to references; ``priors`` are in their frame, ``together`` in another."""
    out: list[CloudPair] = []
    order = sorted(scans, key=lambda one: -one.radius)
    for reference in references:
        pairs: dict[str, CloudPair] = {}
        known: Pose | None = None

        def placed(scan: PreparedScan, known: Pose | None, reference: ScanReference) -> CloudPair:
            prior, doubt, speaks = None, sigma, "the approximate pose"
            if known is not None and scan.name in together:
                prior, doubt = known @ together[scan.name], ApproximateSigma(*GATES.chained)
                speaks = "the other scans"
            elif scan.name in priors:
                given = priors[scan.name]
                prior = Pose(given.rotation, given.translation - reference.place.origin)
            pair = register_pair(
                reference.scan, scan, prior, sigma=doubt, floor=floor, speaks=speaks
            )
            return _with_pieces(reference, pair)

        alone: list[PreparedScan] = []
        for scan in order:
            pair = pairs[scan.name] = placed(scan, known, reference)
            if known is None and scan.name in together:
                if pair.fit is None:
                    alone.append(scan)
                else:
                    known = pair.fit.pose @ together[scan.name].inverse
        # what was open by itself is tried once more where the others put it
        for scan in alone if known is not None else ():
            pairs[scan.name] = placed(scan, known, reference)
        out += pairs.values()
    return out


def _with_pieces(reference: ScanReference, pair: CloudPair) -> CloudPair:
    """The pair with what pieces of its reference are wrong by in its covariance.

    An error ``e`` of a piece moves the fit by ``N^-1 sum(w a) e`` over the matches of that piece;
    pieces are independent (method section 2.16).
    """
    fit = pair.fit
    if fit is None or reference.sigma == 0:
        return pair
    m, precision = fit.alignment.matches, fit.precision
    offset = m.point - precision.middle
    design = np.concatenate([m.normal, np.cross(offset, m.normal)], axis=1)
    u = (m.residual / fit.alignment.gate) ** 2
    weight = (1 - u) ** 2 / m.sigma**2
    normal = (design * weight[:, None]).T @ design
    # what nothing holds stays as open as it is
    inverse = np.linalg.pinv(normal, rcond=1e-8, hermitian=True)
    sums = pieces(m.point, m.normal, design * weight[:, None], GATES.piece_m)
    added = reference.sigma**2 * inverse @ sums.T @ sums @ inverse
    local = precision.local + added
    whole = replace(precision, local=local, covariance=at_origin(local, fit.pose, precision.middle))
    return replace(pair, fit=replace(fit, precision=whole))


def offset_sentence(offset: ReferenceOffset) -> str | None:
    """What the test says of a reference, None where nothing tells."""
    if offset.fits is None:
        return None
    return Sentence(
        "the reference {o.name} {fits} the rest of the network: its offset is {x:mm1~}, {y:mm1~}, "
        "{z:mm1~} mm with sigmas {sx:mm1~}, {sy:mm1~}, {sz:mm1~} mm (test {o.statistic:1}, limit "
        "{o.limit:1})",
        o=offset,
        fits="fits" if offset.fits else "does not fit",
        **dict(zip(("x", "y", "z"), offset.offset, strict=True)),
        **dict(zip(("sx", "sy", "sz"), offset.sigma, strict=True)),
    )
