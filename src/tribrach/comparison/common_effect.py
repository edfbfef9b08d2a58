"""What one campaign measured otherwise than the other, tried before anything is called moved.

A scale or a zero of the ranges and refraction displace a whole cloud, each surface by another
amount, which looks like motions. One of them is fitted beside a rigid motion, robustly; it is in
the distances where far more of the surface agrees in one motion with it than without (method
section 12.9).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.comparison.rigid_motion import PlaceDistances
from tribrach.comparison.station_pair import along_normals
from tribrach.comparison.surface_patches import Patches, patches_of, stable_patches
from tribrach.statistics import robust_sigma

#: share of the surface that agrees with an effect at least, and more than without it; its size in
#: sigmas
_AGREES, _GAIN, _SURE = 0.8, 0.1, 5.0
#: least mean square of the normals in any direction
_FACING = 0.08
#: rounds of the robust fit, and residuals in robust sigmas that take part in the last
_ROUNDS, _KEPT = 30, 4.0
#: mean radius of the earth [m]
_EARTH = 6_371_000.0


@dataclass(frozen=True)
class CommonEffect(Result):
    """What is common to all distances of the later cloud from the earlier one."""

    kind: Literal["scale", "zero", "refraction"]
    value: float  #: later less earlier: [m/m], [m], or a coefficient of refraction
    sigma: float
    share: float  #: of the surface in patches that agrees in one motion with it
    without: float  #: and without it


def common_effect(
    distances: PlaceDistances, cell: float, scanners: Sequence[Array]
) -> tuple[PlaceDistances, CommonEffect | None]:
    """The distances without the effect that explains most, and that effect; None for none.

    ``scanners``: places of the scanners that are known (3,) [m].
    """
    best, rest = None, distances
    if not len(distances):
        return rest, best
    # a wall alone, whose parts move, does not tell motions from effects
    across = np.linalg.eigvalsh(distances.normals.T @ distances.normals)[0] / len(distances)
    without = _share(patches_of(distances, cell)) if across > _FACING else 1.0
    if without <= 1 - _GAIN:
        for kind, column in _effects(distances, scanners):
            value, sigma = _fitted(distances, column)
            if not abs(value) > _SURE * sigma:
                continue
            left = replace(distances, values=distances.values - value * column)
            share = _share(patches_of(left, cell))
            if share > max(_AGREES, without + _GAIN, 0.0 if best is None else best.share):
                best, rest = CommonEffect(kind, value, sigma, share, without), left
    return rest, best


def _share(patches: Patches) -> float:
    """Share of the surface in patches that agrees in one motion."""
    stable = stable_patches(patches)
    return 0.0 if stable is None else float(patches.count[stable].sum() / patches.count.sum())


def _effects(
    distances: PlaceDistances, scanners: Sequence[Array]
) -> Iterator[tuple[Literal["scale", "zero", "refraction"], Array]]:
    """Kinds of effects, and what a unit of each does to the distances (m,)."""
    core, normals = distances.core, distances.normals
    yield "scale", np.einsum("mi,mi->m", normals, core - core.mean(axis=0))
    for place in scanners:
        beam = core - place
        length = np.maximum(np.linalg.norm(beam, axis=1), 1e-9)
        yield "zero", np.einsum("mi,mi->m", normals, beam) / length
        yield "refraction", normals[:, 2] * (beam[:, :2] ** 2).sum(axis=1) / (2 * _EARTH)


def _fitted(distances: PlaceDistances, column: Array) -> tuple[float, float]:
    """An effect beside a rigid motion by the smallest sum of residuals, and its sigma."""
    middle = distances.core.mean(axis=0)
    rows = np.column_stack([along_normals(distances.core, distances.normals, middle), column])
    size = np.sqrt((rows**2).mean(axis=0))
    rows = rows / np.where(size > 0, size, 1.0) / distances.sigma[:, None]
    seen = distances.values / distances.sigma
    left, kept, scale = seen, np.ones(len(seen), dtype=bool), 1.0
    for step in range(_ROUNDS + 1):
        root = 1 / np.sqrt(np.maximum(np.abs(left), 1.0))
        if step == _ROUNDS:
            scale = max(robust_sigma(left, about=0.0), 1.0)
            kept = np.abs(left) < _KEPT * scale
            root = kept.astype(float)
        found = np.linalg.lstsq(rows * root[:, None], seen * root, rcond=1e-9)[0]
        left = seen - rows @ found
    own = rows[kept, -1] - rows[kept, :-1] @ np.linalg.lstsq(rows[kept, :-1], rows[kept, -1])[0]
    weight = float(np.linalg.norm(own))
    if not size[-1] > 0 or weight < 1e-6 * float(np.linalg.norm(rows[kept, -1])):
        return 0.0, np.inf
    return float(found[-1] / size[-1]), scale / weight / float(size[-1])
