"""Effects that are no unknowns: what they do to a network is what adjusting it with them does."""

import numpy as np
import pytest

from tests.network.facade import STATIONS, TARGETS, facade
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.rotation import exp, log
from tribrach.instruments.common_errors import COMMON, RANGE_SCALE, REFRACTION
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.considered import Considered, influence_of
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.scanner import Inclinations, ScannerPolar, TargetCentres
from tribrach.units import SEC

EFFECTS = {RANGE_SCALE: 1e-4, REFRACTION: 20.0}


def with_polar() -> Survey:
    """The facade with polar readings in the place of centres, some of the back face."""
    polar = Survey()
    names = [f"T{k}" for k in range(len(TARGETS))]
    for name, x in zip(names, TARGETS, strict=True):
        polar.point(name, x)
    polar.add(Coordinates, values=TARGETS, sigma=0.001, position=names, group="control")
    for k, (name, (place, heading)) in enumerate(STATIONS.items()):
        r = exp(np.array([0.0, 0.0, heading]))
        polar.station(name, translation=np.array(place), rotation=r)
        seen = polar_from_xyz((TARGETS - place) @ r)
        if k:
            seen[:, 1], seen[:, 2] = seen[:, 1] + np.pi, 2 * np.pi - seen[:, 2]
        sigma = np.tile([0.001, 10 * SEC, 10 * SEC], (len(names), 1))
        polar.add(ScannerPolar, values=seen, sigma=sigma, station=[name] * len(names), target=names)
        polar.add(Inclinations, values=[[0.0, 0.0]], sigma=3 * SEC, station=[name])
    return polar


def corrected(network: Network, effect: str, c: float, stations: list[str]) -> Network:
    """The network with the readings of these stations corrected by an effect of size c."""
    model = COMMON.select([effect])
    names = list(STATIONS)
    for o in network.observations:
        if not isinstance(o, ScannerPolar | TargetCentres):
            continue
        wanted = np.array([names[k] in stations for k in o.station])
        values = polar_from_xyz(o.values) if isinstance(o, TargetCentres) else o.folded()
        r, h, v = values.T
        delta = np.where(wanted[:, None], c * model.columns(r, h, v, np.ones(len(o)))[:, :, 0], 0)
        if isinstance(o, TargetCentres):
            o.values[:] = xyz_from_polar(values + delta)
        else:
            raw = o.values[:, 2] > np.pi
            o.values += delta * np.where(raw[:, None], [1, 1, -1], [1, 1, 1])
    return network


def poses(adjustment: Adjustment, before: Adjustment | None = None) -> np.ndarray:
    """Increments of all poses against another adjustment."""
    assert before is not None
    state, old = adjustment.state, before.state
    turn = log(state.pose_r @ old.pose_r.transpose(0, 2, 1))
    return np.concatenate([state.pose_t - old.pose_t, turn], axis=1).ravel()


@pytest.mark.parametrize("effect", list(EFFECTS))
@pytest.mark.parametrize("survey", [facade, with_polar])
@pytest.mark.parametrize("stations", [["S1"], ["S1", "S2"]])
def test_what_an_effect_does_is_what_adjusting_with_it_does(effect, survey, stations) -> None:
    before = adjust(survey().network())
    columns = np.concatenate([before.columns(name) for name in STATIONS])
    c = EFFECTS[effect]
    model = COMMON.select([effect])
    stated = influence_of(before, [Considered(model, set(stations))], columns)[:, 0] * c
    both = [adjust(corrected(survey().network(), effect, s * c, stations)) for s in (-1, 1)]
    found = 0.5 * (poses(both[1], before) - poses(both[0], before))
    size = np.abs(found).reshape(-1, 2, 3).max(axis=(0, 2))
    assert size[0] > 1e-5
    wrong = np.abs(found - stated).reshape(-1, 2, 3).max(axis=(0, 2))
    assert (wrong < 1e-3 * np.maximum(size, [1e-5, 1e-7])).all()


def test_nothing_is_moved_where_nothing_is_read() -> None:
    before = adjust(facade().network())
    columns = before.columns("S1")
    assert not influence_of(
        before, [Considered(COMMON.select([RANGE_SCALE]), set())], columns
    ).any()
    assert influence_of(before, [], columns).shape == (6, 0)
