"""Heights by the recipe from a project file: taken, refused with their line."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.project import Project

PLACES = np.array([[0.0, 0, 1.4], [20.9, 0, 0.35], [19.0, 17.6, 1.04]])
PROJECT = """\
[adjustment]
{keys}

[[observations]]
file = "gnss.csv"
instrument = "rtk"

[[observations]]
file = "targets.csv"

[instruments.rtk]
sheet = "NetRTK"

[instruments.scanner]
levelling_arcsec = 15.0

[stations.S1]
levelled = {levelled}
instrument = "scanner"
"""


def project(folder: Path, keys: str, *, levelled: bool = True) -> Project:
    """Three spheres with heights wrong by +60, -40 and +20 mm."""
    heights = PLACES[:, 2] + [0.06, -0.04, 0.02]
    rows = ["gnss,e_m,n_m,u_m"]
    rows += [f"P{k},{e},{n},{u:.4f}" for k, (e, n, u) in enumerate(np.c_[PLACES[:, :2], heights])]
    (folder / "gnss.csv").write_text("\n".join(rows))
    rows = ["station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"]
    rows += [f"S1,P{k},{x},{y},{z},0.74,0.74,0.74" for k, (x, y, z) in enumerate(PLACES)]
    (folder / "targets.csv").write_text("\n".join(rows))
    path = folder / "p.toml"
    path.write_text(PROJECT.format(keys=keys, levelled=str(levelled).lower()))
    return Project.load(path)


@pytest.mark.parametrize(
    ("keys", "error"),
    [
        ('heights = "network"', 0.0133),
        ('heights = "recipe"', 0.06),
        ('heights = "recipe"\nheight_mark = "P1"\nheight_station = "S1"', -0.04),
    ],
)
def test_one_height_is_kept_or_all_are_weighed(tmp_path: Path, keys: str, error: float) -> None:
    adjustment = adjust(open_job(project(tmp_path, keys)).network())
    names = [adjustment.layout.index("point", f"P{k}") for k in range(3)]
    off = adjustment.state.points[names, 2] - PLACES[:, 2]
    assert off == pytest.approx([error] * 3, abs=1e-3)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('heights = "recipe"\nheight_mark = "P9"', r"p\.toml:2: mark P9 has no GNSS position"),
        ('heights = "recipe"\nheight_station = "S9"', r"p\.toml:2: station S9 is not levelled"),
    ],
)
def test_wrong_names_are_refused_with_their_line(tmp_path: Path, keys: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_job(project(tmp_path, keys)).network()


def test_keys_that_make_no_sense_alone(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='need heights = "recipe"'):
        project(tmp_path, 'height_mark = "P1"')
    with pytest.raises(InputError, match="needs two marks"):
        open_job(project(tmp_path, 'heights = "recipe"', levelled=False)).network()
