"""Files that no project places: what their site is."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.geodesy.site import FlatSite
from tribrach.io.survey.formats import read
from tribrach.network.adjustment import adjust
from tribrach.network.facts import EARTH


def test_tables_with_long_zenith_angles_are_on_a_round_earth(tmp_path: Path) -> None:
    """600 m on a plane would be 24 mm off in height; 100 m stay on it."""
    points = "point,e_m,n_m,u_m,role\nA,0,0,0,fixed\nC,50,0,0,fixed\n"
    (tmp_path / "points.csv").write_text(points)
    for far, flat in ((600.0, False), (100.0, True)):
        up = 10 - (1 - 0.13) * far**2 / (2 * EARTH)
        zenith, slope = np.degrees(np.arctan2(far, up)) / 0.9, np.hypot(far, up)
        (tmp_path / "sights.csv").write_text(
            "from,to,direction_gon,zenith_gon,slope_distance_m,"
            "sigma_direction_mgon,sigma_zenith_mgon,sigma_distance_mm\n"
            f"A,B,0,{zenith:.7f},{slope:.5f},1,1,2\nA,C,100,100,50,1,1,2\n"
        )
        survey = read([tmp_path / "sights.csv", tmp_path / "points.csv"])
        assert (survey.site == FlatSite()) == flat
        height = adjust(survey.network()).points["B"].xyz[2]
        assert height == pytest.approx(up if flat else 10.0, abs=1e-4)
