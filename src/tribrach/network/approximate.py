"""Start values of all unknowns, found from the observations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach.errors import NoStartValues
from tribrach.network.network import Network
from tribrach.network.unknowns import State

__all__ = ["find_start"]


def find_start(network: Network) -> State:
    """Start values (m, rad, work frame); NoStartValues names what cannot be found."""
    start = network.start
    state = replace(start, scalars=np.nan_to_num(start.scalars))
    missing = state.missing()
    if missing:
        raise NoStartValues("no start values", [f"{f} {n} has none" for f, n in missing])
    return state
