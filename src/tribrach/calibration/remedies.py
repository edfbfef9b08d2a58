"""Tries out what further observations would separate parameters that a network cannot.

The network is linearised with further observations that nobody has made yet: the back face, high
and low targets, another station, a known length (method sections 3.2, 3.7 and 4.2). Only the design
is needed for that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.answers import Result, Vector
from tribrach.calibration.estimability import EstimableSet, propose
from tribrach.geometry.polar import NEAREST, POLE, polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.network.linear import SingularMatrix
from tribrach.network.network import Constraint, Network
from tribrach.observations.base import Observations, Use, covariance_from_sigma
from tribrach.observations.scanner import ScannerPolar
from tribrach.observations.sights import Distances
from tribrach.observations.unknowns import Layout, State

#: networks with more unknowns are not tried out
_MOST = 6000
#: sigma of the known length [m]
_LENGTH_SIGMA = 1e-4
#: zenith angles [rad] and distance [m] of the targets above and below a station
_STEEP, _STEEP_RANGE = np.radians([20.0, 40.0, 130.0]), 3.0


@dataclass(frozen=True)
class Remedy(Result, without=("proposal",), also=("estimable", "well_separated", "sigma")):
    """Parameters that an addition to the network would make estimable."""

    what: str  #: the addition in words
    proposal: EstimableSet  #: parameters that could be estimated with it

    @property
    def estimable(self) -> tuple[str, ...]:
        """Parameters that could be estimated with it."""
        return self.proposal.names

    @property
    def well_separated(self) -> tuple[str, ...]:
        """The parameters that are well separated from others."""
        return self.proposal.recommended

    @property
    def sigma(self) -> Vector:
        """Their standard deviations a priori [m, rad or 1]."""
        return self.proposal.sigma


def remedies(
    network: Network, state: State, names: Sequence[str], near: float, *, back: bool = True
) -> list[Remedy]:
    """Try every addition that makes sense in a network."""
    if int(network.free.sum()) > _MOST:
        return []
    tables = [
        o
        for o in network.observations
        if isinstance(o, ScannerPolar) and o.model is not None and (o.use == Use.ACTIVE).any()
    ]
    if not tables:
        return []
    attempts: list[tuple[str, Callable[[], tuple[Network, State]]]] = []
    if back and not any((o.face < 0).any() for o in tables):
        attempts.append(("the back face of every target", lambda: _faces(network, state, tables)))
    attempts.append(
        ("targets high above and low below every station", lambda: _steep(network, state, tables))
    )
    if len({o.parameters[0].tobytes() for o in tables}) == 1:
        attempts.append(
            ("another station with another heading", lambda: _station(network, state, tables))
        )
    attempts.append(("a known length between two targets", lambda: _length(network, state, tables)))
    out = []
    for what, build in attempts:
        grown, at = build()
        try:
            out.append(Remedy(what, propose(grown, at, names, near)))
        except SingularMatrix:
            continue
    return out


def _like(
    o: ScannerPolar, state: State, station: Index, target: Index, face: float
) -> ScannerPolar:
    """Observations with the model and the mean precision of a table; what is too near is left out.

    Values are those of the state, so that nothing is refused; only the design matters.
    """
    sigma = np.sqrt(np.einsum("nii->ni", o.covariance)).mean(axis=0)
    chord = state.positions[target] - state.pose_t[station]
    polar = polar_from_xyz(np.einsum("nji,nj->ni", state.pose_r[station], chord))
    good = (polar[:, 0] > NEAREST) & (np.sin(polar[:, 2]) > np.sin(POLE))
    n = int(good.sum())
    return ScannerPolar(
        values=polar[good],
        covariance=np.broadcast_to(covariance_from_sigma(sigma[None])[0], (n, 3, 3)).copy(),
        station=station[good],
        target=target[good],
        face=np.full(n, face),
        model=o.model,
        parameters=np.repeat(o.parameters[:1], n, axis=0),
    )


def _faces(network: Network, state: State, tables: list[ScannerPolar]) -> tuple[Network, State]:
    """The same sights on the back face."""
    further: list[Observations] = [_like_each(o, state) for o in tables]
    return add_observations(network, further), state


def _like_each(o: ScannerPolar, state: State) -> ScannerPolar:
    """The same sights on the back face, each with its own parameters."""
    items = np.flatnonzero(o.use == Use.ACTIVE)
    face = np.full(len(items), -1.0)
    return replace(replace_items(o, items), values=o.predict(state)[items], face=face)


def _steep(network: Network, state: State, tables: list[ScannerPolar]) -> tuple[Network, State]:
    """Targets around the axis of every station, seen from all stations."""
    azimuth = np.radians([10.0, 130.0, 250.0])
    v, h = (a.ravel() for a in np.meshgrid(_STEEP, azimuth, indexing="ij"))
    beam = np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=1)
    stations = np.unique(np.concatenate([o.station for o in tables]))
    around = [state.pose_t[s] + _STEEP_RANGE * beam @ state.pose_r[s].T for s in stations]
    points = np.concatenate(around)
    first = state.layout.count("point")
    new = Addition(tuple(f"steep target {k + 1}" for k in range(len(points))), points)
    grown, at = enlarged(network, state, new)
    targets = first + np.arange(len(points))
    return add_observations(grown, _seen_by_all(tables, at, targets)), at


def _seen_by_all(tables: list[ScannerPolar], at: State, targets: Index) -> list[Observations]:
    """New targets from every station with its own model, on the faces that it has."""
    out: list[Observations] = []
    for o in tables:
        for s in np.unique(o.station):
            members = np.flatnonzero(o.station == s)
            for face in np.unique(o.face[members]):
                sample = replace_items(o, members[:1])
                out.append(_like(sample, at, np.full(len(targets), s), targets, float(face)))
    return out


def _station(network: Network, state: State, tables: list[ScannerPolar]) -> tuple[Network, State]:
    """A station beside the middle of the others, turned by 120 degrees, that sees all targets."""
    o = tables[0]
    targets = np.unique(np.concatenate([t.target for t in tables]))
    seen = state.positions[targets]
    middle = state.pose_t[np.unique(o.station)].mean(axis=0)
    place = middle + 0.21 * (np.quantile(seen, 0.8, axis=0) - middle)
    turn = exp(np.array([0.02, -0.01, 2.1])) @ state.pose_r[o.station[0]]
    new = Addition(pose_names=("another station",), translations=place[None], rotations=turn[None])
    grown, at = enlarged(network, state, new)
    number = at.layout.count("pose") - 1
    further: list[Observations] = [
        _like(o, at, np.full(len(targets), number), targets, float(face))
        for face in np.unique(np.concatenate([t.face for t in tables]))
    ]
    return add_observations(grown, further), at


def _length(network: Network, state: State, tables: list[ScannerPolar]) -> tuple[Network, State]:
    """A length across the network."""
    targets = np.unique(np.concatenate([o.target for o in tables]))
    x = state.positions[targets]
    start = int(np.argmax(np.linalg.norm(x - x.mean(axis=0), axis=1)))
    end = int(np.argmax(np.linalg.norm(x - x[start], axis=1)))
    length = float(np.linalg.norm(x[end] - x[start]))
    bar = Distances(
        values=np.array([[length]]),
        covariance=np.array([[[_LENGTH_SIGMA**2]]]),
        start=np.array([targets[start]]),
        end=np.array([targets[end]]),
    )
    return add_observations(network, [bar]), state


@dataclass(frozen=True)
class Addition:
    """Points and stations that are added to a network."""

    point_names: tuple[str, ...] = ()  #: names of the points
    points: Array | None = None  #: (p, 3), their places [m]
    pose_names: tuple[str, ...] = ()  #: names of the stations
    translations: Array | None = None  #: (s, 3), their places [m]
    rotations: Array | None = None  #: (s, 3, 3), world from scanner


def enlarged(network: Network, state: State, new: Addition) -> tuple[Network, State]:
    """Add free points and stations to a network and its state, before any observation of them."""
    old, p = state.layout, len(new.point_names)
    names = old.names
    layout = Layout(
        (*names["point"], *new.point_names),
        (*names["pose"], *new.pose_names),
        names["plane"],
        names["vector"],
        names["scalar"],
    )
    cut = 3 * old.count("point"), old.offset["plane"]
    poses = 6 * len(new.pose_names)

    def mask(given: NDArray[np.bool_], value: bool) -> NDArray[np.bool_]:
        parts = [given[: cut[0]], np.full(3 * p, value), given[cut[0] : cut[1]]]
        return np.concatenate([*parts, np.full(poses, value), given[cut[1] :]])

    datum = network.datum
    if datum.components is not None:
        datum = replace(datum, components=mask(datum.components, False))
    grown = replace(
        state,
        layout=layout,
        points=_joined(state.points, new.points),
        pose_t=_joined(state.pose_t, new.translations),
        pose_r=_joined(state.pose_r, new.rotations),
    )
    count = old.count("point")
    moved = replace(
        network,
        start=grown,
        free=mask(network.free, True),
        observations=tuple(_moved(o, count, p) for o in network.observations),
        constraints=tuple(
            Constraint(_moved(c.observations, count, p), c.label) for c in network.constraints
        ),
        datum=datum,
    )
    return moved, grown


def _joined(old: Array, new: Array | None) -> Array:
    """Old and new rows."""
    return old if new is None else np.concatenate([old, new])


def _moved(o: Observations, count: int, by: int) -> Observations:
    """Observations whose positions of stations come after more points."""
    changes = {}
    for reference in o.references():
        if reference.family == "position":
            index = getattr(o, reference.name)
            changes[reference.name] = np.where(index >= count, index + by, index)
    return replace(o, **changes) if changes and by else o


def add_observations(network: Network, further: Sequence[Observations]) -> Network:
    """The network with more observations."""
    return replace(network, observations=(*network.observations, *further))


def replace_items(o: ScannerPolar, items: Index) -> ScannerPolar:
    """Some observations of a table."""
    return replace(
        o,
        values=o.values[items],
        covariance=o.covariance[items],
        source=o.source[items],
        use=o.use[items],
        reason=o.reason[items],
        station=o.station[items],
        target=o.target[items],
        face=o.face[items],
        parameters=o.parameters[items],
    )
