"""A 3D grid network of directions, zeniths, distances and some GNSS, at several sizes.

Prints, for each size, the whole adjustment (with the covariance of every point) as a ratio to
the unavoidable: one sparse factorisation of its own normal matrix per iteration and one selected
inverse; then points per second and the exponent of the growth. Seconds are those of the processor.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np
import scipy.sparse as sp

from tribrach.network.adjustment import adjust
from tribrach.network.linear import SparseFactor
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles


def grid(side: int, seed: int = 0) -> Network:
    """A grid of side x side set-ups 100 m apart; every set-up sights its four neighbours."""
    rng = np.random.default_rng(seed)
    count = side * side
    e, n = (a.ravel() * 100.0 for a in np.meshgrid(np.arange(side), np.arange(side)))
    truth = np.c_[e, n, 10 * np.sin(e / 300) * np.cos(n / 200)] + rng.normal(0, 3, (count, 3))
    index = np.arange(count).reshape(side, side)
    pairs = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
    one = np.concatenate([np.c_[a.ravel(), b.ravel()] for a, b in pairs])
    both = np.concatenate([one, one[:, ::-1]])
    names = np.array([f"P{i}" for i in range(count)], dtype=object)
    circles = np.array([f"orientation {name}" for name in names], dtype=object)

    survey = Survey()
    for name, x in zip(names, truth + rng.normal(0, 0.05, truth.shape), strict=True):
        survey.point(name, x)

    def sights(pair: np.ndarray) -> dict[str, np.ndarray]:
        return {"start": names[pair[:, 0]], "end": names[pair[:, 1]]}

    chord = truth[both[:, 1]] - truth[both[:, 0]]
    azimuth = np.arctan2(chord[:, 0], chord[:, 1]) - rng.uniform(-3, 3, count)[both[:, 0]]
    survey.add(
        Directions,
        values=azimuth + rng.normal(0, 5e-6, len(both)),
        sigma=5e-6,
        orientation=circles[both[:, 0]],
        **sights(both),
    )
    chord = truth[one[:, 1]] - truth[one[:, 0]]
    zenith = np.arctan2(np.hypot(chord[:, 0], chord[:, 1]), chord[:, 2])
    noise = rng.normal(0, 1, (2, len(one)))
    survey.add(ZenithAngles, values=zenith + 1e-5 * noise[0], sigma=1e-5, **sights(one))
    length = np.linalg.norm(chord, axis=1)
    survey.add(SlopeDistances, values=length + 0.002 * noise[1], sigma=0.002, **sights(one))
    antenna = np.arange(0, count, max(1, count // 100))
    survey.add(
        GnssPositions,
        values=truth[antenna] + rng.normal(0, 0.01, (len(antenna), 3)),
        sigma=0.01,
        position=names[antenna],
    )
    return survey.network()


def measure(side: int) -> tuple[str, int, float]:
    """Adjust one grid; its line, its points and the seconds of the processor."""
    network = grid(side)
    begin = time.process_time()
    adjustment = adjust(network)
    covariances = adjustment.position_covariances()
    whole = time.process_time() - begin
    normal = sp.csc_array(adjustment.design.T @ adjustment.design)
    begin = time.process_time()
    factor = SparseFactor(normal, 1 / np.sqrt(normal.diagonal()))
    factoring = time.process_time() - begin
    begin = time.process_time()
    factor.entries(np.array([0]), np.array([0]))
    selecting = time.process_time() - begin
    unavoidable = adjustment.iterations * factoring + selecting
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    line = (
        f"{side:4d} x {side:<4d} {network.count():7d} observed values "
        f"{adjustment.n_unknowns:7d} unknowns {adjustment.iterations:3d} iterations  "
        f"{whole:7.2f} s = {whole / unavoidable:4.2f} x (factorisations + selected inverse: "
        f"{factoring:.2f} s each + {selecting:.2f} s)  "
        f"{len(covariances) / whole:8.0f} points/s  peak {memory:5.2f} GB"
    )
    return line, side * side, whole


def main() -> None:
    """Run the sizes given, or the standard four."""
    sides = [int(a) for a in sys.argv[1:]] or [25, 50, 100, 200]
    measure(16)  # compiled code is loaded before anything is timed
    results = []
    for side in sides:
        line, *result = measure(side)
        print(line, flush=True)
        results.append(result)
    if len(results) > 1:
        points, seconds = np.log(np.array(results)).T
        print(f"growth: seconds ~ points^{np.polyfit(points, seconds, 1)[0]:.2f}")
        last = np.diff(seconds)[-1] / np.diff(points)[-1]
        print(f"between the last two sizes: seconds ~ points^{last:.2f}")


if __name__ == "__main__":
    main()
