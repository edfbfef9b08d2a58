"""What a flat site neglects is to be looked into only where the network could show it."""

from pathlib import Path

import pytest

from tribrach.job.opened import open_job
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.report.content import Report
from tribrach.solution import AdjustmentSettings


def adjusted(folder: Path, sigma_mm: float, site: str = "", more: str = "") -> Report:
    """Four weighted points over 90 m, where the Earth bends by 0.64 mm."""
    rows = ["A,0,0,0", "B,0,60,1", "C,67,0,2", "D,67,60,0"]
    head = "point,e_m,n_m,u_m"
    (folder / "points.csv").write_text("\n".join([head, *rows]) + "\n")
    (folder / "distances.csv").write_text(
        "from,to,slope_distance_m,sigma_mm\nA,D,89.939,2\nB,C,89.945,2\n"
    )
    (folder / "job.toml").write_text(
        f'[site]\nkind = "flat"\n{site}'
        '[[points]]\nfile = "points.csv"\nrole = "control"\n'
        f"sigma_plan_mm = {sigma_mm}\nsigma_up_mm = {sigma_mm}\n{more}"
        '[[observations]]\nfile = "distances.csv"\n'
    )
    job = open_job(folder / "job.toml")
    return adjust_job(job, AdjustmentSettings.of(job.project))


@pytest.mark.parametrize(("sigma_mm", "grave"), [(0.5, True), (10.0, False)])
def test_a_flat_site_is_graver_where_heights_are_better(
    tmp_path: Path, sigma_mm: float, grave: bool
) -> None:
    content = adjusted(tmp_path, sigma_mm)
    (place,) = [k for k, text in enumerate(content.warnings) if "taken as flat" in text]
    assert "over its 90 m the Earth curves by 0.6 mm" in content.warnings[place]
    assert (place < content.grave) == grave


def test_a_site_with_a_radius_says_nothing(tmp_path: Path) -> None:
    content = adjusted(tmp_path, 0.5, "curvature_radius_m = 6371000.0\n")
    assert not any("taken as flat" in text for text in content.warnings)
