"""Is it the registration, the surface or the noise? Distances of flat patches tell them apart.

In the overlap of two stations every patch p has a distance along its normal,
``L_p = a_p^T q + e_p``, ``a = [n ; (X - X_0) x n]``: the six parameters q of what is left of the
relative pose are the registration error; what they do not explain, e, is systematic and local
(calibration, incidence, change); the spread within the patches is noise (method section 9.5). The
joint covariance of the stations says how large q may be. Directions of q that the patches do not
see, as shifts along a single wall, are named and left out, never inverted. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.comparison.m3c2 import ENOUGH, M3C2
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.station_pair import StationPair, along_normals
from tribrach.errors import InputError
from tribrach.statistics import chi2

__all__ = ["Patches", "Separation", "patches_of", "separate"]


#: directions whose singular value is this share of the largest are not seen: normals are not
#: better known than about half a degree in all they do
TOLERANCE = 0.01
#: below this probability the residuals are not explained by the noise of the patches
LEVEL = 0.05
_NAMES = ("x", "y", "z")


@dataclass(frozen=True)
class Patches:
    """Flat patches that both stations see, none sharing points with another.

    middle, normal (p, 3); distance (p,), second minus first; sigma (p,) of it from the points alone
    [m]; spread (p, 2) : standard deviation within the patch in either cloud [m].
    """

    middle: Array
    normal: Array
    distance: Array
    sigma: Array
    spread: Array


@dataclass(frozen=True)
class Separation:
    """Registration, local systematics and noise of two stations.

    reference (3,) : X_0, the middle of the patches; pose (6,) : q, shift [m] of the second cloud
    against the first and its turn [rad], zero along what is not seen; covariance (6, 6) of q from
    the patches, as far as seen, times the variance factor where that is significant; predicted
    (6, 6) of q from the stations; seen (6, r), unseen (6, 6 - r) : directions of q, turns in metres
    at the mean lever; lever : [m].
    residual (p,) : e; local : its RMS per degree of freedom [m]; excess : what of it the noise of
    the patches does not explain [m]; noise (2,) : RMS spread within the patches [m]; factor :
    ``e^T P e / (p - r)``; statistic, probability : of q against its prediction, chi-square with r
    degrees of freedom; fit_probability : of such residuals from the noise of the patches alone.
    """

    reference: Array
    pose: Array
    covariance: Array
    predicted: Array
    seen: Array
    unseen: Array
    lever: float
    residual: Array
    local: float
    excess: float
    noise: Array
    factor: float
    statistic: float
    probability: float
    fit_probability: float

    @property
    def rank(self) -> int:
        """How many of the six directions the patches see."""
        return int(self.seen.shape[1])

    @property
    def sigma(self) -> Array:
        """Sigmas (6,) of q from the patches [m, rad]; of the seen part only."""
        root: Array = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return root

    @property
    def sentences(self) -> list[str]:
        """The directions that no patch sees, one sentence each."""
        return [f"No patch sees {_words(direction, self.lever)}." for direction in self.unseen.T]


def patches_of(found: M3C2 | M3C2EP, roughness: float | None = None) -> Patches:
    """Patches from distances at core points, those with twenty points of both clouds.

    roughness : core points whose normals have more are left out [m]. The cylinders must not
    overlap: core points at least a diameter apart.
    """
    fewest = np.minimum(found.first.count, found.second.count)
    good = (fewest >= ENOUGH) & np.isfinite(found.distance)
    if roughness is not None:
        good &= found.normals.roughness <= roughness
    sigma = found.sigma_random if isinstance(found, M3C2EP) else _noise(found)
    spread = np.stack([found.first.spread, found.second.spread], axis=1)
    return Patches(
        found.core[good],
        found.normals.vectors[good],
        found.distance[good],
        sigma[good],
        spread[good],
    )


def _noise(found: M3C2) -> Array:
    return found.noise if found.noise_independent is None else found.noise_independent


def separate(patches: Patches, stations: StationPair, tolerance: float = TOLERANCE) -> Separation:
    """The relative pose that patches (p) still ask for, and the rest.

    tolerance : singular values of the design below this share of the largest are not inverted.

    Raises
    ------
    InputError : not more patches than directions, or a patch without a positive sigma.
    """
    count = len(patches.distance)
    if count == 0 or not (np.isfinite(patches.sigma).all() and (patches.sigma > 0).all()):
        raise InputError("patches with a positive sigma are needed to separate errors")
    reference = patches.middle.mean(axis=0)
    lever = float(np.sqrt(((patches.middle - reference) ** 2).sum() / count))
    if lever <= 0:
        raise InputError("all patches are in one place", cure="spread the core points")
    # turns in metres at the mean lever, so that all six columns are alike
    scale = np.repeat([1.0, 1 / lever], 3)
    design = along_normals(patches.middle, patches.normal, reference) * scale
    _, values, axes = np.linalg.svd(design / patches.sigma[:, None], full_matrices=True)
    rank = int((values > tolerance * values[0]).sum())
    if count <= rank:
        raise InputError(f"{count} patches do not check the {rank} parameters that they see")
    fit = _fit(design @ axes[:rank].T, patches)
    predicted = stations.relative(reference)
    seen = axes[:rank].T
    foretold = seen.T @ (predicted / np.outer(scale, scale)) @ seen + fit.covariance
    statistic = float(fit.part @ np.linalg.solve(foretold, fit.part))
    local = float(np.sqrt((fit.residual**2).sum() / (count - rank)))
    back = scale[:, None] * seen
    return Separation(
        reference=reference,
        pose=back @ fit.part,
        covariance=back @ fit.covariance @ back.T,
        predicted=predicted,
        seen=seen,
        unseen=axes[rank:].T,
        lever=lever,
        residual=fit.residual,
        local=local,
        excess=float(np.sqrt(max(local**2 - (patches.sigma**2).mean(), 0.0))),
        noise=np.sqrt((patches.spread**2).mean(axis=0)),
        factor=fit.factor,
        statistic=statistic,
        probability=float(chi2.sf(statistic, rank)),
        fit_probability=fit.probability,
    )


@dataclass(frozen=True)
class _Fit:
    """Seen part of the pose, its covariance, residuals, variance factor and its probability."""

    part: Array
    covariance: Array
    residual: Array
    factor: float
    probability: float


def _fit(design: Array, patches: Patches) -> _Fit:
    """Weighted least squares by the triangle of the design (p, r) of full rank.

    Where the residuals are larger than the noise of the patches explains, local systematics act on
    the pose like noise, and its covariance is multiplied by the variance factor.
    """
    q, r = np.linalg.qr(design / patches.sigma[:, None])
    half = np.linalg.inv(r)
    part = half @ (q.T @ (patches.distance / patches.sigma))
    residual = patches.distance - design @ part
    square, dof = float(((residual / patches.sigma) ** 2).sum()), len(design) - design.shape[1]
    probability = float(chi2.sf(square, dof))
    factor = square / dof
    inflation = factor if probability < LEVEL else 1.0
    return _Fit(part, inflation * half @ half.T, residual, factor, probability)


def _words(direction: Array, lever: float) -> str:
    """What an unseen direction (6,) moves: shifts and turns of at least a tenth of it."""
    shift, turn = direction[:3], direction[3:] / lever
    said = []
    if np.linalg.norm(shift) > 0.1:
        said.append("a shift along " + _axis(shift))
    if np.linalg.norm(direction[3:]) > 0.1:
        said.append("a turn about " + _axis(turn))
    return " together with ".join(said)


def _axis(vector: Array) -> str:
    """A direction in numbers, its largest component positive."""
    unit = vector / np.linalg.norm(vector)
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    parts = [f"{value:.2f} {name}" for value, name in zip(unit, _NAMES, strict=True)]
    return "(" + ", ".join(parts) + ")"
