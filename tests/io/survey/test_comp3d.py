"""Comp3D files written for each code, read and adjusted; broken ones and their sentences."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geometry.rotation import exp
from tribrach.io.survey.comp3d import reader as comp3d
from tribrach.io.survey.comp3d.assembly import Comp3dFacts
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import facts_of
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.units import SEC

#: three control points and one free one, some 50 m around 1000, 2000
CONTROL = """
* code name E N h sigmas
1 A 1000 2000 100 0.001 0.001 0.001
1 B 1050 2000 101 0.001 0.001 0.001  *second
1 C 1000 2050 102 0.001 0.001 0.001
0 P 1030 2030 103
"""
PROJECT = """data=
{"config": {"name": "test", "root_COR_file": "net.cor", "root_OBS_file": "net.obs",
 "center_latitude": 48.0, "local_center": [1000.0, 2000.0, 0.0], "use_proj": false,
 "proj_def": "", "compute_type": 0, "files_unit": 1, "refraction": 0.12,
 "internal_constraints": false, "coord_cov_file": ""}}"""


def write(folder: Path, observations: str, points: str = CONTROL, **files: str) -> Path:
    (folder / "net.cor").write_text(points)
    (folder / "net.obs").write_text(observations)
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    (folder / "net.comp").write_text(PROJECT)
    return folder / "net.comp"


def grid_of(survey: Survey) -> ProjectedGrid:
    (facts,) = facts_of(survey.facts, Comp3dFacts)
    return facts.grid


def place(survey: Survey, name: str) -> np.ndarray:
    return survey.points[name].xyz


def adjusted(folder: Path, *args: str, **files: str) -> tuple[Survey, Adjustment]:
    survey = comp3d.read(write(folder, *args, **files))
    return survey, adjust(survey.network())


def columns(survey: Survey, kind: str) -> dict:
    """Values, sigmas, use and reason of a kind."""
    found = [o for o in survey.network().observations if o.kind == kind]
    assert len(found) == 1, kind
    (table,) = found
    return {
        "values": table.values[:, 0],
        "sigma": table.sigma[:, 0],
        "use": list(table.use),
        "reason": list(table.reason),
        "source": list(table.source),
    }


def test_simple_observations(tmp_path: Path) -> None:
    survey = comp3d.read(
        write(
            tmp_path,
            "3 A P 42.5 0.001 0.0001\n1 B P 36 0.002\n2 C P 36 0.003\n4 A P 3 0.004 0 1.5 1.6\n"
            "6 A P 96 0.002 0.001 1.5 1.7\n7 A B 0 0.001\n5 A P 350 0.001\n8 A C 0 0.01\n"
            "9 A P 0 0.02 0.03\n14 A P 30 0.01\n15 A P 30 0.01\n",
        )
    )
    gon = np.pi / 200
    slope = columns(survey, "slope_distance")
    assert slope["values"] == pytest.approx([42.5, 36])
    # sigma grows with the measured distance
    assert slope["sigma"] == pytest.approx([0.001 + 0.0001 * 42.5, 0.002])
    assert slope["source"] == ["net.obs:1", "net.obs:2"]
    zenith = columns(survey, "zenith")
    assert zenith["values"] == pytest.approx([96 * gon])
    assert zenith["sigma"] == pytest.approx([0.002 * gon + 0.001 / 42.5])
    assert columns(survey, "direction")["values"] == pytest.approx([0, 350 * gon])
    assert columns(survey, "azimuth")["sigma"] == pytest.approx([0.01 * gon])
    assert columns(survey, "height_difference")["values"] == pytest.approx([3])
    offset = columns(survey, "local_offset")
    assert offset["values"] == pytest.approx([0, 0, 30, 30])
    assert offset["sigma"] == pytest.approx([0.02, 0.03, 0.01, 0.01])
    (level,) = [o for o in survey.network().observations if o.kind == "height_difference"]
    assert (level.height_start[0], level.height_end[0]) == (1.5, 1.6)


def test_directions_belong_to_the_last_round(tmp_path: Path) -> None:
    survey = comp3d.read(
        write(tmp_path, "7 A B 0 0.1\n5 A P 50 0.1\n7 A C 0 0.1\n5 A P 350 0.1\n5 B P 1 1\n")
    )
    (table,) = [o for o in survey.network().observations if o.kind == "direction"]
    assert list(table.orientation) == [0, 0, 1, 1, 2]
    assert any("direction without a 7" in warning for warning in survey.warnings)


def test_switched_off_stays_with_its_reason(tmp_path: Path) -> None:
    survey = comp3d.read(
        write(
            tmp_path,
            "3 A P 42.5 0.001\n3 B P 36 0.001\n3 C P 36 0.001\n-3 A P 99 0.001\n3 A P 98 -0.001\n"
            "-7 A P 10 0.001\n9 A P 0 -0.01 0.01\n",
        )
    )
    slope = columns(survey, "slope_distance")
    assert slope["use"] == [Use.ACTIVE] * 3 + [Use.OFF] * 2
    assert slope["reason"][3:] == [
        "its code is negative in the file",
        "its sigma is negative in the file",
    ]
    assert slope["sigma"][4] == 0.001
    assert columns(survey, "local_offset")["use"] == [Use.OFF, Use.ACTIVE]
    # a round without an active direction is no unknown
    assert adjust(survey.network()).n_unknowns == 12


def test_point_codes(tmp_path: Path) -> None:
    points = """
1 A 1000 2000 100 0 0 0
2 B 1050 2000 101 0.01 -0.01 0
3 C 1000 2050 102 0 0 0.01
4 D 1010 2010 100
5 E 1020 2010 100 0 0 0.01
6 F 1030 2010 100
7 G 1040 2010 100 0.01 0.02 0
1 H 1000 2060 102 0.01 0.01 0
1 K 1000 2060 103 0.01 0.01 0.01
-1 X
"""
    lines = [f"3 A {name} 40 1" for name in "BCHK"] + ["4 A D 0 1", "4 A E 0 1", "2 A F 33 1"]
    survey = comp3d.read(write(tmp_path, "\n".join([*lines, "2 A G 41 1", "3 A X 1 1"]), points))
    free = {name: tuple(p.free) for name, p in survey.points.items()}
    full, none = (True, True, True), (False, False, False)
    assert free["A"] == none
    assert free["B"] == free["C"] == free["H"] == free["K"] == full
    assert free["D"] == free["E"] == (False, False, True)
    assert free["F"] == free["G"] == (True, True, False)
    network = survey.network()
    control = {o.kind: o for o in network.observations if o.group == "control"}
    assert len(control["coordinates"]) == 1
    # B in east (north is off), H and G in both, one of G's sigmas differs
    assert len(control["component"]) == 2 + 2 + 2
    assert list(control["component"].use).count(Use.OFF) == 1
    assert sorted(control["height"].sigma[:, 0]) == pytest.approx([0.01, 0.01])
    # the height of H is held although its plan position is not
    assert [c.observations.kind for c in network.constraints] == ["height"]
    assert any("point X" in w and "net.cor:11" in w for w in survey.warnings)


def test_dimension_decides_what_a_point_can_be_used_for(tmp_path: Path) -> None:
    points = CONTROL + "4 D 1010 2010 100\n6 F 1030 2010 100\n"
    survey = comp3d.read(write(tmp_path, "3 A D 17 1\n4 A D 0 1\n6 A F 99 1\n2 A F 33 1\n", points))
    assert columns(survey, "slope_distance")["reason"] == ["point D has a height only"]
    assert columns(survey, "zenith")["reason"] == ["point F has no height"]


def test_heights_far_from_the_centre_are_ellipsoidal(tmp_path: Path) -> None:
    """A level line of 20 km without a height difference stays level."""
    points = "5 A 1000 2000 50 0 0 0.001\n4 B 21000 2000 40\n"
    survey, adjustment = adjusted(tmp_path, "4 A B 0 0.001\n", points)
    enh = grid_of(survey).from_work(adjustment.state.points)
    assert enh[:, 2] == pytest.approx([50, 50], abs=1e-6)
    # in the work frame the far end lies lower by the Earth's curvature
    assert adjustment.state.points[1, 2] == pytest.approx(50 - 20000**2 / 2 / 6.389e6, abs=0.1)


def test_offsets_follow_the_grid(tmp_path: Path) -> None:
    """Two points with equal grid northing, 5 km east of the centre, where the meridian turns."""
    points = "1 A 6000 2000 0 0.001 0.001 0.001\n0 B 6100 2000 0\n"
    lines = "14 A B 100 0.001\n15 A B 0 0.001\n4 A B 0 0.001\n"
    survey, adjustment = adjusted(tmp_path, lines, points)
    enh = grid_of(survey).from_work(adjustment.state.points)
    assert enh[1, 1] == pytest.approx(enh[0, 1], abs=2e-4)
    # the stereographic scale at 5 km is 1 + 1.5e-7
    assert enh[1, 0] - enh[0, 0] == pytest.approx(100, abs=2e-4)


def frame_lines(survey: Survey, rotation: np.ndarray, origin: np.ndarray, names: str) -> list[str]:
    """Targets in the frame at ``origin`` (W) turned by ``rotation``."""
    out = []
    for name in names:
        x, y, z = rotation.T @ (place(survey, name) - origin)
        out.append(f"{name} {x:.6f} {y:.6f} {z:.6f}")
    return out


def known(folder: Path) -> Survey:
    """Positions of the control points in W."""
    return comp3d.read(write(folder, "3 A P 42 1\n3 B P 36 1\n3 C P 36 1\n"))


def turned(angle: float, tilt: float) -> np.ndarray:
    return exp(np.array([0, 0, angle])) @ exp(np.array([tilt, 0, 0]))


def test_cartesian_subframe(tmp_path: Path) -> None:
    before = known(tmp_path)
    origin, rotation = np.array([20.0, 10.0, 105.0]), turned(0.7, 0.2)
    lines = frame_lines(before, rotation, origin, "ABCP")
    sigmas = ["0.001", "0.001 0.0001", "0.001 0.002 0.003", "0.001 0.001 0.003 0.0001 0.1"]
    text = "\n".join(f"{a} {b}" for a, b in zip(lines, sigmas, strict=True))
    survey, adjustment = adjusted(tmp_path, "11 S @s.xyz * free\n", s_xyz=text)
    assert adjustment.layout.names["pose"] == ("S",)
    assert adjustment.state.pose_t[0] == pytest.approx(origin, abs=1e-5)
    assert adjustment.state.pose_r[0] == pytest.approx(rotation, abs=1e-6)
    # P was seen 0.1 m above its mark
    assert place(survey, "P")[2] - adjustment.state.points[3, 2] == pytest.approx(0.1, abs=1e-5)
    sights = columns(survey, "target_centre")
    far = np.linalg.norm(place(before, "B") - origin)
    assert sights["sigma"] == pytest.approx([0.001, 0.001 + 0.0001 * far, 0.001])


def test_levelled_subframe_and_switched_off_axis(tmp_path: Path) -> None:
    before = known(tmp_path)
    origin = np.array([20.0, 10.0, 105.0])
    lines = frame_lines(before, turned(0.7, 0.0), origin, "ABC")
    text = "\n".join([f"{lines[0]} 0.001", f"{lines[1]} 0.001 0.001 -0.001", f"{lines[2]} 0.001"])
    survey, adjustment = adjusted(tmp_path, "11 S @s.xyz 1\n", s_xyz=text)
    assert adjustment.state.pose_r[0][:, 2] == pytest.approx(
        survey.site.axes(adjustment.state.pose_t)[0, 2], abs=1e-9
    )
    assert adjustment.n_constraints == 2
    assert columns(survey, "frame_coordinate")["use"] == [Use.ACTIVE, Use.ACTIVE, Use.OFF]


def test_polar_subframes_intersect(tmp_path: Path) -> None:
    """Two cameras at known places see four control points; a target of neither is intersected."""
    before = known(tmp_path)
    unknown = np.array([25.0, 30.0, 95.0])
    texts, cor = [], CONTROL + "1 D 1060 2070 90 0.001 0.001 0.001\n"
    survey = comp3d.read(write(tmp_path, "3 A P 1 1\n3 A D 1 1\n3 B P 1 1\n3 C P 1 1\n", cor))
    assert place(before, "A") == pytest.approx(place(survey, "A"))
    grid = grid_of(survey)
    for name, origin, rotation in (
        ("U", np.array([-20.0, -15.0, 110.0]), turned(0.3, 0.4)),
        ("V", np.array([70.0, -25.0, 120.0]), turned(2.3, -0.3)),
    ):
        enh = grid.from_work(origin[None])[0]
        cor += f"0 {name} {enh[0] + 0.02:.4f} {enh[1] - 0.01:.4f} {enh[2]:.4f}\n"
        rows = []
        for target in ("A", "B", "C", "D", "Q"):
            point = unknown if target == "Q" else place(survey, target)
            x, y, z = rotation.T @ (point - origin)
            around = np.arctan2(y, x) * 200 / np.pi
            up = np.arctan2(z, np.hypot(x, y)) * 200 / np.pi
            rows.append(f"{target} {around:.7f} {up:.7f} 0 0.001 -1 0")
        texts.append("\n".join(rows))
    lines = "12 U @u.xyz\n12 V @v.xyz\n"
    done, adjustment = adjusted(tmp_path, lines, cor, u_xyz=texts[0], v_xyz=texts[1])
    assert adjustment.state.points[adjustment.layout.index("point", "Q")] == pytest.approx(
        unknown, abs=1e-5
    )
    assert adjustment.state.pose_t[0] == pytest.approx([-20, -15, 110], abs=1e-4)
    # a ray has no distance, not a distance of zero
    assert "frame_distance" not in {o.kind for o in done.network().observations}


def test_two_frames_on_one_point(tmp_path: Path) -> None:
    before = known(tmp_path)
    origin = np.array([20.0, 10.0, 105.0])
    one = "\n".join(f"{x} 0.001" for x in frame_lines(before, turned(0.7, 0.1), origin, "ABC"))
    two = "\n".join(f"{x} 0.001" for x in frame_lines(before, turned(1.7, 0.0), origin, "ABC"))
    lines = "11 S @s.xyz\n11 S @t.xyz\n"
    _, adjustment = adjusted(tmp_path, lines, s_xyz=one, t_xyz=two)
    assert adjustment.layout.names["pose"] == ("S", "S (net.obs:2)")
    assert adjustment.state.pose_t[0] == pytest.approx(adjustment.state.pose_t[1], abs=1e-9)
    assert adjustment.n_constraints == 3


def test_baselines(tmp_path: Path) -> None:
    before = known(tmp_path)
    site = grid_of(before).site
    vector = (place(before, "P") - place(before, "A")) @ site.w_from_ecef
    numbers = " ".join(f"{v:.5f}" for v in vector)
    text = f"P {numbers} 4e-6 0 0 4e-6 0 9e-6\nP {numbers} -4e-6 0 0 4e-6 0 4e-6\n"
    survey, adjustment = adjusted(tmp_path, "19 A @a.bas 2\n", a_bas=text)
    assert adjustment.state.points[3] == pytest.approx(place(before, "P"), abs=1e-5)
    (table,) = [o for o in survey.network().observations if o.kind == "gnss_baseline"]
    # the factor is a factor of sigmas
    assert np.trace(table.covariance[0]) == pytest.approx(4 * 17e-6)
    assert list(table.use) == [Use.ACTIVE, Use.OFF]


def test_rotation_axis(tmp_path: Path) -> None:
    """A tilted axis from two circles; its origin is the foot of a control point."""
    direction = np.array([0.1, 0.05, 1.0]) / np.linalg.norm([0.1, 0.05, 1.0])
    across = np.cross(direction, [1.0, 0, 0])
    across /= np.linalg.norm(across)
    other = np.cross(direction, across)
    middle = np.array([30.0, 20.0, 110.0])
    grid = grid_of(known(tmp_path))
    cor, axe = CONTROL, []
    for target, along, radius in ((1, 0.0, 4.0), (2, 3.0, 2.5)):
        for k, angle in enumerate((0.0, 1.0, 2.2, 3.9)):
            point = middle + along * direction
            point = point + radius * (np.cos(angle) * across + np.sin(angle) * other)
            enh = grid.from_work(point[None])[0]
            numbers = " ".join(f"{v:.6f}" for v in enh)
            cor += f"1 T{target}{k} {numbers} 0.0005 0.0005 0.0005\n"
            axe.append(f"{target} {k} T{target}{k} 0.001 0.001")
    text = "\n".join([*axe, "L A"])
    survey, adjustment = adjusted(tmp_path, "18 O @o.axe\n", cor, o_axe=text)
    scalars = dict(zip(adjustment.layout.names["scalar"], adjustment.state.scalars, strict=True))
    name = "axis O (net.obs:1)"
    assert scalars[f"slope 1 of {name}"] == pytest.approx(0.1, abs=1e-5)
    assert scalars[f"slope 2 of {name}"] == pytest.approx(0.05, abs=1e-5)
    assert scalars[f"radius of 1 on {name}"] == pytest.approx(4.0, abs=1e-5)
    assert scalars[f"radius of 2 on {name}"] == pytest.approx(2.5, abs=1e-5)
    origin = adjustment.state.points[adjustment.layout.index("point", "O")]
    assert (origin - place(survey, "A")) @ direction == pytest.approx(0, abs=1e-5)
    assert np.cross(origin - middle, direction) == pytest.approx([0, 0, 0], abs=1e-4)


def test_equal_distances_and_heights(tmp_path: Path) -> None:
    """Rungs of one ladder, and a point as far from B as from C."""
    lines = "4 A R2 1.0 0.001\n21 @h.eq\n22 @d.eq\n3 A P 42.5 0.001\n4 A P 3 0.001\n"
    survey, adjustment = adjusted(
        tmp_path, lines, h_eq="A R1 0.0001\nR1 R2 0.0001\n", d_eq="B P 0.001\nC P 0.001\n"
    )
    enh = dict(
        zip(
            adjustment.layout.names["point"],
            grid_of(survey).from_work(adjustment.state.points),
            strict=True,
        )
    )
    assert enh["R1"][2] - enh["A"][2] == pytest.approx(0.5, abs=1e-6)
    x = dict(zip(adjustment.layout.names["point"], adjustment.state.points, strict=True))
    from_b, from_c = (np.linalg.norm(x["P"] - x[name]) for name in "BC")
    assert from_b == pytest.approx(from_c, abs=1e-6)


def test_included_files_and_old_encodings(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.obs").write_bytes("3 B P 36.0 0.001 * été\n".encode("latin-1"))
    path = write(tmp_path, "3 A P 42.5 0.001\n@sub\\more.obs *included\n3 C P 36.1 0.001\n")
    slope = columns(comp3d.read(path), "slope_distance")
    assert slope["source"] == ["net.obs:1", "sub/more.obs:1", "net.obs:3"]


@pytest.mark.parametrize(
    ("observations", "points", "sentence"),
    [
        ("3 A P x 0.001", CONTROL, "net.obs:1: 'x' in the observation from A to P is not a number"),
        ("3 A P nan 0.001", CONTROL, "net.obs:1: 'nan'"),
        ("3 A P 42", CONTROL, "net.obs:1: 1 numbers after A P"),
        ("3 A P 42 0", CONTROL, "net.obs:1: sigma is 0"),
        ("3 A P 42 0.001 -1", CONTROL, "net.obs:1: relative sigma is -1"),
        ("3 A A 42 0.001", CONTROL, "net.obs:1: point A is observed from itself"),
        ("3 A P -42 0.001", CONTROL, "net.obs:1: distance is -42 m"),
        ("6 A P 450 0.001", CONTROL, "net.obs:1: angle 450 is more than a full circle"),
        ("33 A P 42 0.001", CONTROL, "net.obs:1: unknown observation code 33"),
        ("@none.obs", CONTROL, "net.obs:1: there is no file none.obs"),
        ("@net.obs", CONTROL, "file inside a file"),
        ("11 S @none.xyz", CONTROL, "net.obs:1: there is no file none.xyz"),
        ("11 S none.xyz", CONTROL, "net.obs:1: the file of the observations is missing"),
        ("3 A P 42 0.001", "1 A 0 0 0\n", "net.cor:1: constrained point A has no sigmas"),
        ("3 A P 42 0.001", "12 A 0 0 0\n", "net.cor:1: unknown point code 12"),
        ("3 A P 42 0.001", "0 A 0 0\n", "net.cor:1: point A has 2 numbers after its name"),
        ("3 A P 42 0.001", CONTROL + "0 A 1 1 1\n", "net.cor:7: point A is defined twice (first"),
        ("3 A P 42 0.001", CONTROL + "-1 A\n", "net.cor:7: point A is both given and left out"),
        ("3 A P 42 0.001", CONTROL + "0 D 0 0 inf\n", "net.cor:7: 'inf'"),
        ("3 A P 42 0.001", "-1 A\n", "net.cor: no point has usable coordinates"),
    ],
)
def test_broken_lines(tmp_path: Path, observations: str, points: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        comp3d.read(write(tmp_path, observations, points))
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_tolerant_reading_names_what_it_leaves_out(tmp_path: Path) -> None:
    path = write(tmp_path, "3 A P 42.5 0.001\n33 A P 1 1\n3 B P 36 0.001\n3 C P x 1\n")
    survey = comp3d.read(path, tolerant=True)
    assert [w.split(":")[1] for w in survey.warnings[:2]] == ["2", "4"]
    assert all(w.endswith("the line is left out.") for w in survey.warnings[:2])
    assert len(columns(survey, "slope_distance")["values"]) == 2


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("data=\n{", "data=\n{{"), "net.comp:2: broken JSON"),
        (('"config"', '"other"'), "there is no config object"),
        (('"compute_type": 0', '"compute_type": 7'), "unknown compute_type 7"),
        (('"center_latitude": 48.0', '"center_latitude": 95'), "center_latitude is 95"),
        (('"use_proj": false', '"use_proj": true'), "grid  is not known to PROJ"),
        (('"coord_cov_file": ""', '"coord_cov_file": "c.csv"'), "net.comp: there is no file c.csv"),
        (('"coord_cov_file": ""', '"coord_cov_file": "../c.csv"'), "outside the folder"),
        (('"net.cor"', '"other.cor"'), "net.comp: there is no file other.cor"),
    ],
)
def test_broken_projects(tmp_path: Path, change: tuple[str, str], sentence: str) -> None:
    path = write(tmp_path, "3 A P 42 0.001\n")
    path.write_text(PROJECT.replace(*change))
    with pytest.raises(InputError) as caught:
        comp3d.read(path)
    assert sentence in str(caught.value)


def test_not_text(tmp_path: Path) -> None:
    path = write(tmp_path, "")
    (tmp_path / "net.obs").write_bytes("3 A P 42 0.001".encode("utf-16"))
    with pytest.raises(InputError, match="not a text file"):
        comp3d.read(path)


def test_deflections_of_points_lean_their_plumb_lines(tmp_path: Path) -> None:
    """Eta and xi stand in this order, in arc seconds, at the end of a point's line."""
    points = CONTROL + "0 Q 1031 2030 103 5.0 -3.0\n"
    path = write(tmp_path, "3 A Q 43 0.001\n3 B Q 36 0.001\n3 C Q 36 0.001\n", points)
    survey = comp3d.read(path)
    assert survey.deflections == {"Q": pytest.approx((-3 * SEC, 5 * SEC))}
    assert "No observation sees P: left out." in survey.warnings


def test_points_that_cannot_be_placed_are_left_out(tmp_path: Path) -> None:
    """As Comp3D does: U is seen by one ray whose sigma needs a distance, V by nothing but U."""
    sights = "".join(
        f"3 {end} P {np.linalg.norm(np.subtract(place, (1030, 2030, 103))):.4f} 0.001\n"
        for end, place in (
            ("A", (1000, 2000, 100)),
            ("B", (1050, 2000, 101)),
            ("C", (1000, 2050, 102)),
        )
    )
    hanging = "7 A B 100 0.001\n5 A U 30 0.001 0.001\n3 U V 5 0.001\n"
    survey, adjustment = adjusted(tmp_path, sights + hanging)
    left_out = [w for w in survey.warnings if "cannot be placed" in w]
    assert left_out == [
        "Point U cannot be placed: it is left out with its observations (net.obs:5, net.obs:6).",
        "Point V cannot be placed: it is left out with its observations (net.obs:6).",
    ]
    assert set(survey.points) == {"A", "B", "C", "P"}
    alone, expected = adjusted(tmp_path, sights + hanging.splitlines()[0] + "\n")
    index = alone.network().start.layout.index("point", "P")
    np.testing.assert_allclose(
        adjustment.state.points[index], expected.state.points[index], atol=1e-7
    )
