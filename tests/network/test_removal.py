"""What one observation does, predicted, against the adjustment without it or with it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.network.networks import scanner_network
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.snooping import restart
from tribrach.network.network import Datum, JointCovariance, Network
from tribrach.network.removal import what_if
from tribrach.observations.base import Use


def correlated(network: Network) -> Network:
    """The first three observations of the largest table share a part of their errors."""
    table = int(np.argmax([len(o) for o in network.observations]))
    o = network.observations[table]
    k = 3 * o.rows
    own = np.zeros((k, k))
    for item in range(3):
        part = slice(item * o.rows, (item + 1) * o.rows)
        own[part, part] = o.covariance[item]
    common = 0.4 * own.diagonal().min() * np.ones((k, k))
    item, row = np.repeat(np.arange(3), o.rows), np.tile(np.arange(o.rows), 3)
    joint = JointCovariance(np.full(k, table), item, row, own + common)
    covariance = o.covariance.copy()
    covariance[:3] += common[0, 0]
    tables = list(network.observations)
    tables[table] = replace(o, covariance=covariance)
    return replace(network, observations=tuple(tables), joint=(joint,))


def both_ways(network: Network, table: int, item: int) -> tuple[Adjustment, Adjustment]:
    """With the observation, and without it from there."""
    whole = adjust(network)
    return whole, adjust(restart(whole.network.switched([(table, item)], Use.OFF, "x"), whole))


@pytest.mark.parametrize("kind", ["plain", "correlated", "free"])
def test_every_kind_of_observation(kind: str) -> None:
    network = scanner_network(np.random.default_rng(11))[0].network()
    if kind == "correlated":
        network = correlated(network)
    if kind == "free":
        network = network.with_datum(Datum("free"))
    tried = 0
    for table, o in enumerate(network.observations):
        for item in np.flatnonzero(o.use == Use.ACTIVE)[:4].tolist():
            whole, less = both_ways(network, table, item)
            out = what_if(whole, table, item)
            assert out.takes_part
            assert not out.needed
            assert out.dof == less.dof
            assert out.vtpv == pytest.approx(less.vtpv, rel=1e-3)
            scale = 1e-9 + np.abs(less.state.positions - whole.state.positions).max()
            moved = less.state.positions - whole.state.positions
            np.testing.assert_allclose(out.moved, moved, atol=0.01 * scale)
            tried += 1
            if kind == "correlated" and any((j.table == table).any() for j in network.joint):
                continue  # a prediction knows nothing of values that it is correlated with
            back = what_if(less, table, item)
            assert not back.takes_part
            assert back.vtpv == pytest.approx(whole.vtpv, rel=1e-3)
            np.testing.assert_allclose(back.moved, -moved, atol=0.01 * scale)
    assert tried >= 4
