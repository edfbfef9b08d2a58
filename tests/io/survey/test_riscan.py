"""RiSCAN PRO projects: synthetic ones with known truth."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.io.survey.riscan_files import Rsp, Scan, write
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.riscan import reader as riscan
from tribrach.network.adjustment import adjust
from tribrach.observations.base import Use

ACCURACY = (0.004, 0.002, 0.002)
#: targets in an upright east-north-up project frame
TARGETS = {
    f"tp{i:03d}": np.array(x, float)
    for i, x in enumerate(
        [(12, 3, 1), (10, -8, 4), (-6, 9, 2), (-11, -5, 5), (3, 14, -1), (1, -13, 6), (15, 8, 3)]
    )
}
#: where the project frame is on Earth
SITE = EllipsoidSite(np.radians(29.7), np.radians(-95.3), 30.0, (6378137.0, 1 / 298.257223563))


def pose(yaw: float, roll: float, pitch: float, at) -> np.ndarray:
    """World from scanner, degrees; yaw 0 leaves the element (1, 0) exactly zero."""
    out = np.eye(4)
    cr, sr, cp, sp = (f(np.radians(a)) for a in (roll, pitch) for f in (np.cos, np.sin))
    tilt = np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])
    turn = Rotation.from_euler("z", yaw, degrees=True).as_matrix() if yaw else np.eye(3)
    out[:3, :3] = turn @ tilt
    out[:3, 3] = at
    return out


SOP = {
    "S1": pose(0, 3.0, -4.0, (0, 0, 1.5)),
    "S2": pose(70, 1.0, 2.0, (4, 6, 1.7)),
    "S3": pose(-140, 0.5, 1.0, (-5, 2, 1.6)),
}


def seen(station: str, names=TARGETS) -> dict:
    """Targets in the scanner frame with their accuracies."""
    sop = SOP[station]
    return {n: (sop[:3, :3].T @ (TARGETS[n] - sop[:3, 3]), ACCURACY) for n in names}


def pop() -> np.ndarray:
    """Project to geocentric."""
    out = np.eye(4)
    out[:3, :3] = SITE.w_from_ecef.T
    out[:3, 3] = SITE.origin
    return out


def gnss(station: str, error=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Geocentric position of a station."""
    return SITE.to_ecef(SOP[station][None, :3, 3] + np.array(error))[0]


def scans(*names: str, positions: bool = True) -> list[Scan]:
    """Stations at their true poses."""
    return [Scan(n, seen(n), SOP[n], gnss=gnss(n) if positions else None) for n in names]


@pytest.fixture
def read(tmp_path):
    """Write a project and read it."""
    return lambda project: riscan.read(write(project, tmp_path / "project.rsp"))


def table(survey, kind):
    """The network's observations of a kind."""
    return next(o for o in survey.network().observations if o.kind == kind)


def test_georeferenced_project_adjusts_to_the_truth(read):
    survey = read(Rsp(scans("S1", "S2", "S3"), pop()))
    assert survey.datum.kind == "control"
    assert any("tilt of S1" in warning for warning in survey.warnings)
    adjustment = adjust(survey.network())
    assert adjustment.vtpv < 1e-6
    points = adjustment.network.site.to_ecef(adjustment.state.points)
    true = SITE.to_ecef(np.array(list(TARGETS.values())))
    np.testing.assert_allclose(points, true, atol=1e-6)


def test_covariance_lies_along_the_beam(read):
    survey = read(Rsp(scans("S1", "S2"), pop()))
    centres = table(survey, "target_centre")
    for value, covariance in zip(centres.values, centres.covariance, strict=True):
        beam = value / np.linalg.norm(value)
        floor = riscan.TARGET_FLOOR**2
        assert beam @ covariance @ beam == pytest.approx(0.004**2 + floor)
        values = np.linalg.eigvalsh(covariance)
        np.testing.assert_allclose(values[:2], 0.002**2 + floor, rtol=1e-9)
    path, _, line = centres.source[3].rpartition(":")
    with open(path) as file:
        assert 'tp_socs name="tp003"' in file.read().splitlines()[int(line) - 1]


def test_start_is_turned_to_the_gnss_heading(read):
    """A project frame turned by 50 degrees is turned back; its poses start right."""
    turned = pose(50, 0, 0, (100.0, -20.0, 3.0))
    project = Rsp(
        [Scan(n, seen(n), turned @ SOP[n], gnss=gnss(n)) for n in ("S1", "S2", "S3")], pop()
    )
    survey = read(project)
    for name in ("S1", "S2", "S3"):
        start = survey.stations[name]
        there = survey.site.to_ecef(start.translation[None])[0]
        np.testing.assert_allclose(there, gnss(name), atol=1e-3)
        up = survey.site.w_from_ecef @ SITE.w_from_ecef.T
        np.testing.assert_allclose(start.rotation, up @ SOP[name][:3, :3], atol=1e-4)


def test_gnss_positions_share_half_of_their_variance(read):
    project = Rsp(scans("S1", "S2", "S3"), pop())
    project.scans[1].accuracy = 4.0
    network = read(project).network()
    joint = network.joint[0].covariance.reshape(3, 3, 3, 3)
    np.testing.assert_allclose(joint[0, :, 0], 4.0 * np.eye(3))
    np.testing.assert_allclose(joint[1, :, 1], 16.0 * np.eye(3))
    np.testing.assert_allclose(joint[0, :, 1], 0.5 * 8.0 * np.eye(3))


def test_gnss_moves_the_whole_and_not_the_shape(read):
    """Metres of GNSS error leave distances between stations and targets alone."""
    rng = np.random.default_rng(4)
    project = Rsp(scans("S1", "S2", "S3"), pop())
    for scan in project.scans:
        scan.gnss = gnss(scan.name, rng.normal(0, 1.0, 3))
    adjustment = adjust(read(project).network())
    places = adjustment.state.positions
    true = np.concatenate([list(TARGETS.values()), [SOP[n][:3, 3] for n in SOP]])
    got = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.testing.assert_allclose(got, np.linalg.norm(true[:, None] - true[None], axis=2), atol=1e-5)
    absolute = np.sqrt(np.trace(adjustment.covariance("S1")[:3, :3]) / 3)
    assert 1.0 < absolute < 3.0


def test_disabled_position_is_off(read):
    project = Rsp(scans("S1", "S2", "S3"), pop())
    project.scans[0].enabled = False
    survey = read(project)
    assert list(table(survey, "gnss_position").use) == [Use.OFF, Use.ACTIVE, Use.ACTIVE]


def test_inactive_reflector_is_off(read):
    project = Rsp(scans("S1", "S2"), pop())
    project.scans[1].inactive = ("tp002",)
    centres = table(read(project), "target_centre")
    assert np.flatnonzero(centres.use == Use.OFF).tolist() == [7 + 2]
    assert "RiSCAN" in centres.reason[9]


def test_project_without_gnss_is_free(read):
    survey = read(Rsp(scans("S1", "S2", positions=False)))
    assert survey.datum.kind == "free"
    adjustment = adjust(survey.network())
    assert adjustment.defect == 6
    start = survey.stations["S1"]
    np.testing.assert_allclose(start.translation, SOP["S1"][:3, 3])
    np.testing.assert_allclose(adjustment.state.pose_r[0], SOP["S1"][:3, :3], atol=1e-6)


def test_geocentric_control(read):
    control = {
        n: (SITE.to_ecef(TARGETS[n][None])[0], (0.01, 0.02, 0.03)) for n in list(TARGETS)[:4]
    }
    survey = read(Rsp(scans("S1", "S2", positions=False), pop(), glcs=control))
    assert survey.datum.kind == "control"
    turn = survey.site.w_from_ecef
    np.testing.assert_allclose(
        turn.T @ survey.points["tp000"].covariance @ turn, np.diag([1e-4, 4e-4, 9e-4]), atol=1e-12
    )
    adjustment = adjust(survey.network())
    points = adjustment.network.site.to_ecef(adjustment.state.points)
    at = adjustment.layout.index("point", "tp006")
    np.testing.assert_allclose(points[at], SITE.to_ecef(TARGETS["tp006"][None])[0], atol=1e-5)


def test_local_control_makes_its_frame_the_work_frame(read):
    """Projected control: metric coordinates of another frame, GNSS cannot be joined."""
    shift = np.eye(4)
    shift[:3, 3] = (500000.0, 3300000.0, 20.0)
    control = {n: (TARGETS[n] + shift[:3, 3], None) for n in list(TARGETS)[:4]}
    survey = read(Rsp(scans("S1", "S2"), shift, glcs=control))
    assert any("GNSS position of S1 is not used" in w for w in survey.warnings)
    assert any("5 mm" in w for w in survey.warnings)
    adjustment = adjust(survey.network())
    got = adjustment.state.pose_t[adjustment.layout.index("pose", "S2")]
    np.testing.assert_allclose(got, shift[:3, 3] + SOP["S2"][:3, 3], atol=1e-6)


def test_a_name_that_means_two_reflectors_is_split(read):
    project = Rsp(scans("S1", "S2", "S3"), pop())
    moved = dict(project.scans[1].targets)
    moved["tp001"] = (np.array([30.0, -20.0, 1.0]), ACCURACY)
    project.scans[1].targets = moved
    survey = read(project)
    targets = table(survey, "target_centre").ends(survey.network().start.layout)
    assert ("S2", "tp001@S2") in targets
    assert ("S3", "tp001") in targets
    assert any("tp001 of S2 is not that of S1" in warning for warning in survey.warnings)
    assert adjust(survey.network()).vtpv < 1e-6


def test_things_left_out_are_named(read):
    project = Rsp([*scans("S1", "S2"), Scan("empty", {})], pop(), prcs={"tp000": ((1, 2, 3), None)})
    project.scans[0].gnss = (29.7, -95.3, 30.0)
    text = "\n".join(read(project).warnings)
    assert "scan position empty has no reflectors" in text
    assert "1 tie points of the project frame" in text
    assert "GNSS position of S1 is not used: it is not geocentric" in text


def test_unregistered_station_has_no_start_pose(read):
    project = Rsp(scans("S1", "S2"), pop())
    project.scans[1].registered = False
    assert np.isnan(read(project).stations["S2"].translation).all()


BAD = {
    "accuracy missing": (lambda p: p.scans[0].targets.update(q=((1, 2, 3), None)), "reflector q"),
    "accuracy zero": (
        lambda p: p.scans[0].targets.update(q=((1, 2, 3), (0, 1, 1))),
        "reflector q has no accuracy above zero",
    ),
    "accuracy negative": (
        lambda p: p.scans[0].targets.update(q=((1, 2, 3), (0.1, -1, 1))),
        "reflector q has no accuracy above zero",
    ),
    "at the origin": (
        lambda p: p.scans[0].targets.update(q=((0, 0, 0), ACCURACY)),
        "reflector q lies at the scanner's origin",
    ),
    "not a number": (
        lambda p: p.scans[0].targets.update(q=((np.nan, 0, 0), ACCURACY)),
        "<vector> does not hold 3 numbers",
    ),
    "two numbers": (
        lambda p: p.scans[0].targets.update(q=((1.0, 0), ACCURACY)),
        "<vector> does not hold 3 numbers",
    ),
    "matrix": (lambda p: setattr(p.scans[0], "sop", np.ones((4, 4))), "matrix of <sop>"),
    "mirror": (lambda p: setattr(p, "pop", np.diag([1.0, 1, -1, 1])), "matrix of <pop>"),
    "station twice": (lambda p: p.scans.append(p.scans[0]), "station S1 is defined twice"),
    "control accuracy": (
        lambda p: p.glcs.update(q=(SITE.origin, (0, 1, 1))),
        "control point q has no accuracy above zero",
    ),
    "no name": (lambda p: setattr(p.scans[0], "name", ""), "a scan position has no name"),
    "no stations": (lambda p: p.scans.clear(), "no observations"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named(read, case):
    spoil, sentence = BAD[case]
    project = Rsp(scans("S1", "S2"), pop())
    spoil(project)
    with pytest.raises(InputError) as caught:
        read(project).network()
    assert sentence in str(caught.value)
    if case != "no stations":
        assert "project.rsp:" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "empty"),
        ("<notaproject/>", "root element is <notaproject>"),
        ("<project/>", "no <scanpositions>"),
        ("<project>", "XML cannot be read"),
        ('<!DOCTYPE project [<!ENTITY a "b">]><project/>', "entities"),
    ],
)
def test_broken_files(tmp_path, text, sentence):
    path = tmp_path / "project.rsp"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        riscan.read(path)


def test_external_dtd_is_not_loaded(read, tmp_path):
    (tmp_path / "project.dtd").write_text('<!ENTITY boom "boom">')
    assert read(Rsp(scans("S1", "S2"), pop())).stations


def test_hidden_entities_are_refused(tmp_path):
    text = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE project [<!ENTITY a "b">]><project/>'
    path = tmp_path / "project.rsp"
    path.write_bytes(text.encode("utf-16"))
    with pytest.raises(InputError, match="entities"):
        riscan.read(path)


def test_control_height_is_mentioned(read):
    control = {n: (SITE.to_ecef(TARGETS[n][None])[0], None) for n in list(TARGETS)[:4]}
    survey = read(Rsp(scans("S1", "S2"), pop(), glcs=control, glcs_extra="<height>0.1</height>"))
    assert any("height 0.1 m of control point tp000" in warning for warning in survey.warnings)
