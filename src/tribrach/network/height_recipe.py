"""Heights of GNSS marks by a common recipe, to be compared with the rigorous network.

The recipe (Antova 2025, table 1) keeps the GNSS height of one mark and takes all others from a
levelled scan, ``H_i = H_ref - (Z_ref - Z_i)``; then six free parameters are fitted. The whole error
of the one height stays, and nothing holds the tilt but the recipe's heights. The network instead
weighs all heights and observes the levelling (method section 6.2). Metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.network.network import Network
from tribrach.observations.base import Use
from tribrach.observations.control import Offsets, VectorPriors
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.sentences import Sentence

_REASON = "heights by the recipe: six free parameters"


def corrected_heights(height: float, z_reference: float, z: Array) -> Array:
    """Heights (n,) of targets at z (n,) of a levelled scan, from one height and its z [m]."""
    corrected: Array = height - (z_reference - z)
    return corrected


@dataclass(frozen=True)
class _Mark:
    """A GNSS position with its target: place in the tables, rod [m], height of the target [m]."""

    table: int
    item: int
    target: int
    rod: float
    height: float
    sigma: float


def height_recipe(
    network: Network, station: str | None = None, reference: str | None = None
) -> Network:
    """Replace the heights of GNSS marks by the recipe and switch the levelling off.

    Warnings say what was changed and where GNSS and scan disagree by more than sqrt(2) sigma of a
    height.
    """
    marks = _marks(network)
    levelled = _levelled(network)
    stations = levelled if station is None else [station]
    chosen, seen = "", dict[int, float]()
    for name in stations:
        if name not in levelled:
            raise InputError(
                f"station {name} is not levelled, and the recipe needs a levelled scan",
                cure="name a levelled station",
            )
        heights = _seen(network, name)
        if sum(m.target in heights for m in marks) > sum(m.target in seen for m in marks):
            chosen, seen = name, heights
    used = [m for m in marks if m.target in seen]
    if len(used) < 2:
        raise InputError(
            "the recipe for heights needs two marks whose targets one levelled station sees",
            cure='leave heights = "recipe" out',
        )
    position = network.start.layout.position_name
    names = [position(int(_positions(network, m)[m.item])) for m in used]
    if reference is not None and reference not in names:
        raise InputError(
            f"mark {reference} has no GNSS position and target that {chosen} sees",
            cure=f"name one of {', '.join(names)}",
        )
    kept = names.index(reference) if reference is not None else 0
    return _changed(network, used, names, kept, seen, chosen)


def _changed(
    network: Network,
    marks: list[_Mark],
    names: list[str],
    kept: int,
    seen: dict[int, float],
    chosen: str,
) -> Network:
    """Heights replaced, levelling off, and what to say about it."""
    one = marks[kept]
    z = np.array([seen[m.target] for m in marks])
    given = np.array([m.height for m in marks])
    corrected = corrected_heights(one.height, z[kept], z)
    tables = list(network.observations)
    for m, change in zip(marks, corrected - given, strict=True):
        o = tables[m.table]
        assert isinstance(o, GnssPositions)
        values = o.values.copy()
        values[m.item] += change * network.site.axes(values[m.item][None])[0, 2]
        tables[m.table] = replace(o, values=values)
    words = [
        Sentence(
            "heights of marks are by the recipe: that of {names} is kept with its whole "
            "error (sigma {one.sigma:mm0}), the others follow from the scan of {chosen}; "
            "the stated covariances do not know this",
            names=names[kept],
            one=one,
            chosen=chosen,
        )
    ]
    for k, m in enumerate(marks):
        off, limit = given[k] - corrected[k], float(np.hypot(one.sigma, m.sigma))
        if abs(off) > limit:
            words.append(
                Sentence(
                    "the GNSS height of {names} is {off:mm+0} from {names2} and the scan, beyond "
                    "{limit:mm0}",
                    names=names[k],
                    off=off,
                    names2=names[kept],
                    limit=limit,
                )
            )
    for t, o in enumerate(tables):
        if isinstance(o, Inclinations):
            use = np.where(o.use == Use.ACTIVE, Use.OFF, o.use).astype(np.int8)
            reason = np.where(o.use == Use.ACTIVE, _REASON, o.reason)
            tables[t] = replace(o, use=use, reason=reason)
    return replace(network, observations=tuple(tables), warnings=(*network.warnings, *words))


def _positions(network: Network, mark: _Mark) -> NDArray[np.int64]:
    o = network.observations[mark.table]
    assert isinstance(o, GnssPositions)
    return o.position


def _marks(network: Network) -> list[_Mark]:
    """GNSS positions with the target over them, or of the target itself."""
    over: dict[int, tuple[int, float]] = {}
    for o in network.observations:
        if isinstance(o, Offsets):
            for k in np.flatnonzero(o.use == Use.ACTIVE):
                over[int(o.start[k])] = (int(o.end[k]), float(o.values[k, 2]))
    out = []
    for t, o in enumerate(network.observations):
        if not isinstance(o, GnssPositions):
            continue
        heights = network.site.height(o.values) - o.antenna_height
        up = network.site.axes(o.values)[:, 2]
        sigma = np.sqrt(np.einsum("ni,nij,nj->n", up, o.covariance, up))
        for k in np.flatnonzero(o.use == Use.ACTIVE):
            at = int(o.position[k])
            target, rod = over.get(at, (at, 0.0))
            whole = np.hypot(sigma[k], _common_sigma(network, int(o.common[k]), up[k]))
            out.append(_Mark(t, int(k), target, rod, float(heights[k]) + rod, float(whole)))
    return out


def _common_sigma(network: Network, vector: int, up: Array) -> float:
    """Sigma [m] of the height of a session's common shift; zero if there is none."""
    if vector < 0:
        return 0.0
    for o in network.observations:
        if isinstance(o, VectorPriors):
            for k in np.flatnonzero(o.vector == vector):
                return float(np.sqrt(up @ o.covariance[k] @ up))
    return 0.0


def _levelled(network: Network) -> list[str]:
    """Stations with an active inclination."""
    names = network.start.layout.names["pose"]
    out: dict[str, None] = {}
    for o in network.observations:
        if isinstance(o, Inclinations):
            out |= {names[int(o.station[k])]: None for k in np.flatnonzero(o.use == Use.ACTIVE)}
    return list(out)


def _seen(network: Network, station: str) -> dict[int, float]:
    """Mean z [m] of each target in the scans of a station, by position index."""
    pose = network.start.layout.index("pose", station)
    z: dict[int, list[float]] = {}
    for o in network.observations:
        if isinstance(o, TargetCentres):
            for k in np.flatnonzero((o.use == Use.ACTIVE) & (o.station == pose)):
                z.setdefault(int(o.target[k]), []).append(float(o.values[k, 2]))
    return {target: float(np.mean(values)) for target, values in z.items()}
