"""Sigmas with doubled assumptions and protection levels of points, against simulations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.network import test_occupations as occupations
from tests.network.test_occupations import FINE, around, network_of, surveyed, traverse
from tribrach.network.adjustment import adjust
from tribrach.network.contributions import assumed_variances
from tribrach.network.quality import assess
from tribrach.report.build import build


@pytest.mark.parametrize(("count", "size"), [(4, 1.0), (9, 1.0), (9, 6.0)])
def test_doubled_assumptions_are_the_scatter_of_twice_the_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int, size: float
) -> None:
    """Eccentricities, and with sights of 240 to 720 m changes of refraction, twice as large."""
    places, lines, control = around(count)
    places = {name: size * x for name, x in places.items()}
    network = network_of(tmp_path, places, lines, control, FINE)
    # targets that one sight sees have their errors in its sigma
    drawn = occupations.eccentricities
    monkeypatch.setattr(
        occupations, "eccentricities", lambda *how: (2 * drawn(*how)[0], drawn(*how)[1])
    )
    careless = replace(FINE, refraction_sigma=2 * FINE.refraction_sigma)
    rng = np.random.default_rng(11)
    free = [name for name in places if name not in control]
    off = []
    for _ in range(300):
        adjustment = adjust(surveyed(network, places, lines, careless, rng))
        off.append(np.concatenate([adjustment.points[n].xyz - places[n] for n in free]))
    assumed = assumed_variances(adjustment)
    assert assumed is not None
    at = [adjustment.layout.index("point", n) for n in free]
    stated = np.sqrt(np.einsum("nii->ni", adjustment.position_covariances()) + 3 * assumed)[at]
    ratio = stated.ravel() / np.sqrt(np.square(off).mean(axis=0))
    # 300 runs: the root of a mean square scatters by 4 %
    np.testing.assert_allclose(ratio, 1, atol=0.15)


def test_nothing_is_assumed_without_centring(tmp_path: Path) -> None:
    places, lines, control = around(5)
    bare = replace(FINE, centring=0.0, height=0.0)
    assert assumed_variances(adjust(network_of(tmp_path, places, lines, control, bare))) is None


def test_no_error_that_tests_just_find_moves_a_point_further(tmp_path: Path) -> None:
    """Each value of a survey without errors is changed by its bound, one after the other."""
    places, lines, control = traverse()
    rng = np.random.default_rng(2)
    exact = replace(
        FINE, direction=1e-12, zenith=1e-12, distance=1e-9, scale=0.0, centring=0.0, height=0.0
    )
    network = surveyed(
        network_of(tmp_path, places, lines, control, FINE), places, lines, exact, rng
    )
    adjustment = adjust(network)
    quality = assess(adjustment)
    names = adjustment.layout.names["point"]
    before = adjustment.state.points
    rows, worst = adjustment.rows, np.zeros(len(names))
    for k in np.flatnonzero(np.isfinite(quality.mdb)):
        table, item = rows.table[k], rows.item[k]
        tables = list(network.observations)
        values = tables[table].values.copy()
        values[item, 0] += quality.mdb[k]
        tables[table] = replace(tables[table], values=values)
        moved = adjust(replace(network, observations=tuple(tables))).state.points - before
        worst = np.maximum(worst, np.linalg.norm(moved, axis=1))
    free = [k for k, name in enumerate(names) if name not in control]
    np.testing.assert_allclose(quality.external_worst[: len(names)][free], worst[free], rtol=2e-3)
    assert (quality.external_worst[: len(names)][free] > 1e-4).all()


def test_a_side_shot_is_protected_from_nothing(tmp_path: Path) -> None:
    places, lines, control = traverse()
    places, lines = places | {"side": np.array([40.0, 60.0, 2.0])}, [*lines, ("P2", "side")]
    adjustment = adjust(network_of(tmp_path, places, lines, control, FINE))
    found = dict(
        zip(adjustment.layout.names["point"], assess(adjustment).external_worst, strict=False)
    )
    assert np.isinf(found["side"])
    assert np.isfinite(found["P2"])


def test_points_of_a_result_have_both(tmp_path: Path) -> None:
    places, lines, control = traverse()
    adjustment = adjust(network_of(tmp_path, places, lines, control, FINE))
    quality = assess(adjustment)
    report = build(adjustment, quality)
    point = next(p for p in report.points if p.name == "P2")
    at = adjustment.layout.index("point", "P2")
    axis = np.sqrt(np.linalg.eigvalsh(adjustment.position_covariances()[at])[-1])
    expected = np.sqrt(chi2.ppf(1 - quality.alpha0, 3)) * axis + quality.external_worst[at]
    assert point.protection == pytest.approx(expected)
    assert point.doubled is not None
    assert all(d > s for d, s in zip(point.doubled, point.sigma, strict=True) if d and s)
    held = next(p for p in report.points if p.name == "P0")
    assert held.protection is None
