"""Observations of a network drawn anew from its own stochastic model.

Used by demonstrations, by planning and by every Monte Carlo check: the true state gives the
values, the covariances give the errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse.linalg as sla

from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.network.unknowns import State

__all__ = ["observe"]


def observe(network: Network, truth: State, rng: np.random.Generator) -> Network:
    """The network with active values ``h(truth) + W^-1 z`` and z standard normal.

    Inactive observations keep their values; the truth becomes the start of the iteration.
    """
    assembly = Assembly(network)
    errors = sla.spsolve_triangular(
        assembly.whitener, rng.standard_normal(len(assembly.rows)), lower=True
    )
    observations, first = [], 0
    for o, items in zip(network.observations, assembly.active, strict=True):
        size = len(items) * o.rows
        values = o.values.copy()
        values[items] = o.predict(truth)[items] + errors[first : first + size].reshape(-1, o.rows)
        observations.append(replace(o, values=values))
        first += size
    return replace(network, observations=tuple(observations), start=truth)
