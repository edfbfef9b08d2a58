"""Marks, rods and GNSS of the courtyard against its truth: joint errors are as large as stated."""

import re
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.simulate.twins import build

SEEDS = 12
SPHERES = [f"P{k}" for k in range(1, 7)]


def test_spheres_over_marks_err_as_stated(tmp_path: Path) -> None:
    """Six spheres with what their session shares: chi-square with 18 values a seed, at 99.9 %."""
    total, shifts = 0.0, []
    for seed in range(1, SEEDS + 1):
        twin = build("sphere-courtyard", 1000, seed)
        for name in ("gnss.csv", "rods.csv"):
            (tmp_path / name).write_text(twin.files[name])
        path = tmp_path / "p.toml"
        # the project as it is written, without check points and scans
        path.write_text(re.sub(r"\[\[points\]\].*?(?=\[\[obs)", "", twin.project, flags=re.DOTALL))
        adjustment = adjust(open_job(path).network())
        layout = adjustment.layout
        where = [layout.index("point", name) for name in SPHERES]
        true = {t.name: t.center for t in twin.targets}
        error = adjustment.state.points[where] - [true[name] for name in SPHERES]
        columns = layout.columns("point", np.array(where)).ravel()
        covariance = adjustment.covariance_columns(columns, columns)
        total += error.ravel() @ np.linalg.solve(covariance, error.ravel())
        shifts.append(error.mean(axis=0))
        marks = [f"M{name[1:]}" for name in SPHERES]
        lean = np.array([true[p] - twin.marks[m] for p, m in zip(SPHERES, marks, strict=True)])
        assert 0 < np.abs(lean[:, :2]).max() < 5 * np.radians(8 / 60) * 2.4
    low, high = chi2.ppf([0.0005, 0.9995], 18 * SEEDS)
    assert low < total < high
    # the mean of six: own 5 cm / sqrt(2) / sqrt(6), common 5 cm / sqrt(2)
    expected = 0.05 * np.sqrt(0.5 + 0.5 / 6)
    square = np.square(np.array(shifts)[:, 2]).sum() / expected**2
    low, high = chi2.ppf([0.0005, 0.9995], SEEDS)
    assert low < square < high
