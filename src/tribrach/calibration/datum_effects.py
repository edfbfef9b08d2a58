"""Shows what the choice of the datum does to sigmas, and what it does not.

The same observations in several datums (S-transformations of one another, method section 3.2):
distances between points and estimable parameters keep their sigmas, coordinates and poses do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Index
from tribrach.answers import Matrix, Result, Vector
from tribrach.calibration.extra_columns import linearise
from tribrach.network.adjustment import Adjustment
from tribrach.network.datum import Cofactor
from tribrach.network.defects import datum_mask
from tribrach.network.network import Datum, Network
from tribrach.observations.unknowns import State

#: pairs of points whose distance is looked at
_PAIRS = 60


@dataclass(frozen=True)
class DatumSigmas(Result):
    """Standard deviations of the same observations in one datum."""

    datum: str  #: the datum in words
    parameters: Vector  #: of the parameters [m, rad or 1]
    stations: Matrix  #: of E, N, U [m], tilts and heading [rad] of each station
    points: dict[str, Vector]  #: of E, N, U of each point [m]
    distances: Vector  #: of distances between some pairs of points, which are estimable [m]

    @property
    def of_points(self) -> Array:
        """Sigmas of the points (P, 3)."""
        return np.array(list(self.points.values())).reshape(-1, 3)


def datum_effects(adjustment: Adjustment, names: Sequence[str]) -> list[DatumSigmas]:
    """Compute sigmas in the datum of the adjustment, and in others that the observations allow.

    The others are inner constraints over all points, and the first station held.
    """
    network, state = adjustment.network, adjustment.state
    out = [sigmas_of("as adjusted", adjustment, names)]
    if network.datum.kind == "control":
        return out
    stations = state.layout.names["pose"]
    first = stations[0] if stations else None
    if network.datum != Datum("free"):
        out.append(_in_datum("inner constraints over all points", network, state, None, names))
    if first is not None and network.datum != Datum("fixed", (first,)):
        out.append(_in_datum(f"station {first} held", network, state, first, names))
    return out


def _in_datum(
    words: str, network: Network, state: State, held: str | None, names: Sequence[str]
) -> DatumSigmas:
    """Sigmas with a station held, or with inner constraints over all points."""
    layout = state.layout
    released = network.with_datum(Datum("free")).free.copy()
    released[: layout.offset["plane"]] = True
    free = replace(network.with_datum(Datum("free")), free=released, start=state)
    none = np.empty(0, dtype=np.int64)
    if held is not None:
        none = layout.columns("pose", layout.index("pose", held))
    system = linearise(free, state, none)
    if held is None and system.motions.basis.shape[1]:
        constraints, _ = system.assembly.constraints(state)
        mask = datum_mask(free, system.assembly.free_columns)
        normal = system.design.T @ system.design
        points = np.where(
            system.assembly.free_columns < 3 * layout.count("point"),
            system.assembly.free_columns // 3,
            -1,
        )
        cofactor = Cofactor(normal.tocsc(), points, constraints, system.motions.basis, mask)
    else:
        cofactor = system.cofactor
    return _collect(words, state, cofactor, system.assembly.reduced[:-1], names)


def sigmas_of(words: str, adjustment: Adjustment, names: Sequence[str]) -> DatumSigmas:
    """Sigmas of an adjustment."""
    reduced = adjustment.reduced
    return _collect(words, adjustment.state, adjustment.cofactor, reduced, names)


def _collect(
    words: str, state: State, cofactor: Cofactor, reduced: Index, names: Sequence[str]
) -> DatumSigmas:
    """Sigmas of parameters, stations, points and distances by a cofactor matrix."""
    layout = state.layout

    def sigma(columns: Index) -> Array:
        place = reduced[columns]
        out = np.zeros(len(columns))
        free = place >= 0
        values = cofactor.entries(place[free], place[free])
        out[free] = np.sqrt(np.maximum(values, 0.0))
        return out

    index = np.array([layout.index("scalar", name) for name in names], dtype=np.int64)
    poses, points = (layout.columns(n, np.arange(layout.count(n))) for n in ("pose", "point"))
    return DatumSigmas(
        words,
        sigma(layout.columns("scalar", index).ravel()),
        sigma(poses.ravel()).reshape(-1, 6),
        dict(zip(layout.names["point"], sigma(points.ravel()).reshape(-1, 3), strict=True)),
        distance_sigmas(state, cofactor, reduced),
    )


def distance_sigmas(state: State, cofactor: Cofactor, reduced: Index) -> Array:
    """Sigmas (m,) [m] of distances between some pairs of points, the same pairs every time."""
    layout = state.layout
    count = layout.count("point")
    if count < 2:
        return np.empty(0)
    rng = np.random.default_rng(0)
    a = rng.integers(0, count, _PAIRS)
    b = (a + rng.integers(1, count, _PAIRS)) % count
    chord = state.points[b] - state.points[a]
    unit = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    columns = np.stack([layout.columns("point", a), layout.columns("point", b)], axis=1)
    place = reduced[columns].reshape(_PAIRS, 6)
    row = np.concatenate([-unit, unit], axis=1)
    blocks = cofactor.blocks(place)
    out: Array = np.sqrt(np.maximum(np.einsum("mi,mij,mj->m", row, blocks, row), 0.0))
    return out
