"""Scans on an airborne cloud and on a model: errors as large as their covariances say."""

import numpy as np
import pytest
import trimesh
from scipy.stats import chi2

from tests.registration.clouds.airborne import airborne
from tests.registration.clouds.scenes import error, scanned, yard
from tribrach.geometry.mesh import Mesh
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, log
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.registration.clouds.graph import CloudEdge, observe
from tribrach.registration.clouds.pair import CloudPair
from tribrach.registration.clouds.reference import (
    ReferenceOffset,
    ReferencePlace,
    prepare_reference,
    reference_of_mesh,
)
from tribrach.registration.clouds.together import (
    CloudGroup,
    CloudRegistration,
    _refusals,
    register_clouds,
)
from tribrach.simulate.scene import box

#: what all of the airborne cloud is wrong by [m]
SHARED = 0.03
ORIGIN = np.array([500_000.0, 5_000_000.0, 300.0])
PLACES = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5))


def near(pose: Pose, rng: np.random.Generator) -> Pose:
    turn = rng.normal(0, np.radians(1.0), 3) * [0.2, 0.2, 1.0]
    return Pose(exp(turn) @ pose.rotation, pose.translation + rng.normal(0, 0.25, 3))


def one_survey(seed: int) -> tuple[CloudRegistration, list[Pose], np.ndarray]:
    """One or two scans on an airborne cloud, their true poses, and its offset."""
    rng = np.random.default_rng((38, seed))
    offset = rng.normal(0, SHARED, 3)
    reference = prepare_reference("air", [airborne(yard(), rng) + ORIGIN + offset], shared=SHARED)
    places = PLACES[: 1 + seed % 2]
    scans, poses = scanned(yard(), places, points=80_000, seed=seed + 1)
    true = [Pose(pose.rotation, pose.translation + ORIGIN) for pose in poses]
    priors = {scan.name: near(pose, rng) for scan, pose in zip(scans, true, strict=True)}
    return register_clouds(scans, priors, references=[reference]), true, offset


def squares(seed: int) -> tuple[list[float], list[float]]:
    """Squared errors over covariances (6), of poses in the world and in the reference."""
    found, true, offset = one_survey(seed)
    whole, own = [], []
    group = found.groups[0]
    for number, pose in enumerate(true):
        name = f"S{number + 1}"
        off = group.poses[name].translation - pose.translation
        turn = log(group.poses[name].rotation @ pose.rotation.T)
        covariance = group.covariances[name]
        e = np.concatenate([off, turn])
        whole.append(float(e @ np.linalg.solve(covariance, e)))
        e = np.concatenate([off - offset, turn])
        inner = covariance - np.diag([SHARED**2] * 3 + [0.0] * 3)
        own.append(float(e @ np.linalg.solve(inner, e)))
    return whole, own


def test_scans_on_an_airborne_cloud_are_as_good_as_they_say() -> None:
    whole, own = squares(10)
    assert len(whole) == 1
    assert max(whole) < chi2.ppf(0.999, 6)
    assert max(own) < chi2.ppf(0.999, 6)


@pytest.mark.slow
def test_regions_of_poses_hold() -> None:
    """Sixty surveys; scans of one survey share the reference, so that one of each is counted."""
    results = [squares(seed) for seed in range(100, 160)]
    limit = chi2.ppf(0.95, 6)
    for which in (0, 1):
        inside = sum(result[which][0] < limit for result in results)
        # 95 % of 60, and no less than chance makes of it once in a thousand
        assert inside >= 50


def model() -> Mesh:
    """The houses of the yard and its ground, as somebody drew them."""
    parts = [("ground", (0, 0, -0.5), (90, 90, 1), 0.0)]
    parts += [
        ("north", (2, 17, 4), (26, 8, 8), 0.0),
        ("west", (-19, 3, 3), (8, 21, 6), 0.0),
        ("east", (18, -1, 5), (7, 17, 10), 0.15),
        ("south", (-3, -15, 2.5), (20, 6, 5), -0.1),
    ]
    out = []
    for name, center, size, heading in parts:
        body = trimesh.creation.box(size)
        body.apply_transform(trimesh.transformations.rotation_matrix(heading, (0, 0, 1)))
        out.append((name, np.asarray(body.triangles) + center + ORIGIN))
    return Mesh.of(out)


@pytest.mark.parametrize("inverted", [False, True])
def test_a_model_places_a_scan_that_sees_more_than_it_has(inverted: bool) -> None:
    mesh = model()
    if inverted:
        mesh = Mesh(mesh.triangles[:, ::-1], mesh.element, mesh.names)
    reference = reference_of_mesh("town", mesh, sigma=0.02)
    stage = box((1, 5, 0.15), (4, 3, 0.3), 0.5)
    scans, poses = scanned(yard(stage), PLACES[:1], points=80_000)
    true = Pose(poses[0].rotation, poses[0].translation + ORIGIN)
    prior = {"S1": near(true, np.random.default_rng(5))}
    found = register_clouds(scans, prior, references=[reference])
    pose = found.groups[0].poses["S1"]
    shift, turn = error(pose, true)
    assert shift < 0.01
    assert turn < 1e-3
    # pieces of 10 m that are wrong by 2 cm each are in the covariance
    sigma = np.sqrt(np.diag(found.groups[0].covariances["S1"])[:3])
    assert (sigma > 0.005).all()
    (on,) = found.placed_on
    # the top of a stage that the model does not have is left out
    assert 0.0 < on.left_out < 0.2


def test_the_offset_of_a_reference_is_told_by_another() -> None:
    """Two references and a scan between them: each moves by its share, and the test sees it."""
    for gap, fits in ((0.03, True), (0.4, False)):
        survey = Survey()
        both = [ReferencePlace(name, np.zeros(3), 0.03) for name in ("a", "b")]
        for reference in both:
            reference.observe(survey)
        survey.station("S")
        sharp = np.eye(6) * 1e-8
        shifted = Pose(np.eye(3), np.array([gap, 0.0, 0.0]))
        edges = [CloudEdge("a", "S", Pose.identity(), sharp), CloudEdge("b", "S", shifted, sharp)]
        observe(survey, edges)
        adjustment = adjust(survey.network())
        one, two = (ReferenceOffset.of(reference, adjustment) for reference in both)
        assert one.offset[0] == pytest.approx(gap / 2, rel=1e-4)
        assert two.offset[0] == pytest.approx(-gap / 2, rel=1e-4)
        assert one.sigma[0] == pytest.approx(0.03 / np.sqrt(2), rel=1e-3)
        assert one.fits is fits
        assert one.dof == 3


def test_terrain_holds_heights_and_says_what_it_leaves_open() -> None:
    grid = np.stack([*np.meshgrid(*2 * [np.linspace(-45, 45, 91)]), np.zeros((91, 91))], axis=2)
    corners = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    halves = (corners[:3], (corners[0], *corners[2:]))
    triangles = [np.stack(half, axis=2).reshape(-1, 3, 3) for half in halves]
    mesh = Mesh.of([("terrain", np.concatenate(triangles) + ORIGIN)])
    reference = reference_of_mesh("terrain", mesh, shared=0.05)
    scans, poses = scanned(yard(), PLACES[:1], points=50_000)
    true = Pose(poses[0].rotation, poses[0].translation + ORIGIN)
    prior = {"S1": near(true, np.random.default_rng(3))}
    group = register_clouds(scans, prior, references=[reference]).groups[0]
    sigma = np.sqrt(np.diag(group.covariances["S1"]))
    assert (sigma[[0, 1]] > 1.0).all()
    assert sigma[2] == pytest.approx(0.05, rel=0.05)
    assert sigma[5] > 0.5
    assert abs(group.poses["S1"].translation[2] - true.translation[2]) < 0.01


def test_a_scan_that_is_refused_on_a_reference_is_told_though_others_place_it() -> None:
    placed = {name: Pose.identity() for name in ("air", "S1", "S2")}
    groups = [CloudGroup(placed, {}, None, (), {})]
    refused = [CloudPair(a, "S2", None, (), (f"{a} and S2 differ",)) for a in ("air", "S1")]
    assert _refusals(refused, groups, {"air"}) == ["air and S2 differ"]
