"""Hits against closed forms and against looking at every primitive."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulate.surfaces import distance_to_surface
from tribrach.errors import InputError
from tribrach.simulate import scene as sc
from tribrach.simulate.ray_casting import SceneView

place = st.tuples(*[st.floats(-5, 5)] * 3).map(np.array)
vector = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)
size = st.floats(0.05, 3.0)
quick = settings(max_examples=60, deadline=None)


def shoot(primitive, origin, ray):
    hits = SceneView(sc.Scene.of([primitive]), origin).cast(ray[None])
    return hits.range[0], hits.cosine[0], hits.primitive[0]


@quick
@given(place, vector, size, size, place, vector)
def test_rectangle(center, normal, width, height, origin, ray):
    p, d = sc.rectangle(center, normal, width, height, 0.5), ray / np.linalg.norm(ray)
    n = normal / np.linalg.norm(normal)
    r, cosine, _ = shoot(p, origin, d)
    slope = n @ d
    if abs(slope) < 1e-6:
        return
    expected = n @ (center - origin) / slope
    local = p.axes @ (origin + expected * d - center)
    margin = np.array([width, height]) / 2 - np.abs(local[:2])
    if expected < 1e-3 or abs(margin).min() < 1e-9:
        return
    if (margin > 0).all():
        assert r == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert cosine == pytest.approx(abs(slope), abs=1e-12)
    else:
        assert r == np.inf


@quick
@given(place, size, place, vector)
def test_sphere(center, radius, origin, ray):
    d = ray / np.linalg.norm(ray)
    r, cosine, _ = shoot(sc.sphere(center, radius), origin, d)
    roots = np.roots(
        [1, 2 * d @ (origin - center), (origin - center) @ (origin - center) - radius**2]
    )
    real = np.sort(roots.real[np.abs(roots.imag) < 1e-9])
    far = np.linalg.norm(np.cross(d, center - origin))
    if abs(far - radius) < 1e-6 or np.abs(roots.real).min() < 1e-3:
        return
    ahead = real[real > 0] if far < radius else []
    if len(ahead) == 0:
        assert r == np.inf
        return
    assert r == pytest.approx(ahead[0], rel=1e-7, abs=1e-7)
    normal = (origin + r * d - center) / radius
    assert cosine == pytest.approx(abs(normal @ d), abs=1e-6)


@quick
@given(place, st.tuples(size, size, size), st.floats(0, 6), place, vector)
def test_box_is_met_where_its_surface_is_and_not_before(center, extent, turn, origin, ray):
    check_convex(sc.box(center, extent, 0.5, turn), origin, ray)


@quick
@given(place, size, size, vector, place, vector)
def test_cylinder_is_met_where_its_surface_is_and_not_before(center, r, height, axis, origin, ray):
    check_convex(sc.cylinder(center, r, height, 0.5, axis), origin, ray)


@quick
@given(place, st.tuples(size, size, size), vector, st.floats(0, 6), place, vector)
def test_ellipsoid_is_met_where_its_surface_is_and_not_before(
    center, half, axis, turn, origin, ray
):
    check_convex(sc.ellipsoid(center, half, 0.5, axis, turn), origin, ray)


def check_convex(primitive, origin, ray):
    """The hit lies on the surface, and no place before it does; a miss meets no surface."""
    d = ray / np.linalg.norm(ray)
    r, cosine, number = shoot(primitive, origin, d)
    scene = sc.Scene.of([primitive])
    steps = np.arange(0.0, 25.0, 0.01) if r == np.inf else np.linspace(0, 0.999 * r, 500)
    along = origin + steps[:, None] * d
    local = (along - primitive.center) @ primitive.axes.T
    if primitive.kind == sc.BOX:
        inside = (np.abs(local) < primitive.half - 1e-6).all(axis=1)
    elif primitive.kind == sc.ELLIPSOID:
        inside = np.linalg.norm(local / primitive.half, axis=1) < 1 - 1e-6
    else:
        inside = np.hypot(local[:, 0], local[:, 1]) < primitive.half[0] - 1e-6
        inside &= np.abs(local[:, 2]) < primitive.half[2] - 1e-6
    if r == np.inf:
        assert not inside.any()
        return
    assert number == 0
    hit = (origin + r * d)[None]
    assert distance_to_surface(scene, np.zeros(1, dtype=int), hit)[0] < 1e-9
    assert inside.all() or not inside.any()
    assert 0 <= cosine <= 1 + 1e-12


def test_normals_by_differences():
    """Cosines of the incidence against the normal from three neighbouring rays."""
    rng = np.random.default_rng(4)
    solids = [
        sc.box((3, 0, 0), (1, 2, 1.5), 0.5, 0.4),
        sc.cylinder((0, 4, 0), 0.7, 2, 0.5, (0.2, 0.1, 1)),
        sc.sphere((-3, -1, 0.5), 0.8),
        sc.ellipsoid((1, -4, 0.5), (0.9, 0.6, 0.4), axis=(0.3, 1, 0.5), turn=0.4),
    ]
    view = SceneView(sc.Scene.of(solids), np.zeros(3))
    rays = rng.normal(size=(20000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hits = view.cast(rays)
    first = np.cross(rays, [0.3, -0.5, 0.8])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second, step = np.cross(rays, first), 1e-6
    points = []
    for shift in (0 * first, step * first, step * second):
        d = rays + shift
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        points.append(view.cast(d).range[:, None] * d)
    with np.errstate(invalid="ignore"):
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = np.abs(np.einsum("ni,ni->n", normal, rays))
    use = (hits.primitive >= 0) & (hits.cosine > 0.2)
    assert use.sum() > 500
    off = np.abs(cosine - hits.cosine)[use]
    assert np.quantile(off, 0.99) < 1e-3


def crowd(rng):
    solids = [sc.ground((0, 0, -1.6), 100)]
    for _ in range(60):
        at = rng.uniform(-12, 12, 3) * [1, 1, 0.3]
        solids += [
            sc.box(at, rng.uniform(0.2, 2, 3), 0.5, rng.uniform(0, 3)),
            sc.sphere(rng.uniform(-9, 9, 3), 0.2),
            sc.cylinder(rng.uniform(-9, 9, 3), 0.1, 2, 0.4, rng.normal(size=3)),
            sc.checkerboard(rng.uniform(-9, 9, 3), rng.normal(size=3), 0.4),
        ]
    return sc.Scene.of(solids)


def test_cells_miss_nothing():
    rng = np.random.default_rng(7)
    scene = crowd(rng)
    rays = np.vstack([rng.normal(size=(5000, 3)), rng.integers(-3, 4, (2000, 3))]).astype(float)
    rays = rays[np.abs(rays).max(axis=1) > 0]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    for origin in ([0, 0, 0], [3.3, -2.1, 0.4], [-11, 12, 1.0]):
        view = SceneView(scene, np.array(origin))
        nearest = np.full(len(rays), np.inf)
        for k in range(len(scene)):
            nearest = np.minimum(nearest, view.again(rays, np.full(len(rays), k)).range)
        assert np.array_equal(view.cast(rays).range, nearest)


def test_quadrants_and_disc_reflect():
    scene = sc.Scene.of(
        [
            sc.checkerboard((2, 0, 0), (-1, 0, 0), 0.4, margin=0.1),
            sc.disc((-2, 0, 0), (1, 0, 0), 0.1, 0.4),
        ]
    )
    view = SceneView(scene, np.zeros(3))
    rays = np.array([[2, y, z] for y, z in ((0.1, 0.1), (0.1, -0.1), (-0.1, -0.1), (-0.1, 0.1))])
    rays = np.vstack([rays, [[2, 0.25, 0.25], [-2, 0.05, 0.05], [-2, 0.15, 0]]])
    a = view.cast(rays / np.linalg.norm(rays, axis=1, keepdims=True)).reflectance
    assert a[0] == a[2] != a[1]
    assert a[1] == a[3]
    assert sorted({a[0], a[1]}) == [0.08, 0.85]
    assert a[4] == 0.4
    assert (a[5], a[6]) == (0.85, 0.08)


def test_an_empty_scene_is_refused():
    with pytest.raises(InputError, match="at least one"):
        sc.Scene.of([])
