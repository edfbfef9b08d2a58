"""Side shots are what they would be in the network, and the network is what it was without."""

import json

import numpy as np
import pytest

from tribrach.io.survey.formats import read
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import facts_of
from tribrach.network.side_shots import SideShots, compute
from tribrach.network.survey import observed_part
from tribrach.report import json_result, text
from tribrach.solution import AdjustmentSettings, adjust_network

PROJECT = """
[Adjustment]
adjustment_type                3D
linear_units                   Meters
local_or_grid_adjustment       {grid}
coordinate_system_name         UTM83-19
coordinate_order               EN
[Instrument]
distance_std_err               0.0020000000
angle_std_err                  5.0000000000
azimuth_std_err                5.0000000000
zenith_std_err                 5.0000000000
"""
NETWORK = """
C A 682000 5090000 100 ! ! !
C B 682200 5090100 103 ! ! !
C P 682100 5090000 101
M A-B-P 26-34 100.02 89-26-00
M B-A-P 341-35 141.44 90-49-00
"""


def adjusted(folder, lines: str, grid: int) -> Adjustment:
    folder.mkdir()
    (folder / "job.dat").write_text(NETWORK + lines)
    (folder / "job.snproj").write_text(PROJECT.format(grid=grid))
    return adjust(observed_part(read(folder / "job.dat")).network())


@pytest.mark.parametrize("grid", [0, 1])
def test_a_side_shot_is_a_point_of_the_network_that_nothing_controls(tmp_path, grid):
    shot = "P-A-Q 97-12-13 55.123 88-10-20 1.6/1.5\n"
    within = adjusted(tmp_path / "within", f"M {shot}", grid)
    behind = adjusted(tmp_path / "behind", f"SS {shot}", grid)
    assert behind.dof == within.dof
    assert behind.n_unknowns == within.n_unknowns - 3
    (computed,), left_out = compute(behind, *facts_of(behind.network.facts, SideShots))
    assert not left_out
    assert (computed.name, computed.source) == ("Q", "job.dat:7")
    there = within.state.points[within.layout.index("point", "Q")]
    np.testing.assert_allclose(computed.xyz, there, atol=1e-7)
    np.testing.assert_allclose(computed.covariance, within.covariance("Q"), rtol=1e-6, atol=1e-13)


def test_shots_to_one_point_stay_apart(tmp_path):
    lines = "SS P-A-Q 97-12-13 55.123 88-10-20\nSS P-A-Q 97-12-33 55.133 88-10-20\n"
    behind = adjusted(tmp_path / "behind", lines, 0)
    computed, _ = compute(behind, *facts_of(behind.network.facts, SideShots))
    assert [shot.name for shot in computed] == ["Q", "Q"]
    assert 0.01 < np.linalg.norm(computed[0].xyz - computed[1].xyz) < 0.02


def test_what_cannot_be_computed_is_told(tmp_path):
    lines = "SS P-A-Q 97-12-13 55.123 88-10-20\nSS P R 20.00 90-00-00\nSS X-A-S 10-00-00 5 90-00\n"
    behind = adjusted(tmp_path / "behind", lines, 0)
    (computed,), left_out = compute(behind, *facts_of(behind.network.facts, SideShots))
    assert computed.name == "Q"
    assert left_out == {
        "job.dat:8": "it has neither an angle nor a bearing",
        "job.dat:9": "a mark that it needs is not in the network",
    }


def test_the_report_has_them(tmp_path):
    folder = tmp_path / "behind"
    adjustment = adjusted(folder, "SS P-A-Q 97-12-13 55.123 88-10-20\n", 1)
    content = adjust_network(adjustment.network, AdjustmentSettings())
    assert "1 point is computed by side shots" in text.render(content)
    (row,) = json.loads(json_result.dumps(content))["side_shots"]
    assert row["name"] == "Q"
    assert row["projected"][0] == pytest.approx(682100, abs=60)
