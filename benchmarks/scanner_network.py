"""Scanner stations and targets: the adjustment against scipy's sparse least squares.

Both start from the same values and use the same analytic Jacobian. The peer gives the optimum
only; the adjustment gives every station and target covariance as well.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import scipy.sparse as sp
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from tribrach.geometry import rotation
from tribrach.network.adjustment import adjust
from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.unknowns import State


def building(stations: int, targets: int, seed: int = 0) -> Network:
    """Targets in a hall, each seen from the eight nearest stations; four targets are control."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(0, 1, (targets, 3)) * [300, 300, 20]
    t = rng.uniform(0, 1, (stations, 3)) * [300, 300, 2]
    r = rotation.exp(rng.normal(0, 1, (stations, 3)))
    _, near = cKDTree(t).query(x, k=8)
    target, station = np.repeat(np.arange(targets), 8), near.ravel()
    seen = np.einsum("nji,nj->ni", r[station], x[target] - t[station])
    target_names = np.array([f"T{i}" for i in range(targets)], dtype=object)
    station_names = np.array([f"S{i}" for i in range(stations)], dtype=object)
    survey = Survey()
    control = np.linspace(0, targets - 1, 4).astype(int)
    for i, name in enumerate(target_names):
        given = {"covariance": np.eye(3) * 1e-6} if i in control else {}
        survey.point(name, x[i] if i in control else x[i] + rng.normal(0, 0.05, 3), **given)
    turned = rotation.exp(rng.normal(0, 0.01, (stations, 3))) @ r
    for i, name in enumerate(station_names):
        survey.station(name, translation=t[i] + rng.normal(0, 0.05, 3), rotation=turned[i])
    survey.add(
        TargetCentres,
        values=seen + rng.normal(0, 0.002, seen.shape),
        sigma=0.002,
        station=station_names[station],
        target=target_names[target],
    )
    return survey.network()


def by_scipy(network: Network) -> tuple[State, float]:
    """The optimum of ``least_squares(trf, lsmr)`` with our Jacobian, and its seconds."""
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
    begin = time.perf_counter()
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
    return state(result.x), time.perf_counter() - begin


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


def main() -> None:
    """Compare both on the size given, or 300 stations and 3,000 targets."""
    sizes = [int(a) for a in sys.argv[1:]] or [300, 3000]
    adjust(building(20, 60))  # compiled code is loaded before anything is timed
    network = building(*sizes)
    begin = time.perf_counter()
    adjustment = adjust(network)
    targets = adjustment.family_covariances("point")
    stations = adjustment.family_covariances("pose")
    ours = time.perf_counter() - begin
    state, theirs = by_scipy(network)
    apart = np.abs(state.positions - adjustment.state.positions).max()
    print(
        f"{sizes[0]} stations, {sizes[1]} targets, {network.count()} observed values: "
        f"{ours:.2f} s with {len(targets)} target and {len(stations)} station covariances; "
        f"scipy {theirs:.2f} s without; ratio {theirs / ours:.1f}; "
        f"optima apart by at most {apart:.1e} m"
    )


if __name__ == "__main__":
    main()
