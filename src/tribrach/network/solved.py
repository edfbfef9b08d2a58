"""A solved network as the solver leaves it: unknowns, residuals, covariances, by columns and rows.

:class:`~tribrach.network.adjustment.Adjustment` is the same with results by name.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeVar

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.errors import UnknownName
from tribrach.network.assembly import Assembly, Rows
from tribrach.network.datum import Cofactor, OpenMotions
from tribrach.network.network import Network
from tribrach.observations.unknowns import FAMILIES, WIDTH, Layout, State

_Kept = TypeVar("_Kept")

#: what covariances are scaled by
Scale = Literal["a priori", "a posteriori"]

#: unknowns up to which variance factors are followed into each position
_DENSE = 600
#: roundings of a value and of the unknowns behind it that a residual may consist of
_ROUNDINGS = 16


@dataclass(frozen=True)
class SolvedSystem:
    """An adjusted network: estimates, residuals, and covariances on request.

    Covariances are a priori: those given with the observations taken as they are.
    ``variance_factor`` says what scales them, ``scaled`` and ``scale`` whether it does.
    """

    network: Network  #: the network as it was adjusted, with the start values that were found
    state: State  #: adjusted unknowns in the work frame [m, rad]
    rows: Rows  #: the active observed values, in the order of the residuals
    residuals: Array  #: (n,), ``v = h(x) - l`` of the active values [m, rad]
    whitened_residuals: Array  #: (n,), ``W v``; their sum of squares is ``vtpv``
    design: sp.csr_array  #: (n, u), whitened Jacobian over the free columns, at the solution
    free_columns: Index  #: (u,), columns of the full tangent vector that are unknowns
    cofactor: Cofactor  #: cofactor matrix of the unknowns in the datum of the network
    motions: OpenMotions  #: open motions that inner constraints closed
    iterations: int  #: linearisations that were needed
    warnings: tuple[str, ...]  #: sentences of the network and of its solution
    assembly: Assembly = field(repr=False)  #: evaluates the network at any state

    @property
    def layout(self) -> Layout:
        """Names and columns of the unknowns."""
        return self.state.layout

    @property
    def n_observations(self) -> int:
        """Number of active observed values."""
        return len(self.rows)

    @property
    def n_unknowns(self) -> int:
        """Number of free unknowns."""
        return len(self.free_columns)

    @property
    def n_constraints(self) -> int:
        """Number of independent hard constraints."""
        return self.cofactor.n_constraints

    @property
    def defect(self) -> int:
        """Number of open motions closed by inner constraints."""
        return int(self.motions.basis.shape[1])

    @property
    def dof(self) -> int:
        """Redundancy ``r = n - u + q + d``."""
        return self.n_observations - self.n_unknowns + self.n_constraints + self.defect

    @property
    def vtpv(self) -> float:
        """Weighted sum of squared residuals."""
        return float(self.whitened_residuals @ self.whitened_residuals)

    @property
    def sigma0(self) -> float:
        """A-priori standard deviation of unit weight."""
        return self.network.sigma0

    @property
    def sigma0_prior(self) -> float:
        """The same by its full name, beside :attr:`sigma0_posterior`."""
        return self.network.sigma0

    @property
    def sigma0_posterior(self) -> float:
        """A-posteriori standard deviation of unit weight; NaN without redundancy."""
        return self.sigma0 * float(np.sqrt(self.posterior_factor))

    @property
    def posterior_factor(self) -> float:
        """``v^T P v / r``, which scales covariances from a priori to a posteriori; NaN if r = 0."""
        return self.vtpv / self.dof if self.dof > 0 else float("nan")

    def scaled(self, *, posterior: bool) -> bool:
        """Tell whether covariances of unknowns are a posteriori."""
        return posterior and self.dof > 0 and not self.fits_exactly

    @cached_property
    def fits_exactly(self) -> bool:
        """True if all residuals are zero but for rounding (method section 3.1)."""
        rounding = abs(self.whitener) @ np.abs(self.assembly.observed)
        rounding += abs(self.design) @ self.state.sizes[self.free_columns]
        bound = _ROUNDINGS * np.finfo(float).eps * rounding
        return bool((np.abs(self.whitened_residuals) <= bound).all())

    def scale(self, *, posterior: bool) -> Scale:
        """``scaled`` in words."""
        return "a posteriori" if self.scaled(posterior=posterior) else "a priori"

    def variance_factor(self, *, posterior: bool) -> float:
        """Return what multiplies a-priori covariances of unknowns."""
        return self.posterior_factor if self.scaled(posterior=posterior) else 1.0

    def freedom(self, *, posterior: bool) -> Array:
        """Degrees of freedom (P + S, 3) that variances of all positions have, along E, N and U.

        Infinite a priori, the redundancy a posteriori. Where variance factors were estimated they
        follow from the share of each group and the covariance of the factors (Satterthwaite 1946;
        method section 3.6), alike along E and N.
        """
        scaled = self.scaled(posterior=posterior)
        count = len(self.state.positions)
        if self.network.factors is None:
            return np.full((count, 3), float(self.dof) if scaled else np.inf)
        found = self.once("freedom", self._freedom)
        return np.minimum(found, self.dof) if scaled else found

    def _freedom(self) -> Array:
        """As :meth:`freedom`, from estimated variance factors."""
        factors = self.network.factors
        assert factors is not None
        place = self.reduced[self.layout.position_columns(np.arange(len(self.state.positions)))]
        smallest = 2 / np.diag(factors.covariance).max()
        if self.n_unknowns > _DENSE:
            return np.full(place.shape, smallest)
        q, parts = self._group_parts()
        share = np.stack([np.append(np.diag(part @ q), 0.0)[place] for part in parts])
        whole = np.append(np.diag(q), 0.0)[place]
        for one in (share, whole):
            one[..., :2] = one[..., :2].sum(axis=-1, keepdims=True)
        spread = np.einsum("gpi,gh,hpi->pi", share, factors.covariance, share)
        found = np.full(place.shape, np.inf)
        some = spread > 0
        found[some] = 2 * whole[some] ** 2 / spread[some]
        least: Array = np.maximum(found, smallest)
        return least

    def _group_parts(self) -> tuple[Array, list[Array]]:
        """``Q`` and ``Q N_g`` (u, u) of each group whose variance factor was estimated."""
        assert self.network.factors is not None
        table = np.array([o.group for o in self.network.observations], dtype=object)
        group = table[self.rows.table]
        q = self.cofactor.solve(np.eye(self.n_unknowns))
        rows = [self.design[np.flatnonzero(group == name)] for name in self.network.factors.groups]
        return q, [q @ (part.T @ part).toarray() for part in rows]

    @cached_property
    def _small_sample(self) -> Array | None:
        """What estimated factors leave out of ``Q`` (u, u); None where none were estimated.

        Weights that residuals gave are not the best ones, and make the result look better than it
        is (Kackar and Harville 1984, Kenward and Roger 1997; method section 3.6).
        """
        factors = self.network.factors
        if factors is None or self.n_unknowns > _DENSE:
            return None
        q, parts = self._group_parts()
        mean = np.zeros_like(q)
        for i, one in enumerate(parts):
            mixed = sum(w * other for w, other in zip(factors.covariance[i], parts, strict=True))
            mean += one @ (factors.covariance[i, i] * np.eye(len(q)) - mixed)
        bias = 2 * mean @ q
        out: Array = (bias + bias.T) / 2
        return out

    def once(self, key: Hashable, make: Callable[[], _Kept]) -> _Kept:
        """What several ask for, computed for the first of them."""
        kept = self.__dict__.setdefault("_kept", {})
        if key not in kept:
            kept[key] = make()
        return kept[key]  # type: ignore[no-any-return]

    @cached_property
    def whitener(self) -> sp.csr_array:
        """``W`` (n, n) with ``W C W^T = I``."""
        return self.assembly.whitener

    @cached_property
    def reduced(self) -> Index:
        """Free column number (size,) of each column of the full tangent vector, -1 if fixed."""
        return self.assembly.reduced[:-1]

    def columns(self, name: str) -> Index:
        """Columns of the full tangent vector of a named unknown."""
        try:
            family, index = self.layout.find(name)
        except KeyError:
            known = [name for family in FAMILIES for name in self.layout.names[family]]
            raise UnknownName("point, station or other unknown", name, known) from None
        return self.layout.columns(family, index)

    def covariance(self, a: str, b: str | None = None) -> Array:
        """A-priori covariance block of named unknowns: points 3, stations 6, scalars 1 wide."""
        return self.covariance_columns(self.columns(a), self.columns(a if b is None else b))

    def covariance_columns(self, a: Index, b: Index) -> Array:
        """A-priori covariance (k, l) between columns of the full tangent vector; fixed: zero."""
        i, j = self.reduced[np.asarray(a)], self.reduced[np.asarray(b)]
        out = np.zeros((len(i), len(j)))
        good = np.ix_(np.flatnonzero(i >= 0), np.flatnonzero(j >= 0))
        grid_i, grid_j = np.meshgrid(i[i >= 0], j[j >= 0], indexing="ij")
        values = self.cofactor.entries(grid_i.ravel(), grid_j.ravel())
        if self._small_sample is not None:
            values = values + self._small_sample[grid_i.ravel(), grid_j.ravel()]
        out[good] = values.reshape(grid_i.shape)
        return out

    def family_covariances(self, family: str) -> Array:
        """A-priori blocks (n, w, w) of all unknowns of a family; fixed components are zero."""
        columns = self.layout.columns(family, np.arange(self.layout.count(family)))
        if not len(columns):
            return np.zeros((0, WIDTH[family], WIDTH[family]))
        place = self.reduced[columns]
        blocks = self.cofactor.blocks(place)
        if self._small_sample is not None:
            seen = (place[:, :, None] >= 0) & (place[:, None, :] >= 0)
            blocks = blocks + seen * self._small_sample[place[:, :, None], place[:, None, :]]
        return blocks

    def position_covariances(self) -> Array:
        """A-priori 3x3 blocks (P + S, 3, 3) of all points, then of all station positions."""
        return np.concatenate(
            [self.family_covariances("point"), self.family_covariances("pose")[:, :3, :3]]
        )
