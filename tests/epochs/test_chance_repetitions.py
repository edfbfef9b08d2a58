"""Coordinates that either epoch measured for itself share nothing, however their digits fall."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach.epochs.comparison import Comparison, Settings, compare
from tribrach.epochs.differences import Epoch, difference
from tribrach.job.epochs import EpochSettings
from tribrach.questions.epochs.from_files import compare_epoch_files

HEAD = (
    '<gama-local><network axes-xy="en" angles="right-handed"><parameters sigma-apr="1" '
    'sigma-act="apriori"/><points-observations><coordinates>'
)


def written(path: Path, values: np.ndarray, sigma: float, axes: str) -> Path:
    """Measured coordinates (n, d) [m], written to the millimetre, with one sigma [m]."""
    names = [f"P{k}" for k in range(len(values))]
    given = "".join(
        f'<point id="{name}" '
        + " ".join(f'{axis}="{v:.3f}"' for axis, v in zip(axes, row, strict=True))
        + "/>"
        for name, row in zip(names, values, strict=True)
    )
    variances = " ".join([f"{(1e3 * sigma) ** 2:g}"] * values.size)
    free = "".join(f'<point id="{name}" adj="{axes}"/>' for name in names)
    path.write_text(
        f'{HEAD}{given}<cov-mat dim="{values.size}" band="0">{variances}</cov-mat></coordinates>'
        f"{free}</points-observations></network></gama-local>"
    )
    return path


def compared(files: list[Path]) -> Comparison:
    (found,) = compare_epoch_files([[f] for f in files], EpochSettings())
    return found.comparison


def pair(folder: Path, seed: int) -> Comparison:
    """Two epochs of points that stand still, of which some repeat to the last digit."""
    rng = np.random.default_rng(seed)
    axes = ("z", "xy", "xyz")[seed % 3]
    truth = rng.uniform(100, 900, (int(rng.integers(3, 8)), len(axes)))
    epochs = [np.round(truth + 1e-3 * rng.normal(size=truth.shape), 3) for _ in range(2)]
    alike = rng.uniform(size=truth.shape) < 0.3
    epochs[1][alike] = epochs[0][alike]
    files = [written(folder / f"{seed}-{k}.gkf", e, 1e-3, axes) for k, e in enumerate(epochs)]
    found = compared(files)
    shift = 1e3 * (epochs[1] - epochs[0])
    # independent: every difference has twice the variance, and the test is that of all of them
    assert found.held == ()
    if not scaled(found):
        assert found.whole.statistic == pytest.approx((shift**2).sum() / 2, rel=1e-6, abs=1e-9)
        assert found.whole.dof == shift.size
    return found


def scaled(found: Comparison) -> bool:
    """Was a scale between the epochs taken for what differs?"""
    return any(motion.name == "scale" for motion in found.common)


@pytest.mark.parametrize("seed", range(6))
def test_what_repeats_by_chance_is_not_shared(tmp_path: Path, seed: int) -> None:
    pair(tmp_path, seed)


@pytest.mark.slow
def test_500_pairs_with_chance_repetitions(tmp_path: Path) -> None:
    found = [pair(tmp_path, seed) for seed in range(500)]
    assert sum(bool(one.moved) for one in found) <= 40
    # a scale is taken by chance in one of a thousand: more than four of these happen in 0.02 %
    assert sum(map(scaled, found)) <= 4


def test_a_verdict_agrees_with_the_limit_beside_it() -> None:
    """Reference points by the limit of their common test, others by their own."""
    rng = np.random.default_rng(1)
    for _ in range(60):
        n = int(rng.integers(3, 7))
        names = tuple(f"P{k}" for k in range(n))
        epochs = [
            Epoch(label, names, 1e-3 * rng.normal(size=(n, 3)) + 3e-3 * (label == "2") * (
                np.arange(n)[:, None] == 0
            ), 1e-6 * np.eye(3 * n))
            for label in "12"
        ]  # fmt: skip
        for references in ((), names[1:]):
            found = compare(difference(*epochs, space="heights"), Settings(references=references))
            for d in found.displacements:
                if d.answer == "moved":
                    assert d.statistic > d.limit
                elif d.answer == "not moved":
                    assert d.statistic <= d.limit


def test_what_both_epochs_hold_in_one_axis_is_a_constraint() -> None:
    """A zero variance is no error: the other axis is tested as it is."""
    xyz = np.array([[0.0, 0, np.nan], [10, 0, np.nan], [0, 10, np.nan]])
    moved = xyz + np.array([[0.0, 0.012, 0], [0.002, -0.001, 0], [-0.001, 0.001, 0]])
    covariance = 4e-6 * np.eye(9)
    covariance[0, 0] = 0.0
    epochs = [Epoch(k, tuple("PQR"), x, covariance) for k, x in (("1", xyz), ("2", moved))]
    found = compare(difference(*epochs))
    assert found.moved == ("P",)


def folder_of(shared_data: Path, name: str) -> Path:
    path = shared_data / "faults" / "networks2" / name
    if not path.is_dir():
        pytest.skip(f"{path} is absent")
    return path


def test_heights_that_repeat_once(shared_data: Path) -> None:
    there = folder_of(shared_data, "02-epochs-equal-by-chance")
    found = compared([there / "e0.gkf", there / "e1.gkf"])
    assert (found.moved, found.held) == ((), ())
    found = compared([there / "plan0.gkf", there / "plan1.gkf"])
    assert found.moved == ("P",)
    (p,) = [d for d in found.displacements if d.name == "P"]
    assert p.vector == pytest.approx([0.012, 0.0], abs=1e-9)
    assert p.statistic == pytest.approx(18.0, abs=0.01)
    assert np.sqrt(p.covariance[0, 0]) == pytest.approx(2.83e-3, abs=1e-5)


def test_a_row_below_its_limit(shared_data: Path) -> None:
    there = folder_of(shared_data, "23-epochs-verdict-above-limit")
    found = compared([there / "e0.gkf", there / "e1.gkf"])
    assert found.moved == ()
    assert all(d.statistic <= d.limit for d in found.displacements)


@pytest.mark.parametrize("matrix", [False, True])
def test_lists_of_heights_alone(tmp_path: Path, matrix: bool) -> None:
    """A benchmark that sank by 6 mm, in lists of nothing but heights with a sigma of 1 mm."""
    epochs = []
    for k, heights in enumerate(([10.0, 11.0, 12.0, 13.0], [10.0, 11.001, 11.994, 13.0])):
        rows = zip("ABCD", heights, strict=True)
        table = tmp_path / f"h{k}.csv"
        sigma = "" if matrix else ",1"
        head = "point,height_m" + ("" if matrix else ",sigma_u_mm")
        table.write_text("\n".join([head, *(f"{n},{h:.4f}{sigma}" for n, h in rows), ""]))
        epochs.append([table])
        if matrix:
            cells = [[f"{1e-6 * (a == b):g}" for a in "ABCD"] for b in "ABCD"]
            head = "covariance_m2," + ",".join(f"{n}_u" for n in "ABCD")
            rows_of = [",".join([f"{n}_u", *row]) for n, row in zip("ABCD", cells, strict=True)]
            (tmp_path / f"m{k}.csv").write_text("\n".join([head, *rows_of, ""]))
            epochs[-1].append(tmp_path / f"m{k}.csv")
    (found,) = compare_epoch_files(epochs, EpochSettings())
    moved = [d for d in found.comparison.displacements if d.answer == "moved"]
    assert [d.name for d in moved] == ["C"]
    assert moved[0].statistic == pytest.approx(18.0, abs=0.01)
