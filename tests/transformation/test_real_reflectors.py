"""Twenty flat reflectors seen from two real stations: a rigid motion between scanner frames."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tribrach.instruments.precision import beam_covariance
from tribrach.transformation.fit import fit_transformation
from tribrach.transformation.model_choice import scale_test
from tribrach.transformation.testing import check_points

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def reflectors(shared_data: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, centres (2, n, 3) and covariances (2, n, 3, 3) in both scanner frames."""
    file = shared_data / "scans" / "riegl_project" / "vz1000_calibration_tiepoints.csv"
    with file.open() as text:
        rows = [r for r in csv.DictReader(text) if r["frame"] == "SOCS"]
    names = [r["target"] for r in rows if r["scanpos"] == "SP01"]
    places, spreads = [], []
    for station in ("SP01", "SP02"):
        mine = {r["target"]: r for r in rows if r["scanpos"] == station}
        x = np.array([[float(mine[n][f"{a}_m"]) for a in "xyz"] for n in names])
        along, across = (
            np.array([float(mine[n][f"sigma_{key}_m"]) for n in names]) for key in ("range", "lat1")
        )
        places.append(x)
        spreads.append(beam_covariance(x, along, across))
    return names, np.array(places), np.array(spreads)


def test_rigid_motion_of_real_stations(reflectors) -> None:
    """2.648 mm unweighted, as published with the data; the scanner's own pose to 2 mm."""
    names, x, c = reflectors
    plain = fit_transformation(x[1], x[0], 6, names=names)
    assert plain.rms == pytest.approx(0.002648, abs=1e-6)
    fit = fit_transformation(x[1], x[0], 6, names=names, covariance_a=c[1], covariance_b=c[0])
    assert fit.rms < 0.0029
    assert fit.dof == 54
    scale = scale_test(fit.points)
    assert scale is not None
    # both frames are of one instrument: no scale between them that its sigma would not explain
    assert abs(scale.excess) < 4 * scale.sigma


def test_every_reflector_held_out_in_turn(reflectors) -> None:
    """Predicted sigmas hold what is seen, and not by an order of magnitude."""
    names, x, c = reflectors
    found = []
    for k in range(len(names)):
        held = np.arange(len(names)) == k
        fit = fit_transformation(x[1], x[0], 6, covariance_a=c[1], covariance_b=c[0], check=held)
        result = check_points(fit)
        assert result is not None
        found.append(float(result.statistic[0]))
    # three values each; single-shot range accuracies of the maker are cautious for fitted centres
    assert 0.1 < np.mean(found) / 3 < 3.0
