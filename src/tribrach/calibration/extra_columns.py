"""Computes what parameters that are no unknowns of a network would explain.

For columns ``G`` of parameters that are not unknowns, ``M = (I - A Q A^T) G`` is what the other
unknowns cannot imitate. ``M^T M`` is their normal matrix after the others are eliminated, and with
the whitened residuals ``v`` the vector ``M^T v`` tests whether they are zero (Rao's score test;
data snooping with columns of a model in place of single observations).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.instruments.calibration import CalibrationModel
from tribrach.network import defects
from tribrach.network.assembly import Assembly
from tribrach.network.datum import Cofactor, OpenMotions, open_motions, point_numbers
from tribrach.network.linear import PIVOT_LIMIT, SingularMatrix
from tribrach.network.network import Network
from tribrach.observations.scanner import ScannerPolar
from tribrach.observations.unknowns import State


@dataclass(frozen=True)
class System:
    """A network linearised at a state."""

    assembly: Assembly  #: the network
    state: State  #: the unknowns
    design: sp.csr_array  #: (n, u), whitened Jacobian over the free columns
    cofactor: Cofactor  #: cofactor matrix of the unknowns
    motions: OpenMotions  #: open motions, which are pinned


def linearise(network: Network, state: State, held: Index) -> System:
    """Linearise a network with some columns held; what the datum leaves open is pinned."""
    free = network.free.copy()
    free[held] = False
    reduced = replace(network, free=free, start=state)
    assembly = Assembly(reduced)
    design = assembly.design(state)
    constraints, _ = assembly.constraints(state)
    motions = open_motions(design, state, assembly.free_columns, constraints)
    mask = defects.datum_mask(reduced, assembly.free_columns)
    if motions.basis.shape[1]:
        mask = np.ones(len(assembly.free_columns), dtype=bool)
    transposed = sp.csr_array(design.T)
    normal = sp.csc_array(transposed @ design)
    points = point_numbers(state.layout, assembly.free_columns)
    cofactor = Cofactor(normal, points, constraints, motions.basis, mask)
    if cofactor.factor.smallest_pivot < PIVOT_LIMIT:
        raise SingularMatrix("unknowns besides the parameters cannot be separated")
    return System(assembly, state, design, cofactor, motions)


def unexplained(design: sp.csr_array, cofactor: Cofactor, columns: Array) -> Array:
    """``M = (I - A Q A^T) G`` (n, k); projected twice, since one pass leaves rounding behind."""
    rest = columns
    transposed = sp.csr_array(design.T)
    for _ in range(2):
        rest = rest - design @ cofactor.solve(transposed @ rest)
    return rest


def model_columns(
    assembly: Assembly,
    state: State,
    model: CalibrationModel,
    station: NDArray[np.bool_] | None = None,
) -> Array:
    """Whitened derivatives (n, k) of polar observations by a model's parameters; zero of others."""
    out = np.zeros((len(assembly.rows), len(model.parameters)))
    first = 0
    tables = zip(assembly.network.observations, assembly.active, strict=True)
    for o, items in tables:
        rows = len(items) * o.rows
        if isinstance(o, ScannerPolar) and rows:
            b = o.parameter_columns(state, model)[items]
            if station is not None:
                b = b * station[o.station[items]][:, None, None]
            out[first : first + rows] = b.reshape(rows, -1)
        first += rows
    for k in range(out.shape[1]):
        out[:, k] = assembly.whiten(out[:, k])
    return out
