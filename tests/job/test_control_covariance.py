"""A covariance matrix of control coordinates: read, turned, weighed."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust

NAMES = [f"{point}_{axis}" for point in "AB" for axis in "enu"]


def random_covariance(seed: int = 4) -> np.ndarray:
    """Of A and B [m^2], millimetres with strong correlations."""
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return 1e-6 * (root @ root.T + 0.5 * np.eye(6))


def job(folder: Path, names: list[str], matrix: np.ndarray, site: str = "") -> Adjustment:
    """A and B as control with a matrix, and the difference of both as a vector."""
    e, n = (500100.0, 5500200.0) if site else (0.0, 0.0)
    (folder / "points.csv").write_text(
        f"point,e_m,n_m,u_m\nA,{e},{n},100\nB,{e + 300},{n + 400},130\n"
    )
    rows = [
        ",".join([name, *map(repr, row)]) for name, row in zip(names, matrix.tolist(), strict=True)
    ]
    (folder / "matrix.csv").write_text(
        "\n".join([",".join(["covariance_m2", *names]), *rows]) + "\n"
    )
    (folder / "sights.csv").write_text(
        "from,to,slope_distance_m,sigma_slope_distance_mm\nA,B,500.9,10000\n"
    )
    (folder / "job.toml").write_text(
        f'{site}[[points]]\nfile = "points.csv"\ncovariance = "matrix.csv"\n'
        '[[observations]]\nfile = "sights.csv"\n'
    )
    return adjust(open_job(folder / "job.toml").network())


def joint(adjustment: Adjustment) -> np.ndarray:
    return np.block([[adjustment.covariance(a, b) for b in "AB"] for a in "AB"])


def test_matrix_of_control_comes_back(tmp_path: Path) -> None:
    """Hardly anything else is observed: the result has the covariance that was given."""
    given = random_covariance()
    np.testing.assert_allclose(joint(job(tmp_path, NAMES, given)), given, rtol=2e-5, atol=1e-12)


def test_order_of_names_does_not_matter(tmp_path: Path) -> None:
    given, order = random_covariance(), np.array([4, 0, 2, 5, 1, 3])
    shuffled = [NAMES[k] for k in order]
    found = joint(job(tmp_path, shuffled, given[np.ix_(order, order)]))
    np.testing.assert_allclose(found, given, rtol=2e-5, atol=1e-12)


def test_grid_is_turned_into_space(tmp_path: Path) -> None:
    """On a projected site the difference of both points keeps its variance along the line."""
    given = random_covariance(7)
    found = joint(job(tmp_path, NAMES, given, '[site]\ncrs = "EPSG:25832"\n'))
    spread = np.hstack([np.eye(3), -np.eye(3)])
    ours, theirs = (spread @ part @ spread.T for part in (found, given))
    # the frame of the work is tangent at the middle of a site of 500 m
    np.testing.assert_allclose(np.linalg.eigvalsh(ours), np.linalg.eigvalsh(theirs), rtol=2e-3)


def test_bad_matrices(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not symmetric and positive definite"):
        job(tmp_path, NAMES, -random_covariance())
    with pytest.raises(InputError, match=r"of C, which is no point of points\.csv"):
        job(tmp_path, [n.replace("B", "C") for n in NAMES], random_covariance())
    with pytest.raises(InputError, match="'A_q' names no coordinate"):
        job(tmp_path, ["A_q", *NAMES[1:]], random_covariance())
