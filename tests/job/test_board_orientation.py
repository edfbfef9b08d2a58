"""What boards have in common by orientation: its covariance, the network with it, its budget."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.network.networks import scanner_network
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.polar import polar_by_xyz, polar_from_xyz
from tribrach.geometry.pose import Pose
from tribrach.job.board_orientation import BoardSighting, correlate_boards, orientation_covariance
from tribrach.network.adjustment import adjust
from tribrach.network.contributions import by_category, contributions
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.declaration import Category
from tribrach.observations.scanner import ScannerPolar, TargetCentres
from tribrach.targets.detection import Detection

SIGMA = 4e-4
DEGREE = np.pi / 180
BOARD = np.array([0.0, 0.0, 1.5])


def board(center, density=28.0, noise=1e-4, kind="checkerboard"):
    return Detection(
        kind=kind,
        scan="S",
        center=center,
        covariance=noise**2 * np.eye(3),
        radius=0.15,
        rms=0.0,
        points=200,
        inliers=200,
        range=float(np.linalg.norm(center)),
        incidence=0.0,
        coverage=1.0,
        facts={"points_per_degree": density},
    )


def around(angles, polar=False, densities=None, away=8.0):
    """A survey with one board seen from stations at angles [rad], and its sightings."""
    rng = np.random.default_rng(4)
    survey, sightings = Survey(datum=Datum("free")), []
    survey.point("B", BOARD)
    for k, angle in enumerate(angles):
        place = BOARD + away * np.array([np.cos(angle), np.sin(angle), 0.1])
        pose = Pose(rotation.exp(rng.uniform(-2, 2, 3)), place)
        center = pose.inverse @ BOARD
        found = board(center, 28.0 if densities is None else densities[k])
        survey.station(f"S{k}", translation=place, rotation=pose.rotation)
        turn = polar_by_xyz(center[None])[0] if polar else np.eye(3)
        table = survey.add(
            ScannerPolar if polar else TargetCentres,
            values=polar_from_xyz(center[None]) if polar else center[None],
            covariance=(turn @ found.covariance @ turn.T)[None],
            station=[f"S{k}"],
            target=["B"],
        )
        sightings.append(BoardSighting(table, 0, "B", found, pose, turn))
    return survey, sightings


def test_like_directions_share_their_error_and_unlike_ones_do_not():
    angles = np.array([0.0, 1e-9, 20 * DEGREE, 60 * DEGREE, np.pi])
    toward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    density = np.array([28.0, 112.0, 28.0, 28.0, 28.0])
    alike = orientation_covariance(toward, density, SIGMA)
    assert np.sqrt(np.diag(alike)) == pytest.approx(SIGMA * np.array([1, 0.5, 1, 1, 1]))
    r = alike / np.sqrt(np.outer(np.diag(alike), np.diag(alike)))
    assert r[0, 1] == pytest.approx(1)
    assert r[0, 2] == pytest.approx(np.exp(-0.5), abs=0.01)
    assert r[0, 3] < 0.02
    assert r[0, 4] < 1e-6
    rng = np.random.default_rng(1)
    many = rng.standard_normal((60, 3))
    many /= np.linalg.norm(many, axis=1)[:, None]
    values = np.linalg.eigvalsh(orientation_covariance(many, np.full(60, 50.0), SIGMA))
    assert values.min() > -1e-12 * values.max()


@pytest.mark.parametrize("polar", [False, True])
def test_the_common_part_is_the_same_in_the_world_whatever_is_observed(polar):
    angles = np.array([0.0, 15, 50]) * DEGREE
    survey, sightings = around(angles, polar)
    correlate_boards(survey, sightings, SIGMA)
    (joint,) = survey.network().joint
    assert joint.category is Category.ORIENTATION
    back = np.zeros((9, 9))
    for i, one in enumerate(sightings):
        back[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = np.linalg.inv(
            one.by_place @ one.pose.rotation.T
        )
    world = back @ joint.common @ back.T
    toward = np.array([one.toward for one in sightings])
    expected = np.kron(orientation_covariance(toward, np.full(3, 28.0), SIGMA), np.eye(3))
    assert np.abs(world - expected).max() < 1e-9 * SIGMA**2
    own = back @ (joint.covariance - joint.common) @ back.T
    assert np.abs(own - 1e-8 * np.eye(9)).max() < 1e-15


def test_without_a_sigma_nothing_changes():
    survey, sightings = around(np.array([0.0, 0.3]))
    correlate_boards(survey, sightings, 0.0)
    assert survey.network().joint == ()


def test_a_mean_over_like_sightings_does_not_make_it_smaller():
    """Sigma of a board from known stations: eight from one side, and eight from all around."""
    found = []
    for angles in (np.linspace(0, 8, 8) * DEGREE, np.linspace(0, 315, 8) * DEGREE):
        survey, sightings = around(angles)
        correlate_boards(survey, sightings, SIGMA)
        network = survey.network()
        network.free[network.start.layout.columns("pose", np.arange(8)).ravel()] = False
        adjusted = adjust(network.with_datum(Datum("control")))
        found.append(float(np.sqrt(np.trace(adjusted.covariance("B")) / 3)))
    one_side, all_around = found
    assert one_side == pytest.approx(SIGMA, rel=0.05)
    # eighths of a circle are alike by 9 % to either neighbour
    nearly = 1 + 2 * np.exp(-0.5 * (2 * np.sin(np.pi / 8) / (20 * DEGREE)) ** 2)
    assert all_around == pytest.approx(np.sqrt((nearly * SIGMA**2 + 1e-8) / 8), rel=0.02)


def tied(seed=None, own=1.0, common=1.0):
    """Three stations that see six boards; with errors drawn from either part of the covariance."""
    survey, truth = scanner_network(np.random.default_rng(3), targets=6, sigma=1e-9)
    out, sightings = survey.copy(), []
    poses = {n: Pose(s.rotation, s.translation) for n, s in survey.stations.items()}
    out._tables.clear()
    for name, pose in poses.items():
        seen = np.array([pose.inverse @ x for x in truth])
        table = out.add(
            TargetCentres,
            values=seen,
            sigma=np.full((6, 3), 2e-4),
            station=[name] * 6,
            target=[f"T{i}" for i in range(6)],
        )
        sightings += [
            BoardSighting(table, i, f"T{i}", board(x, noise=2e-4), pose, np.eye(3))
            for i, x in enumerate(seen)
        ]
    correlate_boards(out, sightings, SIGMA)
    if seed is not None:
        rng = np.random.default_rng(seed)
        for joint in out._joint:
            parts = (common**2 * joint.common, own**2 * (joint.covariance - joint.common))
            e = sum(rng.multivariate_normal(np.zeros(len(c)), c, method="svd") for c in parts)
            for t, i, r, x in zip(joint.table, joint.item, joint.row, e, strict=True):
                out._tables[t].columns["values"][i, r] += x
    return out


def test_shares_add_up_and_own_targets_stay_those_of_their_station():
    adjusted = adjust(tied().network())
    for station in ("S0", "S1", "S2"):
        parts = contributions(adjusted, station)
        total = np.sum([p.covariance for p in parts], axis=0)
        whole = adjusted.covariance(station)
        size = np.sqrt(np.diag(whole))
        assert np.abs((total - whole) / size[:, None] / size).max() < 1e-7
        sums = by_category(parts)
        assert set(sums) == {"own targets", "targets of others", "board orientation"}
        # twice the noise in sigma, and less where sightings share it
        ratio = np.trace(sums["board orientation"]) / np.trace(total - sums["board orientation"])
        assert 1.0 < ratio < 4.0


def test_statistic_and_share_are_those_of_errors():
    """Chi-square of adjustments with errors of both parts; scatter with the common one alone."""
    trials, total, found = 60, 0.0, []
    truth = adjust(tied().network())
    for seed in range(trials):
        total += adjust(tied(seed).network()).vtpv
        alone = adjust(tied(seed, own=0.0).network())
        k = alone.state.layout.index("pose", "S1")
        found.append(alone.state.pose_t[k] - truth.state.pose_t[k])
    low, high = chi2.ppf([5e-4, 0.9995], trials * truth.dof)
    assert low < total < high
    share = by_category(contributions(truth, "S1"))["board orientation"][:3, :3]
    z = np.einsum("ni,ij,nj->n", found, np.linalg.inv(share), found)
    low, high = chi2.ppf([5e-4, 0.9995], 3 * trials)
    assert low < z.sum() < high


def test_what_is_not_common_must_be_of_single_observations():
    survey, sightings = around(np.array([0.0, 0.1]))
    whole = 1e-8 * (np.eye(6) + 0.5)
    table = [one.table for one in sightings for _ in range(3)]
    with pytest.raises(InputError, match="by more than what they have in common"):
        survey.correlate(
            table,
            [0] * 6,
            [0, 1, 2] * 2,
            whole,
            "board B",
            (1e-9 * np.eye(6), Category.ORIENTATION),
        )
