"""Scanner stations and targets: the adjustment against scipy's sparse least squares and gtsam.

All start from the same values. scipy has our analytic Jacobian and gives the optimum only. gtsam
has factors of its own, a bearing and a range with the sigma of the centre, and gives the
covariance of every target and station as we do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from benchmarks.figures import Figure, cost_of, run
from tribrach.geometry import rotation
from tribrach.network.adjustment import adjust
from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.unknowns import State

#: sigma of a centre and of control [m]
CENTRE, CONTROL = 0.002, 0.001


@dataclass(frozen=True)
class Hall:
    """Targets in a hall, each seen from the eight nearest stations; four targets are control."""

    station: np.ndarray
    target: np.ndarray
    seen: np.ndarray
    control: np.ndarray
    #: approximate values, and those of the control targets
    points: np.ndarray
    places: np.ndarray
    turns: np.ndarray

    def network(self) -> Network:
        """The same as a network."""
        target_names = np.array([f"T{i}" for i in range(len(self.points))], dtype=object)
        station_names = np.array([f"S{i}" for i in range(len(self.places))], dtype=object)
        survey = Survey()
        for i, name in enumerate(target_names):
            given = {"covariance": np.eye(3) * CONTROL**2} if i in self.control else {}
            survey.point(name, self.points[i], **given)
        for i, name in enumerate(station_names):
            survey.station(name, translation=self.places[i], rotation=self.turns[i])
        survey.add(
            TargetCentres,
            values=self.seen,
            sigma=CENTRE,
            station=station_names[self.station],
            target=target_names[self.target],
        )
        return survey.network()


def hall(stations: int, targets: int, seed: int = 0) -> Hall:
    """Simulate it."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(0, 1, (targets, 3)) * [300, 300, 20]
    t = rng.uniform(0, 1, (stations, 3)) * [300, 300, 2]
    r = rotation.exp(rng.normal(0, 1, (stations, 3)))
    _, near = cKDTree(t).query(x, k=8)
    target, station = np.repeat(np.arange(targets), 8), near.ravel()
    seen = np.einsum("nji,nj->ni", r[station], x[target] - t[station])
    control = np.linspace(0, targets - 1, 4).astype(int)
    near_by = x + rng.normal(0, 0.05, x.shape)
    near_by[control] = x[control]
    return Hall(
        station,
        target,
        seen + rng.normal(0, CENTRE, seen.shape),
        control,
        near_by,
        t + rng.normal(0, 0.05, t.shape),
        rotation.exp(rng.normal(0, 0.01, (stations, 3))) @ r,
    )


def by_scipy(network: Network) -> State:
    """The optimum of ``least_squares(trf, lsmr)`` with our Jacobian."""
    assembly = Assembly(network)
    start = network.start

    def state(p: np.ndarray) -> State:
        full = np.zeros(assembly.layout.size)
        full[assembly.free_columns] = p
        return start.retract(full)

    def residual(p: np.ndarray) -> np.ndarray:
        return -assembly.whiten(assembly.misclosure(state(p)))

    def jacobian(p: np.ndarray) -> sp.csr_array:
        # the peer works in one chart at the start; the chain rule brings our increments there
        return assembly.design(state(p)) @ chart(assembly, p)

    sparsity = (assembly.design(start) != 0).astype(int)
    result = least_squares(
        residual,
        np.zeros(len(assembly.free_columns)),
        jac=lambda p: sp.csr_matrix(jacobian(p)),
        jac_sparsity=sp.csr_matrix(sparsity),
        method="trf",
        tr_solver="lsmr",
        tr_options={"atol": 1e-13, "btol": 1e-13, "maxiter": 20000, "regularize": False},
        x_scale="jac",
        ftol=1e-15,
        xtol=1e-12,
        gtol=1e-12,
        max_nfev=200,
    )
    return state(result.x)


def chart(assembly: Assembly, p: np.ndarray) -> sp.csr_array:
    """Derivative of our left increments by the rotation vectors from the start."""
    layout = assembly.layout
    poses = layout.columns("pose", np.arange(layout.count("pose")))
    columns = assembly.reduced[poses[:, 3:]]
    jacobian = rotation.right_jacobian_inverse(p[columns]).transpose(0, 2, 1)
    blocks = np.linalg.inv(jacobian)
    size = len(assembly.free_columns)
    plain = np.ones(size)
    plain[columns.ravel()] = 0.0
    i = np.repeat(columns, 3, axis=1).ravel()
    j = np.tile(columns, (1, 3)).ravel()
    turns = sp.coo_array((blocks.ravel(), (i, j)), shape=(size, size))
    return sp.csr_array(sp.diags_array(plain) + turns)


def by_gtsam(scene: Hall) -> tuple[np.ndarray, np.ndarray]:
    """Targets (n, 3) and their covariances (n, 3, 3), those of all stations besides."""
    import gtsam

    def station(i: int) -> int:
        return int(gtsam.symbol("s", i))

    def target(i: int) -> int:
        return int(gtsam.symbol("t", i))

    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    length = np.linalg.norm(scene.seen, axis=1)
    for i, j, u, r in zip(scene.station, scene.target, scene.seen, length, strict=True):
        noise = gtsam.noiseModel.Diagonal.Sigmas([CENTRE / r, CENTRE / r, CENTRE])
        bearing = gtsam.Unit3(u / r)
        graph.add(gtsam.BearingRangeFactor3D(station(i), target(j), bearing, r, noise))
    known = gtsam.noiseModel.Isotropic.Sigma(3, CONTROL)
    for j in scene.control:
        graph.add(gtsam.PriorFactorPoint3(target(j), scene.points[j], known))
    for j, xyz in enumerate(scene.points):
        start.insert(target(j), xyz)
    for i, (turn, place) in enumerate(zip(scene.turns, scene.places, strict=True)):
        start.insert(station(i), gtsam.Pose3(gtsam.Rot3(turn), place))
    wanted = gtsam.GaussNewtonParams()
    wanted.setRelativeErrorTol(1e-12)
    wanted.setAbsoluteErrorTol(1e-12)
    found = gtsam.GaussNewtonOptimizer(graph, start, wanted).optimize()
    marginals = gtsam.Marginals(graph, found)
    for i in range(len(scene.places)):
        marginals.marginalCovariance(station(i))
    count = range(len(scene.points))
    covariances = np.array([marginals.marginalCovariance(target(j)) for j in count])
    return np.array([found.atPoint3(target(j)) for j in count]), covariances


def measure(stations: float, targets: float) -> Iterator[Figure]:
    """Against scipy without, and against gtsam with all covariances."""
    adjust(hall(20, 60).network())  # compiled code is loaded before anything is timed
    scene = hall(int(stations), int(targets))
    network = scene.network()

    def ours() -> tuple[State, np.ndarray]:
        adjustment = adjust(network)
        adjustment.family_covariances("pose")
        return adjustment.state, adjustment.family_covariances("point")

    (state, covariances), cost = cost_of(ours, 2)
    size = f"{stations:.0f} stations, {targets:.0f} targets, {network.count()} values"
    other, theirs = cost_of(lambda: by_scipy(network))
    apart = np.abs(other.positions - state.positions).max()
    peer = "least_squares of scipy with our Jacobian, no covariances"
    told = f"optima apart by {apart:.1e} m at most"
    yield Figure("adjustment with all covariances", size, cost, peer, theirs, told)
    told, spent = "", None
    try:
        (points, their_own), spent = cost_of(lambda: by_gtsam(scene))
    except ModuleNotFoundError:
        pass
    else:
        apart = np.abs(points - state.points).max()
        sigma, their_sigma = (
            np.sqrt(np.trace(c, axis1=1, axis2=2)) for c in (covariances, their_own)
        )
        wide = np.abs(sigma / their_sigma - 1).max()
        told = f"targets apart by {apart:.1e} m, sigmas by {100 * wide:.1e} % at most"
    peer = "gtsam: Gauss-Newton and the marginals of all"
    yield Figure("adjustment with all covariances, again", size, cost, peer, spent, told)


if __name__ == "__main__":
    run(measure, full=(300, 3000), small=(60, 600))
