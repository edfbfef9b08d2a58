"""Is control in a grid that is not Cartesian, such as a map projection?

Distances between reflectors are measured; those between the same points of a map projection differ
from them by its scale and by the height over its surface. A similarity of the reflectors of each
scan position onto their control (Umeyama 1991) shows that scale, and what it leaves of the misfits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.alignment import umeyama
from tribrach.sentences import Sentence
from tribrach.statistics import chi2, norm

#: error probability of both tests
_ALPHA = 0.001


@dataclass(frozen=True)
class GridScale:
    """Scale of control against measured distances."""

    #: control over measurement, less one
    scale: float
    #: its standard deviation
    sigma: float
    #: the misfits that remain with the scale are not larger than their sigmas allow
    explains: bool

    @property
    def test_value(self) -> float:
        """The scale in terms of its sigma."""
        return abs(self.scale) / self.sigma

    @property
    def limit(self) -> float:
        """What the test value exceeds by chance once in a thousand times."""
        return float(norm.ppf(1 - _ALPHA / 2))

    @property
    def told(self) -> bool:
        """True if there is a scale, and nothing but a scale."""
        return self.explains and self.test_value > self.limit


def grid_scale(
    stations: Sequence[Mapping[str, tuple[Array, Array]]],
    control: Mapping[str, tuple[Array, Array]],
) -> GridScale | None:
    """Scale of control points against the reflectors of scan positions.

    Scan positions share their control, so that their scales are correlated; the mean has the sigma
    of the best of them and not a smaller one.

    ``stations``: place (3,) in the scanner frame [m] and covariance (3, 3) of each reflector, by
    name; ``control``: place (3,) [m] and standard deviations (3,) of each control point, by name.
    """
    scales, sigmas, misfit, dof = [], [], 0.0, 0
    for targets in stations:
        names = [name for name in targets if name in control]
        if len(names) < 3:
            continue
        local = np.array([targets[name][0] for name in names])
        world = np.array([control[name][0] for name in names])
        spread = np.array(
            [np.trace(targets[n][1]) / 3 + np.mean(np.square(control[n][1])) for n in names]
        )
        weight = 1 / spread
        try:
            fit = umeyama(local, world, weight)
        except InputError:
            continue
        around = local - np.average(local, axis=0, weights=weight)
        scales.append(fit.scale - 1)
        sigmas.append(float(1 / np.sqrt(weight @ np.square(around).sum(axis=1))))
        misfit += float(weight @ np.square(world - fit(local)).sum(axis=1))
        dof += 3 * len(names) - 7
    if not scales:
        return None
    weights = 1 / np.square(sigmas)
    explains = misfit <= float(chi2.ppf(1 - _ALPHA, dof))
    return GridScale(float(np.average(scales, weights=weights)), min(sigmas), explains)


def grid_sentence(found: GridScale, crs: str) -> str:
    """What to say of a scale that is there."""
    name = f" ({crs})" if crs else ""
    return Sentence(
        "control fits the measured distances with a scale of {found.scale:ppm+1}, "
        "sigma {found.sigma:ppm1} (test value {found.test_value:1}, limit "
        "{found.limit:2}), and not without: its grid{name} is not Cartesian, as that "
        "of a map projection is not, or all ranges have this scale; no single control "
        "point is wrong by it; give the control in a CSV file of a project whose site "
        "has the crs of the grid",
        found=found,
        name=name,
    )
