"""The two-face test of a scanner: half differences of the faces and what they point to.

With true = measured + Delta each half difference of front and back is *minus* the part of Delta
that changes its sign with the face:

* ``dR = -x2 sin V``
* ``dH = -(x3 / (R sin V) + 2 x6 / sin V - (x5z + x7) cot V - x1z cot V / R``
  ``+ x8x sin H - x8y cos H)``
* ``dV = -(x4 + (x1n + x2) cos V / R + (x5n + x9n) cos V + x12a cos 2V)``

(method sections 4.1 and 4.4; Muralikrishnan et al. 2015). Without misalignments they are noise of
zero mean, so that each sum of weighted squares is a chi-square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result, Test
from tribrach.calibration.misalignment_search import Explanation, explain
from tribrach.calibration.scanner_readings import FacePairs
from tribrach.instruments.calibration import NIST
from tribrach.statistics import chi2, norm

#: parameters that change sign with the face, one for each signature
SIGNATURES = ("x2", "x4", "x6", "x3", "x7", "x9n", "x1n", "x1z", "x8x", "x8y", "x12a")
#: shift of a test value that is found with 80 % at 0.1 % (Baarda 1968)
_SHIFT = float(norm.ppf(0.9995) + norm.ppf(0.8))
#: readings whose half differences are tested
COMPONENTS = ("range", "horizontal", "zenith")


@dataclass(frozen=True)
class ComponentTest(Test, without=("largest", "at")):
    """Half differences of both faces of one reading against noise."""

    reading: str  #: ``range``, ``horizontal`` or ``zenith``
    #: root mean square of the half differences [m, rad], and across or along the beam [m]
    rms: Number
    rms_metres: Number
    #: the largest half difference [m, rad], and its station and target
    largest: float
    at: str


@dataclass(frozen=True)
class TwoFaceTest(Result, also=("passed",), without=("pairs", "alpha")):
    """The comparison of both faces, and what it points to."""

    pairs: FacePairs  #: half differences of the faces
    #: of range, horizontal and zenith angle
    components: tuple[ComponentTest, ...]
    explanation: Explanation
    #: smallest misalignment of each signature, alone, that is found with 80 % at an error
    #: probability of 0.1 % [m or rad]; null where the readings do not show it
    detectable: dict[str, Number]
    alpha: float  #: error probability of the components and of the signatures together

    @property
    def passed(self) -> bool:
        """True if no component and no parameter is more than noise."""
        return all(c.passed for c in self.components) and not self.explanation.causes


def signatures(polar: Array) -> Array:
    """Half differences (n, 3, k) of each parameter of one, in the order of :data:`SIGNATURES`."""
    model = NIST.select(SIGNATURES)
    r, h, v = polar.T
    front, back = (model.columns(r, h, v, np.full(len(r), face)) for face in (1.0, -1.0))
    out: Array = -(front - back) / 2
    return out


def two_face_test(pairs: FacePairs, alpha: float = 0.05) -> TwoFaceTest:
    """Test half differences of faces against noise and find their causes (method section 4.4)."""
    n = len(pairs)
    lower = np.linalg.cholesky(pairs.covariance)
    # three components, and all signatures together
    each = 1 - (1 - alpha) ** (1 / 4)
    alpha0 = min(0.001, 1 - (1 - each) ** (1 / len(SIGNATURES)))
    sigma = np.sqrt(np.einsum("nii->ni", pairs.covariance))
    across = np.stack(
        [np.ones(n), pairs.polar[:, 0] * np.sin(pairs.polar[:, 2]), pairs.polar[:, 0]], axis=1
    )
    components = []
    for k, name in enumerate(COMPONENTS):
        half = pairs.half[:, k]
        statistic = float(np.sum((half / sigma[:, k]) ** 2))
        worst = int(np.argmax(np.abs(half) / sigma[:, k]))
        components.append(
            ComponentTest(
                reading=name,
                rms=float(np.sqrt(np.mean(half**2))),
                rms_metres=float(np.sqrt(np.mean((half * across[:, k]) ** 2))),
                largest=float(half[worst]),
                at=f"{pairs.station[worst]} -> {pairs.target[worst]}",
                statistic=statistic,
                dof=n,
                limit=float(chi2.ppf(1 - each, n)),
                p=float(chi2.sf(statistic, n)),
            )
        )
    white = np.linalg.solve(lower, pairs.half[:, :, None])[:, :, 0].ravel()
    columns = np.linalg.solve(lower, signatures(pairs.polar)).reshape(3 * n, -1)
    length = np.linalg.norm(columns, axis=0)
    least = np.where(length > 0, _SHIFT / np.where(length > 0, length, 1.0), np.inf)
    explanation = explain(SIGNATURES, columns, white, alpha0, each)
    detectable = dict(zip(SIGNATURES, least.tolist(), strict=True))
    return TwoFaceTest(pairs, tuple(components), explanation, detectable, alpha)
