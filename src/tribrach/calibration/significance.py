"""Tests calibration parameters, parameters that were left out, and stations against each other.

Every parameter has its t-test, all together an F-test. Parameters that are no unknowns are tested
by what they would explain of the residuals (:mod:`~tribrach.calibration.extra_columns`): so a wrong
or too small model shows, and sets that differ between stations do (method section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach.answers import Number, Result
from tribrach.calibration.extra_columns import model_columns, unexplained
from tribrach.instruments.calibration import CalibrationModel, meaning_of, unit_of
from tribrach.network.adjustment import Adjustment
from tribrach.network.significance import sidak
from tribrach.observations.scanner import ScannerPolar
from tribrach.statistics import chi2, f, norm

#: part of a column that is still there after the unknowns are taken out
_RANK = 1e-6


@dataclass(frozen=True)
class BlockTest(Result, without=("posterior",), also=("kind",)):
    """Several parameters tested against zero together."""

    freedom: int  #: number of parameters tested
    redundancy: int  #: of the adjustment
    #: quadratic form over its degrees of freedom: F or chi-square over freedom, see ``kind``
    statistic: Number
    p: Number  #: probability of as much by chance
    posterior: bool  #: true if sigma0 is a posteriori

    @property
    def kind(self) -> str:
        """What the statistic is."""
        return "F" if self.posterior else "chi-square over freedom"


@dataclass(frozen=True)
class Omitted(Result):
    """A parameter that was not estimated, with its score test against zero."""

    name: str
    #: as one further unknown [m, rad or 1]
    value: Number
    sigma: Number
    w: Number  #: standard normal if it is zero
    limit: Number  #: of w for all such tests together

    @property
    def unit(self) -> str:
        """``m``, ``rad`` or ``1``."""
        return unit_of(self.name)

    @property
    def meaning(self) -> str:
        """Its meaning, such as ``collimation axis error``."""
        return meaning_of(self.name)

    @property
    def missing(self) -> bool:
        """True if the residuals call for it."""
        return abs(self.w) > self.limit


def block_test(adjustment: Adjustment, names: Sequence[str], *, posterior: bool) -> BlockTest:
    """Test scalars against zero together."""
    columns = np.concatenate([adjustment.columns(name) for name in names])
    layout = adjustment.layout
    values = adjustment.state.scalars[[layout.index("scalar", name) for name in names]]
    covariance = adjustment.covariance_columns(columns, columns)
    size = np.sqrt(np.diag(covariance))
    unit = values / size
    form = float(unit @ np.linalg.solve(covariance / np.outer(size, size), unit))
    return _block(form, len(names), adjustment, posterior)


def _block(form: float, freedom: int, adjustment: Adjustment, posterior: bool) -> BlockTest:
    """A quadratic form of a-priori weights as a test."""
    dof = adjustment.dof
    if adjustment.scaled(posterior=posterior):
        statistic = form / freedom / adjustment.posterior_factor
        return BlockTest(freedom, dof, statistic, float(f.sf(statistic, freedom, dof)), True)
    return BlockTest(freedom, dof, form / freedom, float(chi2.sf(form, freedom)), False)


def omitted_parameters(
    adjustment: Adjustment, model: CalibrationModel, alpha: float = 0.05, factor: float = 1.0
) -> list[Omitted]:
    """Test each parameter of a model as the only further unknown, if no unknowns imitate it."""
    given = model_columns(adjustment.assembly, adjustment.state, model)
    rest = unexplained(adjustment.design, adjustment.cofactor, given)
    # white residuals are v; the misclosure that a parameter would explain is -v
    pull = rest.T @ -adjustment.whitened_residuals
    length = np.linalg.norm(given, axis=0)
    own = np.linalg.norm(rest, axis=0)
    seen = own > _RANK * np.maximum(length, 1e-300)
    limit = float(norm.isf(sidak(alpha, int(seen.sum())) / 2))
    root = float(np.sqrt(factor))
    return [
        Omitted(
            model.parameters[k],
            float(pull[k] / own[k] ** 2),
            float(root / own[k]),
            float(pull[k] / own[k] / root),
            limit,
        )
        for k in np.flatnonzero(seen)
    ]


def station_test(
    adjustment: Adjustment, model: CalibrationModel, *, posterior: bool
) -> BlockTest | None:
    """Test whether stations of the same instrument have different parameters.

    Tested are deviations of every station but the first, as far as the unknowns (a common set for
    the stations of each instrument) cannot take them up.
    """
    stations = np.unique(
        np.concatenate(
            [
                np.empty(0, dtype=np.int64),
                *(
                    o.station
                    for o in adjustment.network.observations
                    if isinstance(o, ScannerPolar)
                ),
            ]
        )
    )
    poses = adjustment.layout.count("pose")
    if len(stations) < 2 or len(stations) * len(model.parameters) > 400:
        return None
    parts = []
    for station in stations[1:]:
        mask = np.zeros(poses, dtype=bool)
        mask[station] = True
        parts.append(model_columns(adjustment.assembly, adjustment.state, model, mask))
    given = np.hstack(parts)
    rest = unexplained(adjustment.design, adjustment.cofactor, given)
    length = np.linalg.norm(given, axis=0)
    unit = rest / np.where(length > 0, length, 1.0)
    left, value, _ = np.linalg.svd(unit, full_matrices=False)
    good = value > _RANK
    if not good.any():
        return None
    form = float(((left[:, good].T @ adjustment.whitened_residuals) ** 2).sum())
    freedom = int(good.sum())
    if not adjustment.scaled(posterior=posterior) or adjustment.dof <= freedom:
        return _block(form, freedom, adjustment, False)
    remaining = (adjustment.vtpv - form) / (adjustment.dof - freedom)
    statistic = form / freedom / remaining
    p = float(f.sf(statistic, freedom, adjustment.dof - freedom))
    return BlockTest(freedom, adjustment.dof - freedom, statistic, p, True)
