"""Effects that are no unknowns: what they do to a network is what adjusting it with them does."""

import numpy as np
import pytest

from tests.network.facade import STATIONS, TARGETS, facade
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.rotation import exp, log
from tribrach.instruments.calibration import CalibrationModel
from tribrach.instruments.common_errors import COMMON, RANGE_SCALE, RANGE_ZERO, REFRACTION
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.considered import Considered, influence_of
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.planes import FittedPlanes
from tribrach.observations.poses import RelativePoses
from tribrach.observations.scanner import Inclinations, ScannerPolar, TargetCentres
from tribrach.observations.unknowns import plane_basis
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.units import SEC

EFFECTS = {RANGE_SCALE: 1e-4, REFRACTION: 20.0, RANGE_ZERO: 1e-3}


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


#: walls and floor: a normal and a place
WALLS = {
    "N": ((0, -1, 0), (20, 31, 8)),
    "E": ((-1, 0, 0), (44, 20, 7)),
    "W": ((1, 0.1, 0), (-4, 18, 8)),
    "F": ((0, 0, 1), (20, 15, 4)),
    "G": ((0.7, -0.7, 0), (5, 28, 9)),
}


def with_planes() -> Survey:
    """Targets at the first station, planes that the second one is hung on to it by."""
    survey = Survey()
    names = [f"T{k}" for k in range(len(TARGETS))]
    for name, x in zip(names, TARGETS, strict=True):
        survey.point(name, x)
    survey.add(Coordinates, values=TARGETS, sigma=0.001, position=names, group="control")
    for wall, (normal, place) in WALLS.items():
        n = np.array(normal) / np.linalg.norm(normal)
        survey.planes[wall] = (n, float(n @ place))
    for k, (name, (place, heading)) in enumerate(STATIONS.items()):
        r = exp(np.array([0.0, 0.0, heading]))
        survey.station(name, translation=np.array(place), rotation=r)
        if not k:
            seen = (TARGETS - place) @ r
            sigma = np.full((len(names), 3), 0.001)
            station = [name] * len(names)
            survey.add(TargetCentres, values=seen, sigma=sigma, station=station, target=names)
        normals = np.array([survey.planes[w][0] for w in WALLS]) @ r
        centroids = (np.array([at for _, at in WALLS.values()]) - place) @ r
        survey.add(
            FittedPlanes,
            values=np.zeros((len(WALLS), 3)), sigma=np.tile([1e-4, 1e-4, 1e-3], (len(WALLS), 1)),
            station=[name] * len(WALLS), plane=list(WALLS), normal=normals, centroid=centroids,
        )  # fmt: skip
    return survey


def corrected_planes(
    o: FittedPlanes, wanted: np.ndarray, c: float, model: CalibrationModel
) -> None:
    """Three points of each plane corrected, and the plane through them."""
    for k in np.flatnonzero(wanted):
        points = o.centroid[k] + 0.01 * np.vstack(
            [np.zeros(3), plane_basis(o.normal[k : k + 1])[0].T]
        )
        polar = polar_from_xyz(points)
        polar += c * model.columns(*polar.T, np.ones(3))[:, :, 0]
        a, b, d = xyz_from_polar(polar)
        n = np.cross(b - a, d - a)
        o.normal[k] = n / np.linalg.norm(n) * np.sign(n @ o.normal[k])
        o.centroid[k] = a


def corrected(network: Network, effect: str, c: float, stations: list[str]) -> Network:
    """The network with the readings of these stations corrected by an effect of size c."""
    model = COMMON.select([effect])
    names = list(STATIONS)
    for o in network.observations:
        if isinstance(o, FittedPlanes):
            corrected_planes(o, np.array([names[k] in stations for k in o.station]), c, model)
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
@pytest.mark.parametrize("survey", [facade, with_polar, with_planes])
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


def test_a_scale_of_both_clouds_is_in_what_lies_between_them() -> None:
    """Two stations tied by their clouds alone: the second is m times farther away."""
    survey = Survey()
    for k, name in enumerate("AB"):
        translation = np.array([20.0 * k, 0, 0])
        survey.station(name, translation=translation, rotation=np.eye(3), free=np.full(6, k > 0))
    survey.add(
        RelativePoses, values=[[20.0, 0, 0, 0, 0, 0]], sigma=np.full((1, 6), 1e-3),
        start=["A"], end=["B"], rotation=[np.eye(3)],
    )  # fmt: skip
    adjustment = adjust(survey.network())
    scale, zero = (
        influence_of(
            adjustment, [Considered(COMMON.select([e]), set("AB"))], adjustment.columns("B")
        )
        for e in (RANGE_SCALE, RANGE_ZERO)
    )
    np.testing.assert_allclose(scale[:, 0], [20, 0, 0, 0, 0, 0], atol=1e-9)
    assert not zero.any()


def test_a_plane_is_as_unsure_as_the_angles_of_all_its_points() -> None:
    """Walls turned as a whole about the scanner: an offset in closed form, planes drawn anew."""
    rng, sigma = np.random.default_rng(1), 8 * SEC
    normal = rng.normal(size=(5, 3))
    normal[0], center = [-np.sqrt(0.5), -np.sqrt(0.5), 0], 20.0 * rng.normal(size=(5, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    center[0] = [20.0, 0.0, 0.0]
    center[1, 2] = 15.0
    blank = PlaneSet(
        normal, center, np.zeros((5, 3, 3)), np.ones(5), (), np.ones(5), ("a",) * 4 + ("b",)
    )
    stated = blank.with_angles({"a": sigma}).covariance
    # an incidence of 45 degrees at 20 m: rho sigma sin I
    assert np.sqrt(stated[0, 2, 2]) == pytest.approx(20 * sigma * np.sqrt(0.5), rel=1e-6)
    assert not stated[4].any()
    basis = plane_basis(normal)
    for k in range(4):
        points = center[k] + 0.003 * np.vstack([np.zeros(3), basis[k].T])
        polar = polar_from_xyz(points)
        rows = []
        for angle in (1, 2):
            moved = polar.copy()
            moved[:, angle] += sigma
            a, b, c = xyz_from_polar(moved)
            n = np.cross(b - a, c - a)
            n *= np.sign(n @ normal[k]) / np.linalg.norm(n)
            rows.append([*(basis[k].T @ n), n @ (a - center[k])])
        np.testing.assert_allclose(stated[k], np.array(rows).T @ rows, rtol=1e-3, atol=1e-12)
