"""STAR*NET jobs: one sentence for each cause, cures that keep the job, roles as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.survey.formats import read
from tribrach.io.survey.starnet.options import _REFUSED
from tribrach.network.adjustment import adjust
from tribrach.network.roles import datum_sentence, held_axes, point_roles
from tribrach.network.survey import observed_part

PLAN = "C A 0 0 10 ! ! !\nC B 100 0 10 ! ! !\nC H 50 80 12 * * !\nC P 40 60 11\n"
SIGHTS = "".join(
    f"D {a}-{b} {np.hypot(*d):.4f} 0.005\n"
    for a, b, d in (
        ("A", "P", (40, 60)), ("B", "P", (60, 60)), ("A", "H", (50, 80)), ("B", "H", (50, 80)),
        ("P", "H", (10, 20)),
    )
)  # fmt: skip
LEVELS = "L A-P 1.000 100\nL H-P -1.000 50\nL A-H 2.001 100\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "job.dat"
    path.write_text(text)
    return path


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read([path])
    return str(caught.value)


def fault(shared_data: Path, name: str) -> Path:
    path = shared_data / "faults" / "networks2" / name
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    return path


@pytest.mark.parametrize("option", _REFUSED)
def test_an_option_that_changes_the_job_is_not_to_be_left_out(tmp_path: Path, option: str) -> None:
    said = refusal(written(tmp_path, f".{option} X\n{PLAN}{SIGHTS}"))
    assert "leave the line out" not in said
    assert _REFUSED[option] in said


def test_a_grid_job_keeps_its_grid(shared_data: Path) -> None:
    said = refusal(fault(shared_data, "17-leave-out-changes-job/job.dat"))
    assert "leave the line out" not in said
    assert said.count("job.dat:") == 3


@pytest.mark.parametrize("kind", [".2D", ".3D\n.DELTA ON"])
def test_distances_on_the_grid(tmp_path: Path, kind: str) -> None:
    """Distances of plane coordinates give back the coordinates; as measured they are 0.6 m off."""
    place = {"A": (0, 0), "B": (3000, 400), "C": (900, 2600), "P": (1500, 1200), "Q": (2200, 1900)}
    height = "" if kind == ".2D" else " 300"
    marks = {True: " !" * (2 + bool(height)), False: " * *" + " !" * bool(height)}
    text = f".UNITS METERS DMS\n.ORDER EN\n{kind}\n.CRS EPSG:25832\n" + "".join(
        f"C {n} {350000 + e} {5700000 + u}{height}{marks[n in 'ABC']}\n"
        for n, (e, u) in place.items()
    )
    lines = "".join(
        f"D {a}-{b} {np.hypot(*np.subtract(place[a], place[b])):.4f} 0.003\n"
        for a, b in ("AP", "BP", "CP", "AQ", "BQ", "CQ", "PQ")
    )
    for option, largest in ((".GRID DIST", 1e-4), (".GRID DIST\n.MEASURED DIST", 1.0)):
        path = written(tmp_path, f"{text}{option}\n{lines}")
        adjustment = adjust(observed_part(read([path])).network())
        residual = np.abs(adjustment.residuals).max()
        assert residual < largest
        assert residual > largest / 100


def test_distances_on_the_grid_of_a_local_job_are_refused(tmp_path: Path) -> None:
    said = refusal(written(tmp_path, f".2D\n.GRID DIST\n{PLAN}{SIGHTS}"))
    assert ".CRS" in said
    said = refusal(written(tmp_path, f".3D\n.GRID DIST\n{PLAN}{SIGHTS}"))
    assert "along the slope" in said


@pytest.mark.parametrize("stated", [True, False])
def test_standard_errors_are_assumed_only_where_nobody_states_them(
    tmp_path: Path, stated: bool
) -> None:
    head = ".UNITS METERS\n.ORDER EN\n" + ".LWEIGHT 0.006\n" * stated
    heights = "E A 10 !\nE H 12.001 !\nE P 11\n"
    found = read([written(tmp_path, head + heights + LEVELS)])
    assert any("assumed are" in w for w in found.warnings) != stated


def test_a_stated_weight_of_others(shared_data: Path) -> None:
    found = read([fault(shared_data, "20-lweight-said-assumed/loop.dat")])
    assert not any("assumed are" in w for w in found.warnings)
    assert adjust(observed_part(found).network()).vtpv == pytest.approx(4.636, abs=0.01)


def test_what_is_held_in_height_alone_is_no_control(tmp_path: Path) -> None:
    text = f".UNITS METERS\n.ORDER EN\n.LWEIGHT 0.006\n{PLAN}{SIGHTS}{LEVELS}"
    adjustment = adjust(observed_part(read([written(tmp_path, text)])).network())
    assert held_axes(adjustment)["H"].tolist() == [False, False, True]
    assert point_roles(adjustment) == {"A": "control", "B": "control"}
    assert "H held without error in height alone" in datum_sentence(adjustment)


def test_heights_held_by_others(shared_data: Path) -> None:
    found = read([fault(shared_data, "19-height-held-called-control/net.dat")])
    adjustment = adjust(observed_part(found).network())
    roles = point_roles(adjustment)
    assert not {"A", "B", "C", "D"} & roles.keys()
    assert roles["B0288050"] == "control"


def test_two_hyphens_begin_a_description(tmp_path: Path) -> None:
    described = PLAN.replace("!\n", "! --MON\n")
    text = f".UNITS METERS\n.ORDER EN\n{described}{SIGHTS}"
    assert read([written(tmp_path, text)]).points.keys() == {"A", "B", "H", "P"}


def test_a_refused_vector_is_one_sentence(tmp_path: Path) -> None:
    vectors = "G1 A-B 1 2\nG2 1e-6 1e-6 1e-6\nG3 0 0 0\n" * 2
    said = refusal(written(tmp_path, f".GPS WEIGHT COVARIANCE\n{vectors}"))
    assert said.startswith("2 records are refused")
    assert said.count("job.dat:") == 1
    assert "there is no vector" not in said


def test_vectors_of_others(shared_data: Path) -> None:
    """With descriptions and without: the same sentence."""
    one, other = (
        refusal(fault(shared_data, f"22-vector-cascade/{n}.gps")).partition(".gps:")[2]
        for n in ("vectors", "plain")
    )
    assert one == other
