import numpy as np
import pytest
from scipy import stats

from tests.comparison.planes import frame
from tests.comparison.two_stations import (
    NOISE,
    ORIGIN,
    from_station,
    joint_covariance,
    observed,
    pair,
    patch,
    placement,
)
from tribrach.cloud.placement import Placement
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.core_points import Normals
from tribrach.comparison.footprints import beam_areas
from tribrach.comparison.m3c2 import M3C2Settings, m3c2
from tribrach.comparison.m3c2_ep import M3C2EP, m3c2_ep
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise

NORMAL = np.array([0.1, -0.95, 0.2]) / np.linalg.norm([0.1, -0.95, 0.2])
SETTINGS = M3C2Settings([0.4], 0.4, 0.1, scanner=ORIGIN + np.array([0, -10, 1]))


def flat(count: int) -> Normals:
    blank = np.zeros(count)
    return Normals(np.tile(NORMAL, (count, 1)), blank, blank, blank, blank.astype(int))


def station_cloud(rng, k: int, surface, error):
    seen = observed(rng, k, surface)
    return from_station(lambda: [(seen, None)], placement(k, error))


@pytest.fixture(scope="module")
def trials() -> list[M3C2EP]:
    """The same wall in 300 surveys, poses drawn from the joint covariance."""
    rng = np.random.default_rng(1)
    core = ORIGIN + np.array([[0.5, 0.2, 1.0]])
    errors = rng.multivariate_normal(np.zeros(12), joint_covariance(), size=300)
    out = []
    for error in errors:
        clouds = [
            station_cloud(
                rng, k, patch(rng, core[0] - ORIGIN, NORMAL, 60), error[6 * k : 6 * k + 6]
            )
            for k in (0, 1)
        ]
        out.append(m3c2_ep(*clouds, core, SETTINGS, pair(), normals=flat(1)))
    return out


def test_distances_over_their_sigma_are_normal(trials) -> None:
    ratio = np.array([t.distance[0] / t.sigma[0] for t in trials])
    assert stats.kstest(ratio, "norm").pvalue > 0.01
    low, high = stats.chi2.ppf([0.001, 0.999], len(ratio))
    assert low < (ratio**2).sum() < high
    # the stations are the larger part, so that leaving them out would be noticed
    assert (ratio**2 * [(t.sigma[0] / t.sigma_random[0]) ** 2 for t in trials]).mean() > 2


def test_false_alarms_of_the_three_levels(trials) -> None:
    distance = np.abs([t.distance[0] for t in trials])
    alarms = {
        name: (distance > [getattr(t, name)[0] for t in trials]).mean()
        for name in ("lod95_quadratic", "lod95_additive", "lod95_spatial")
    }
    assert alarms["lod95_quadratic"] == pytest.approx(0.05, abs=0.037)
    assert alarms["lod95_additive"] < alarms["lod95_quadratic"]
    assert alarms["lod95_spatial"] < alarms["lod95_quadratic"]


@pytest.mark.parametrize(
    ("along", "across", "degrees", "share"),
    [(1.0, 1.0, 30, 0.005), (0.5, 3.0, 20, 0.188), (0.5, 3.0, 40, 0.358), (1.5, 0.5, 40, 0.090)],
)
def test_the_spatial_level_is_none_at_95_percent(
    along: float, across: float, degrees: float, share: float
) -> None:
    """The published level holds its false alarms for no shape but by chance; closed form."""
    n = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    variance = np.array([along, across, across]) ** 2
    level = np.sqrt(stats.chi2.ppf(0.95, 3) / (n**2 / variance).sum())
    assert 2 * stats.norm.sf(level / np.sqrt((n**2 * variance).sum())) == pytest.approx(
        share, abs=0.003
    )


def test_random_part_alone_is_the_spread_of_means() -> None:
    rng = np.random.default_rng(2)
    core = ORIGIN + np.array([[0.5, 0.2, 1.0]])
    found = [
        m3c2_ep(
            *(
                station_cloud(rng, k, patch(rng, [0.5, 0.2, 1.0], NORMAL, 60), np.zeros(6))
                for k in (0, 1)
            ),
            core,
            SETTINGS,
            pair(),
            normals=flat(1),
        )
        for _ in range(150)
    ]
    ratio = np.array([f.distance[0] / f.sigma_random[0] for f in found])
    assert ratio.std() == pytest.approx(1, abs=0.17)
    spreads = np.array([f.first.spread[0] / f.first.expected[0] for f in found])
    assert np.sqrt((spreads**2).mean()) == pytest.approx(1, abs=0.03)


def test_round_covariances_reduce_to_plain_m3c2_and_the_published_level() -> None:
    rng = np.random.default_rng(3)
    flat_frame = frame(NORMAL)
    xyz = [
        patch(rng, [0, 0, 0], NORMAL, 900) + 4e-3 * rng.normal(size=(900, 1)) * NORMAL for _ in "ab"
    ]
    round_points = np.tile([16e-6, 16e-6, 16e-6, 0, 0, 0], (900, 1))
    core = ORIGIN + rng.uniform(-0.05, 0.05, (20, 2)) @ flat_frame[:, :2].T
    clouds = [whole(x, round_points, most=300) for x in xyz]
    found = m3c2_ep(*clouds, core, SETTINGS, pair(), normals=flat(20))
    plain = m3c2(*clouds, core, SETTINGS, normals=flat(20))
    assert found.distance == pytest.approx(plain.distance, abs=1e-12)
    assert np.array_equal(found.first.count, plain.first.count)
    assert found.first.spread == pytest.approx(plain.first.spread, rel=1e-9)
    n1, n2 = plain.first.count, plain.second.count
    assert found.sigma_random == pytest.approx(4e-3 * np.sqrt(1 / n1 + 1 / n2), rel=1e-9)


def test_spatial_level_of_round_covariances() -> None:
    places = [Placement("S", Pose(np.eye(3), ORIGIN), np.diag([1e-6] * 3 + [0.0] * 3), NOISE)] * 2
    stations = type(pair()).independent(*places)
    rng = np.random.default_rng(4)
    cloud = whole(patch(rng, [0, 0, 0], NORMAL, 500), np.tile([1e-8] * 3 + [0.0] * 3, (500, 1)))
    found = m3c2_ep(cloud, cloud, ORIGIN[None], SETTINGS, stations, normals=flat(1))
    expected = np.sqrt(stats.chi2.ppf(0.95, 3)) * found.sigma
    assert found.lod95_spatial == pytest.approx(expected, rel=1e-9)


def test_overlapping_beams_count_once() -> None:
    rng = np.random.default_rng(5)
    wide = ScanNoise(1.5e-3, 1e-5, 3e-5, 4e-5, 5e-3, 3e-3)
    core = ORIGIN + np.array([[0.0, 0.0, 0.0]])
    where = placement(0, np.zeros(6))
    area = beam_areas(core, NORMAL[None], Placement("S", where.pose, where.covariance, wide))
    beam = core[0] - where.pose.translation
    length = np.linalg.norm(beam)
    cosine = abs(beam @ NORMAL) / length
    assert area[0] == pytest.approx(np.pi / 4 * np.hypot(5e-3, 3e-3 * length) ** 2 / cosine)
    clouds = [
        station_cloud(rng, k, patch(rng, [0, 0, 0], NORMAL, 4000), np.zeros(6)) for k in (0, 1)
    ]
    one = m3c2_ep(*clouds, core, SETTINGS, pair(), normals=flat(1))
    many = m3c2_ep(*clouds, core, SETTINGS, pair(), normals=flat(1), footprints=(area, area))
    assert many.independent[0] == pytest.approx(np.pi * 0.2**2 / area[0] * np.ones(2), rel=0.06)
    ratio = np.sqrt(one.first.count[0] / many.independent[0, 0])
    assert many.sigma_random[0] / one.sigma_random[0] == pytest.approx(ratio, rel=0.05)
    assert many.sigma_registration == one.sigma_registration


def test_points_without_covariances_and_empty_cylinders() -> None:
    rng = np.random.default_rng(6)
    bare = whole(patch(rng, [0, 0, 0], NORMAL, 100))
    with pytest.raises(InputError, match="no covariances"):
        m3c2_ep(bare, bare, ORIGIN[None], SETTINGS, pair(), normals=flat(1))
    cloud = station_cloud(rng, 0, patch(rng, [0, 0, 0], NORMAL, 900), np.zeros(6))
    found = m3c2_ep(cloud, cloud, ORIGIN + np.array([[0, 0, 0], [0, 0, 50.0]]), SETTINGS, pair())
    assert np.array_equal(found.usable, [True, False])
    for values in (found.distance, found.sigma, found.lod95_quadratic, found.lod95_spatial):
        assert np.isfinite(values[0])
        assert np.isnan(values[1])
    assert np.array_equal(found.significant, [False, False])
