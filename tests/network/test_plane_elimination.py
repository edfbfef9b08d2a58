"""Surfaces are eliminated as blocks, and everything that is asked of the network stays the same."""

import numpy as np

from tribrach.geometry import rotation
from tribrach.network import linear
from tribrach.network.adjustment import adjust
from tribrach.network.datum import point_numbers
from tribrach.network.linear import SchurFactor
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.planes import FittedPlanes


def many_planes(stations=4, planes=40):
    """Stations that see planes all around, errors of 0.1 mrad and 0.5 mm."""
    rng = np.random.default_rng(7)
    survey = Survey(datum=Datum("free"))
    places = rng.normal(0, 5, (stations, 3))
    turns = rotation.exp(rng.normal(0, 1, (stations, 3)))
    normals = rng.normal(0, 1, (planes, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = -rng.uniform(10, 20, planes)
    for k in range(stations):
        survey.station(f"S{k}", translation=places[k], rotation=turns[k])
        n = normals @ turns[k] + rng.normal(0, 1e-4, (planes, 3))
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        d = offsets - normals @ places[k] + rng.normal(0, 5e-4, planes)
        survey.add(
            FittedPlanes,
            values=np.zeros((planes, 3)),
            sigma=np.tile([1e-4, 1e-4, 5e-4], (planes, 1)),
            station=[f"S{k}"] * planes,
            plane=[f"plane {i}" for i in range(planes)],
            normal=n,
            centroid=n * d[:, None],
        )
    for i in range(planes):
        survey.planes[f"plane {i}"] = (normals[i], float(offsets[i]))
    return survey.network()


def test_blocks_of_planes_give_what_the_whole_matrix_gives(monkeypatch):
    whole = adjust(many_planes())
    monkeypatch.setattr(linear, "DENSE_LIMIT", 0)
    blocks = adjust(many_planes())
    assert isinstance(blocks.cofactor.factor, SchurFactor)
    np.testing.assert_allclose(blocks.state.pose_t, whole.state.pose_t, atol=1e-9)
    np.testing.assert_allclose(blocks.state.plane_d, whole.state.plane_d, atol=1e-9)
    for family in ("pose", "plane"):
        a, b = blocks.family_covariances(family), whole.family_covariances(family)
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-9 * np.abs(b).max())


def test_every_plane_is_a_block_of_its_own():
    network = many_planes(2, 5)
    numbers = point_numbers(network.start.layout, np.arange(network.start.layout.size))
    assert (numbers[:12] == -1).all()
    np.testing.assert_array_equal(numbers[12:27], np.repeat(np.arange(5), 3))
