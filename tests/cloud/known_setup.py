"""A scanner over a known point, turned to a backsight: its pose by propagation in closed form.

The programs adjust such a set-up in their network; this is what they must come to (Lichti and
Gordon 2004; method section 5.1). Errors of the mark are taken as independent of those of the
heading. Metres and radians.
"""

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.instruments.precision import pointing_sigma


@dataclass(frozen=True)
class KnownSetup:
    """An occupied point with a backsight.

    mark (3, 3) : covariance of the occupied point [m^2]; position : sigma of either end of the
    backsight across it [m]; centring of instrument and target, height of instrument [m]; tilt :
    of the levelled axis [rad]; length [m] and zenith [rad] of the backsight; magnification of the
    telescope and how often it was pointed.
    """

    mark: Array
    position: float
    centring: float
    height: float
    tilt: float
    length: float
    zenith: float = np.pi / 2
    magnification: float = 30.0
    pointings: int = 1

    @property
    def heading(self) -> dict[str, float]:
        """Sigmas [rad] of the heading by their causes."""
        return {
            "backsight position": float(np.sqrt(2) * self.position / self.length),
            "backsight centring": float(np.sqrt(2) * self.centring / self.length),
            "backsight pointing": pointing_sigma(self.magnification, self.pointings),
            "backsight trunnion": float(abs(self.tilt / np.tan(self.zenith))),
        }

    @property
    def shares(self) -> dict[str, Array]:
        """Covariances (6, 6) of translation and left rotation increments by their causes."""
        out = {
            "control": np.zeros((6, 6)),
            "centring": np.diag([self.centring**2, self.centring**2, 0.0, 0.0, 0.0, 0.0]),
            "height of instrument": np.diag([0.0, 0.0, self.height**2, 0.0, 0.0, 0.0]),
            "levelling": np.diag([0.0, 0.0, 0.0, self.tilt**2, self.tilt**2, 0.0]),
        }
        out["control"][:3, :3] = self.mark
        for name, sigma in self.heading.items():
            out[name] = np.diag([0.0, 0.0, 0.0, 0.0, 0.0, sigma**2])
        return out

    @property
    def covariance(self) -> Array:
        """Their sum (6, 6)."""
        total: Array = np.sum(list(self.shares.values()), axis=0)
        return total
