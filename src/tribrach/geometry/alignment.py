"""Closed-form motions that carry one set of points onto another.

``world ~ scale * rotation @ local + translation``: rigid in space (Kabsch 1976), with scale
(Umeyama 1991), and in the plane (four-parameter transformation of levelled set-ups). Arrays are (n,
3) or (n, 2) in metres; the ``group`` functions solve many alignments at once.

The rotation is always proper. Where only a mirror image would fit, the result says so
(:attr:`Alignment.hint`): two columns of the coordinates are usually swapped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.sentences import Sentence

#: a mirror image that fits this many times better than the proper rotation is reported
_MIRROR_RATIO = 5.0


@dataclass(frozen=True)
class Alignment:
    """One motion, ``world = scale * rotation @ local + translation``."""

    rotation: Array  #: (d, d), determinant +1
    translation: Array  #: (d,), in metres
    scale: float  #: one for rigid motions
    rms: float  #: root mean square of the lengths of the residuals [m]
    mirror_rms: float  #: the same for the best improper rotation [m]

    def __call__(self, local: Array) -> Array:
        """Points (..., d) [m] of the local frame in the world frame."""
        out: Array = self.scale * (local @ self.rotation.T) + self.translation
        return out

    @property
    def mirrored(self) -> bool:
        """True if the mirror image fits much better than the proper rotation."""
        return self.rms > _MIRROR_RATIO * self.mirror_rms + 1e-9

    def hint(self, upright: float) -> str:
        """What looks wrong with the input, one sentence; empty if nothing does.

        Points in one plane fit as well from below: then only the standing axis tells.

        ``upright``: RMS of the residuals of a fit that stands upright [m].
        """
        if self.mirrored:
            return Sentence(
                "the points fit only as a mirror image ({own.mirror_rms:mg3} instead of "
                "{own.rms:mg3}): your columns look swapped (N/E)",
                own=self,
            )
        turned = len(self.rotation) == 3 and self.rotation[2, 2] < -0.5
        if turned and upright > _MIRROR_RATIO * self.rms + 1e-9:
            return (
                "the points fit only upside down: if the instrument stood upright, "
                "your columns look swapped (N/E)"
            )
        return ""


@dataclass(frozen=True)
class Groups:
    """Alignments of G groups."""

    rotation: Array  #: (G, d, d), determinant +1
    translation: Array  #: (G, d), in metres
    scale: Array  #: (G,), one for rigid motions
    count: Index  #: (G,), pairs of points with a weight above zero
    #: (G,), standard deviation [m] of the points across their best line (in the plane: from their
    #: centroid), which must not vanish
    spread: Array
    mirrored: NDArray[np.bool_]  #: (G,), true where the determinant had to be put right

    def residuals(self, group: Index, local: Array, world: Array) -> Array:
        """Residuals (n, d) [m], world less aligned local, of pairs with their groups (n,)."""
        turned = np.einsum("nij,nj->ni", self.rotation[group], local)
        out: Array = world - self.scale[group, None] * turned - self.translation[group]
        return out


def _sums(group: Index, size: int, values: Array) -> Array:
    """Sums (size, ...) of values (n, ...) by group."""
    flat = values.reshape(len(values), -1)
    out = np.stack([np.bincount(group, c, minlength=size) for c in flat.T], axis=1)
    sums: Array = out.reshape(size, *values.shape[1:]).astype(float)
    return sums


def group_rigid(
    group: Index,
    size: int,
    local: Array,
    world: Array,
    weights: Array | None = None,
    *,
    scale: bool = False,
    mirror: bool = False,
) -> Groups:
    """Kabsch (or with ``scale`` Umeyama) alignments of many groups.

    Groups without points give NaN-free identities with count 0.

    ``mirror`` returns the best improper rotation instead.
    """
    w = np.ones(len(local)) if weights is None else np.asarray(weights, dtype=float)
    total = np.bincount(group, w, minlength=size)
    count = np.bincount(group[w > 0], minlength=size)
    safe = np.where(total > 0, total, 1.0)[:, None]
    centre_l = _sums(group, size, w[:, None] * local) / safe
    centre_w = _sums(group, size, w[:, None] * world) / safe
    dl, dw = local - centre_l[group], world - centre_w[group]
    cross = _sums(group, size, w[:, None, None] * dw[:, :, None] * dl[:, None, :])
    u, s, vt = np.linalg.svd(cross)
    handed = np.linalg.det(u) * np.linalg.det(vt)
    signs = np.ones_like(s)
    signs[:, -1] = -np.sign(handed) if mirror else np.sign(handed)
    rotation = (u * signs[:, None, :]) @ vt
    inertia = np.bincount(group, w * (dl**2).sum(axis=1), minlength=size)
    factor = np.ones(size)
    if scale:
        solid = inertia > 0
        factor[solid] = (s * signs).sum(axis=1)[solid] / inertia[solid]
    moved = np.einsum("gij,gj->gi", rotation, centre_l)
    # in space two extents must be there, in the plane one
    spread = np.sqrt(np.maximum(s[:, 1] if s.shape[1] == 3 else inertia, 0.0) / safe[:, 0])
    return Groups(rotation, centre_w - factor[:, None] * moved, factor, count, spread, handed < 0)


def group_planar(
    group: Index,
    size: int,
    local: Array,
    world: Array,
    weights: Array | None = None,
    *,
    scale: bool = False,
    mirror: bool = False,
) -> Groups:
    """The same in the plane: local (n, 2), world (n, 2)."""
    return group_rigid(group, size, local, world, weights, scale=scale, mirror=mirror)


def _single(local: Array, world: Array, weights: Array | None, scale: bool) -> Alignment:
    one = np.zeros(len(local), dtype=np.int64)
    w = np.ones(len(local)) if weights is None else np.asarray(weights, dtype=float)

    def rms(fit: Groups) -> float:
        square = (fit.residuals(one, local, world) ** 2).sum(axis=1)
        return float(np.sqrt((w * square).sum() / w.sum()))

    fit = group_rigid(one, 1, local, world, w, scale=scale)
    other = group_rigid(one, 1, local, world, w, scale=scale, mirror=True)
    return Alignment(fit.rotation[0], fit.translation[0], float(fit.scale[0]), rms(fit), rms(other))


def _checked(local: Array, world: Array) -> tuple[Array, Array]:
    local, world = np.asarray(local, dtype=float), np.asarray(world, dtype=float)
    dimension = local.shape[1]
    needed = "three points that are not on one line" if dimension == 3 else "two points"
    extents = [np.linalg.svd(x - x.mean(axis=0), compute_uv=False) for x in (local, world)]
    if len(local) < dimension or any(e[dimension - 2] <= 1e-9 * (1 + e[0]) for e in extents):
        raise InputError(f"an alignment needs {needed}", cure="give more common points")
    return local, world


def kabsch(local: Array, world: Array, weights: Array | None = None) -> Alignment:
    """Rigid motion of points (n, 3) with weights (n,); Kabsch, Acta Cryst. A32 (1976) 922."""
    return _single(*_checked(local, world), weights, False)


def umeyama(local: Array, world: Array, weights: Array | None = None) -> Alignment:
    """Similarity of points (n, d); Umeyama, IEEE PAMI 13 (1991) 376, eqs 40 to 42."""
    return _single(*_checked(local, world), weights, True)


def upright_rms(local: Array, world: Array) -> float:
    """RMS [m] of points (n, 3) that a similarity turns about the vertical alone."""
    plan = umeyama(local[:, :2], world[:, :2])
    return float(np.hypot(plan.rms, np.std(world[:, 2] - plan.scale * local[:, 2])))


def planar(local: Array, world: Array) -> Alignment:
    """Rotation and shift of plan coordinates (n, 2), n >= 2."""
    return _single(*_checked(local, world), None, False)
