"""What the points of a result share: one covariance of poses and effects, carried to each point.

``Sigma_ij = delta_ij B_i + J_i S J_j^T`` (method section 5.10): S is the joint covariance of the
poses of all stations and of the effects that are common to their points (parameters of a
calibration, a scale of the ranges, a coefficient of refraction); ``J_i = [I | -[R x]x | J_c]`` is
computed from the coordinates of a point when it is needed; ``B_i`` is what is new with every
point. Nothing is stored for a point, and no matrix of all points is ever made.

The systematic part of the angles is wrong alike for a neighbourhood of which nobody knows how wide
it is. It is carried apart, by bounds that hold for every correlation from 0 to 1.

Metres and radians, in the axes of one frame; increments of poses are left.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array, Index
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import CalibrationShare, Placement
from tribrach.errors import InputError, UnknownName
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.polar import polar_from_xyz, xyz_by_polar
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import skew
from tribrach.instruments.correction import Correction
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.given_values import given_rows, with_given
from tribrach.observations.declaration import Role
from tribrach.units import too_large

if TYPE_CHECKING:
    from tribrach.network.adjustment import Adjustment

#: points whose derivatives are in memory at a time
_BLOCK = 50_000
#: a covariance may have eigenvalues below zero by this share of its largest
_ROUNDING = 1e-9
#: numbers that are kept of what given values have to do with the rest: 32 MB
MOST_GIVEN = 4_000_000
#: unknowns of a pose
_POSE = 6


def slopes(world: Array, placement: Placement) -> Array:
    """Derivatives (n, 3, 6 + k) of placed points by what they share with all points of their scan.

    They are by translation [m], left rotation increments [rad], and the k effects.

    Method sections 5.1 and 5.10.
    """
    arm = world - placement.pose.translation
    by_pose = np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), -skew(arm)], axis=2)
    if placement.calibration is None:
        return by_pose
    by_polar, columns = placement.calibration.correction.factors(arm @ placement.pose.rotation)
    by_effect = placement.pose.rotation @ (by_polar @ columns)
    return np.concatenate([by_pose, by_effect], axis=2)


def angle_slopes(world: Array, placement: Placement) -> Array:
    """How far one sigma of both angles' systematic part moves points (n, 3, 2); section 5.10."""
    sigma = 0.0 if placement.noise is None else placement.noise.systematic
    if sigma == 0.0 or not len(world):
        return np.zeros((len(world), 3, 2))
    local = (world - placement.pose.translation) @ placement.pose.rotation
    out: Array = sigma * placement.pose.rotation @ xyz_by_polar(polar_from_xyz(local))[:, :, 1:]
    return out


@dataclass(frozen=True, eq=False)
class GivenPart:
    """Given values of a result, and their covariance with what its points share."""

    #: what the m given values are: coordinates of control, parameters of a calibration file.
    #: Results with the same keys were told the same
    keys: tuple[str, ...]
    covariance: Array  #: (m, m): of the given values, a priori
    cross: Array  #: (q, m): covariance of the rows of the shared part with them

    def __post_init__(self) -> None:
        """Refuse matrices of other sizes."""
        m = len(self.keys)
        if self.covariance.shape != (m, m) or self.cross.shape[1:] != (m,):
            raise InputError(f"the covariance of the given values has {m} rows and columns")


@dataclass(frozen=True, eq=False)
class SharedPart:
    """The joint covariance of everything that points of a result share.

    Attributes
    ----------
    scans : mapping
        Where each scan stands, by its name. All are in one frame.
    columns : mapping
        Rows of the covariance, by the name of a scan: six of its station, then its effects.
    covariance : array (q, q)
        Of the poses (translation [m], left rotation increments [rad]) and the effects.
    stations : tuple of str
        Whose poses the first rows are, six each.
    effects : tuple of str
        What the rows behind them are.
    given : GivenPart or None
        What other results may have been told too; None where that is not known.

    Raises
    ------
    InputError
        The matrix is not of so many unknowns.
    """

    scans: Mapping[str, Placement]
    columns: Mapping[str, Index]
    covariance: Array
    stations: tuple[str, ...]
    effects: tuple[str, ...] = ()
    given: GivenPart | None = None

    def __post_init__(self) -> None:
        """Refuse a matrix of another size."""
        count = _POSE * len(self.stations) + len(self.effects)
        if self.covariance.shape != (count, count):
            raise InputError(f"the joint covariance of the stations has {count} rows and columns")
        if self.given is not None and len(self.given.cross) != count:
            raise InputError(f"the covariance with the given values has {count} rows")

    @cached_property
    def identity(self) -> bytes:
        """Digest of all that makes the result: what is read twice is one result, sharing all."""
        parts = [repr((self.stations, self.effects)).encode(), self.covariance.tobytes()]
        for name, where in self.scans.items():
            parts += [name.encode(), where.pose.matrix.tobytes(), self.columns[name].tobytes()]
        return sha256(b"\0".join(parts)).digest()

    @classmethod
    def of_adjustment(
        cls,
        adjustment: Adjustment,
        noise: ScanNoise | Mapping[str, ScanNoise] | None = None,
        *,
        stations: Sequence[str] | None = None,
        posterior: bool = False,
    ) -> SharedPart:
        """Take the stations of an adjusted network, one scan at each, named like its station.

        Parameters
        ----------
        adjustment : Adjustment
            The network.
        noise : ScanNoise or mapping, optional
            Of single points, one of all stations or by their names. Without it points have
            nothing of their own: their sums have what they share, and no more.
        stations : sequence of str, optional
            Names of stations, all of them if not given.
        posterior : bool
            Covariances a posteriori.

        Returns
        -------
        SharedPart
            In the work frame, a priori unless told otherwise.

        Raises
        ------
        UnknownName
            The network has no such station.

        References
        ----------
        Method section 5.10.
        """
        names = tuple(adjustment.layout.names["pose"] if stations is None else stations)
        rows = [adjustment.columns(name) for name in names]
        columns = np.concatenate(rows) if rows else np.zeros(0, dtype=np.int64)
        factor = adjustment.variance_factor(posterior=posterior)
        joint = _symmetric(factor * adjustment.covariance_columns(columns, columns))
        state = adjustment.state
        scans, at = {}, {}
        for k, name in enumerate(names):
            number = state.layout.index("pose", name)
            at[name] = _POSE * k + np.arange(_POSE)
            own = noise if isinstance(noise, ScanNoise) or noise is None else noise.get(name)
            pose = Pose(state.pose_r[number], state.pose_t[number])
            scans[name] = Placement(name, pose, joint[np.ix_(at[name], at[name])], own)
        given, part = given_rows(adjustment, (Role.GIVEN,)), None
        if (len(columns) + len(given)) * len(given) <= MOST_GIVEN:
            rows_of = np.array(list(given.values()), dtype=np.int64)
            cross, known = with_given(adjustment, rows_of, columns)
            part = GivenPart(tuple(given), known, np.sqrt(factor) * cross)
        return cls(scans, at, joint, names, (), part)

    @classmethod
    def assembled(
        cls,
        scans: Mapping[str, tuple[str, Pose, ScanNoise | None, Correction | None]],
        columns: Mapping[str, Index],
        covariance: Array,
        stations: Sequence[str],
        effects: Sequence[str] = (),
        given: GivenPart | None = None,
    ) -> SharedPart:
        """Put scans together with their joint covariance.

        Parameters
        ----------
        scans : mapping
            By name: station, pose, noise of single points, and the model of the effects.
        columns, covariance, stations, effects, given
            As the attributes.
        """
        joint = _symmetric(covariance)
        placed = {
            name: _placed(*scan, joint[np.ix_(columns[name], columns[name])])
            for name, scan in scans.items()
        }
        return cls(placed, dict(columns), joint, tuple(stations), tuple(effects), given)

    def delivered(self, frame: OutputFrame) -> SharedPart:
        """The same in the frame of the clouds: exact at each station, rigid around it.

        Parameters
        ----------
        frame
            The frame of the clouds.
        """
        turn = np.eye(len(self.covariance))
        for name, place in self.scans.items():
            rows = self.columns[name][:_POSE]
            rotation = frame.rotation(place.pose.translation)
            turn[np.ix_(rows, rows)] = np.kron(np.eye(2), rotation)
        return SharedPart(
            {name: place.delivered(frame) for name, place in self.scans.items()},
            self.columns,
            _symmetric(turn @ self.covariance @ turn.T),
            self.stations,
            self.effects,
            None if self.given is None else replace(self.given, cross=turn @ self.given.cross),
        )

    def scan(self, name: str) -> Placement:
        """The scan of a name.

        Raises
        ------
        UnknownName
            There is none; a KeyError that says which there are.
        """
        if name not in self.scans:
            raise UnknownName("scan", name, self.scans)
        return self.scans[name]

    def points(
        self,
        xyz: ArrayLike,
        scan: str,
        *,
        cosine: ArrayLike | None = None,
        intensity: ArrayLike | None = None,
        effective: float | None = None,
    ) -> CloudPoints:
        """Points of a scan, with what they share with all others of this result.

        Parameters
        ----------
        xyz : array_like (n, 3)
            Coordinates in the frame of the result [m].
        scan : str
            Name of the scan that they are from.
        cosine : array_like (n,), optional
            Cosines of the incidence angles.
        intensity : array_like (n,), optional
            Of the points, where the law of the noise asks for them.
        effective : float, optional
            How many of the points count as independent; what the noise says that neighbours share
            if not given.

        Returns
        -------
        CloudPoints

        Raises
        ------
        UnknownName
            There is no such scan.
        InputError
            Not (n, 3) finite coordinates, no points, an effective number that is none.
        """
        self.scan(scan)
        return CloudPoints(
            np.array(xyz, dtype=float, ndmin=2),
            scan,
            self,
            None if cosine is None else np.array(cosine, dtype=float, ndmin=1),
            None if intensity is None else np.array(intensity, dtype=float, ndmin=1),
            effective,
        )


@dataclass(frozen=True, eq=False, repr=False)
class CloudPoints:
    """Points of one scan, with what they share."""

    xyz: Array  #: (n, 3): in the frame of the result [m]
    scan: str  #: the scan that they are from
    shared: SharedPart  #: what they share with each other and with the points of other scans
    #: (n,): cosines of the incidence angles; intensities for the law of the noise
    cosine: Array | None = None
    intensity: Array | None = None
    #: how many of the points count as independent; None to take what the noise says that neighbours
    #: share
    effective: float | None = None

    def __post_init__(self) -> None:
        """Refuse arrays that are not points."""
        if self.xyz.ndim != 2 or self.xyz.shape[1] != 3 or not len(self.xyz):
            raise InputError(
                f"points have the shape {self.xyz.shape}", cure="give an array (n, 3), n > 0"
            )
        if not np.isfinite(self.xyz).all():
            raise InputError("points have a coordinate that is no number", cure="leave them out")
        for what, values in (("cosines", self.cosine), ("intensities", self.intensity)):
            if values is not None and values.shape != (len(self.xyz),):
                raise InputError(
                    f"{len(self.xyz)} points have {what} of the shape {values.shape}",
                    cure="give one for each point",
                )
        if self.effective is not None and not 0 < self.effective <= len(self.xyz):
            raise InputError(
                f"{self.effective:g} of {len(self.xyz)} points are said to be independent",
                cure="give more than none and no more than there are",
            )

    def __len__(self) -> int:
        return len(self.xyz)

    def __repr__(self) -> str:
        return f"<{len(self)} points of scan {self.scan}>"

    @property
    def placement(self) -> Placement:
        """Placement of their scan."""
        return self.shared.scans[self.scan]

    def own(self, part: slice = slice(None)) -> Array:
        """Covariances ``B_i`` (n, 3, 3) [m^2] of each point by itself; zero without noise."""
        where, xyz = self.placement, self.xyz[part]
        if where.noise is None:
            return np.zeros((len(xyz), 3, 3))
        alone = Placement(where.station, where.pose, np.zeros((6, 6)), where.noise.random)
        local = (xyz - where.pose.translation) @ where.pose.rotation
        cosine = None if self.cosine is None else self.cosine[part]
        light = None if self.intensity is None else self.intensity[part]
        elements = covariances(local, alone, cosine, light)
        return elements[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)

    def carried(self, gradients: Array) -> tuple[Array, Array]:
        """Carry the points to m quantities by their gradients (n, m, 3).

        ``sum_i G_i B_i G_i^T`` with what neighbours share of their ranges, and ``sum_i G_i J_i`` by
        everything that is shared.

        Method section 5.10.
        """
        m = gradients.shape[1]
        own, shared = np.zeros((m, m)), np.zeros((m, len(self.shared.covariance)))
        at = self.shared.columns[self.scan]
        for first in range(0, len(self), _BLOCK):
            part = slice(first, first + _BLOCK)
            g = gradients[part]
            own += np.einsum("nai,nib->ab", g, self.own(part) @ g.transpose(0, 2, 1))
            shared[:, at] += np.einsum("nmi,nij->mj", g, slopes(self.xyz[part], self.placement))
        if self.effective is not None:
            return len(self) / self.effective * own, shared
        return own + self._neighbours(gradients), shared

    def _neighbours(self, gradients: Array) -> Array:
        """What neighbours share of the errors of their ranges (m, m), over all pairs of points."""
        where = self.placement
        noise = where.noise
        if noise is None or len(self) < 2:
            return np.zeros((gradients.shape[1],) * 2)
        beam = self.xyz - where.pose.translation
        length = np.linalg.norm(beam, axis=1)
        beam /= np.maximum(length, np.finfo(float).tiny)[:, None]
        cosine = 1.0 if self.cosine is None else self.cosine
        sigma = noise.range_sigma(length, cosine, self.intensity)
        rows = np.einsum("nmi,ni->nm", gradients, beam) * sigma[:, None]
        return noise.shared.at(float(np.median(length))).summed(beam, rows)


def checked_covariance(covariance: Array, count: int, whose: str) -> None:
    """Refuse a matrix that is not the joint covariance of so many unknowns."""
    if covariance.shape != (count, count) or not np.isfinite(covariance).all():
        raise InputError(f"the joint covariance of {whose} has {count} rows and columns")
    if too_large(covariance):
        raise InputError(f"the joint covariance of {whose} has a number beyond any measurement")
    if not count:
        return
    if not (np.diag(covariance) >= 0).all():
        raise InputError(f"the joint covariance of {whose} has a negative variance")
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values = np.linalg.eigvalsh(_symmetric(covariance) / np.outer(scale, scale))
    if values[0] < -_ROUNDING * max(values[-1], 1.0):
        raise InputError(f"the joint covariance of {whose} has a negative variance")


def _placed(
    station: str,
    pose: Pose,
    noise: ScanNoise | None,
    correction: Correction | None,
    covariance: Array,
) -> Placement:
    """A scan with its part (6 + k, 6 + k) of the joint covariance."""
    share = None
    if correction is not None and len(covariance) > _POSE:
        own, cross = covariance[_POSE:, _POSE:], covariance[:_POSE, _POSE:]
        share = CalibrationShare(correction, own, cross)
    return Placement(station, pose, covariance[:_POSE, :_POSE], noise, share)


def _symmetric(matrix: Array) -> Array:
    """The matrix without the asymmetry of rounding."""
    out: Array = 0.5 * (matrix + matrix.T)
    return out
