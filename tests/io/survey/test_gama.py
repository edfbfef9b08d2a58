"""GNU Gama files: every element, every axes and angle sense, and bad input by file and line."""

import numpy as np
import pytest

from tests.io.survey.gama_files import (
    FILE_AXES,
    HEAD,
    TRUTH,
    XMLNS,
    document,
    file_coordinates,
    full_network,
    read,
)
from tribrach.errors import InputError, NoStartValues, Refusals
from tribrach.io.survey.gama import observations
from tribrach.io.survey.gama.reader import GamaFacts
from tribrach.network.adjustment import adjust
from tribrach.network.facts import facts_of
from tribrach.network.survey import observed_part
from tribrach.observations.base import Use
from tribrach.units import CC, GON, SEC

HANDS = ("left-handed", "right-handed")
PLANE = """<point id="A" x="0" y="0" fix="xy"/>
<point id="B" x="100" y="0" fix="xy"/>
<point id="P" adj="xy"/>
"""
LEVEL = '<point id="A" z="0" fix="z"/>\n<point id="B" adj="z"/>\n'


def kinds(survey):
    """The network's observations by kind."""
    return {o.kind: o for o in survey.network().observations}


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("axes", FILE_AXES)
def test_axes_and_angles(tmp_path, axes, hand):
    """Truth in E, N, U and in the file's x, y, z from error-free observations of all kinds."""
    adjustment = adjust(read(tmp_path, full_network(axes, hand)).network())
    assert np.abs(adjustment.residuals).max() < 2e-8
    assert adjustment.n_observations == 2 * 3 * 4 + 3 + 2 + 3
    file_axes = facts_of(adjustment.network.facts, GamaFacts)[0].axes
    for i, name in enumerate(adjustment.layout.names["point"]):
        enu = adjustment.state.points[i]
        np.testing.assert_allclose(enu, TRUTH[name], atol=1e-7)
        xyz = file_coordinates(axes)[name]
        np.testing.assert_allclose(enu @ file_axes.matrix(), xyz, atol=1e-7)
        np.testing.assert_allclose(file_axes.world_from_file(xyz), TRUTH[name], atol=1e-12)


@pytest.mark.parametrize("axes", FILE_AXES)
def test_covariances_turn_with_the_axes(tmp_path, axes):
    """Sigmas belong to x, y, z whichever of E, N, U those are."""
    network = read(tmp_path, full_network(axes, "left-handed")).network()
    observed = {o.kind: (t, o) for t, o in enumerate(network.observations)}
    turn = facts_of(network.facts, GamaFacts)[0].axes.matrix()
    table, vectors = observed["gnss_baseline"]
    expected = np.array([[4, 1, 2], [1, 9, 3], [2, 3, 16]]) * 1e-6
    np.testing.assert_allclose(turn.T @ vectors.covariance[0] @ turn, expected)
    joint = next(j for j in network.joint if j.table[0] == table)
    np.testing.assert_allclose(turn.T @ joint.covariance @ turn, expected)
    table, coordinates = observed["coordinate"]
    joint = next(j for j in network.joint if j.table[0] == table)
    turned = np.zeros((3, 3))
    turned[np.ix_(coordinates.axis[joint.item], coordinates.axis[joint.item])] = joint.covariance
    expected = np.array([[9, 2, 0], [2, 4, 0], [0, 0, 0]]) * 1e-6
    np.testing.assert_allclose(turn.T @ turned @ turn, expected)


def test_default_standard_deviations(tmp_path):
    body = PLANE + (
        '<obs from="A"><direction to="P" val="10"/><distance to="P" val="4000"/>'
        '<angle bs="B" fs="P" val="10"/><azimuth to="P" val="10"/>'
        '<distance to="B" val="100" stdev="7"/></obs>'
    )
    section = 'direction-stdev="10" angle-stdev="20" azimuth-stdev="30" distance-stdev="5 3 0.5"'
    found = kinds(read(tmp_path, document(body, section=section)))
    sigma = {kind: np.sqrt(o.covariance[:, 0, 0]) for kind, o in found.items()}
    np.testing.assert_allclose(sigma["direction"], 10 * CC)
    np.testing.assert_allclose(sigma["angle"], 20 * CC)
    np.testing.assert_allclose(sigma["azimuth"], 30 * CC)
    np.testing.assert_allclose(sigma["horizontal_distance"], [(5 + 3 * 4**0.5) * 1e-3, 7e-3])


@pytest.mark.parametrize(("model", "sigma"), [("5", 5), ("5 3", 5 + 3 * 4), ("5 3 2", 5 + 3 * 16)])
def test_distance_model(tmp_path, model, sigma):
    body = PLANE + '<obs from="A"><distance to="P" val="4000"/></obs>'
    found = kinds(read(tmp_path, document(body, section=f'distance-stdev="{model}"')))
    assert found["horizontal_distance"].covariance[0, 0, 0] == pytest.approx((sigma * 1e-3) ** 2)


def test_zenith_angle_default(tmp_path):
    body = (
        '<point id="A" x="0" y="0" z="0" fix="xyz"/><point id="B" adj="xyz"/>'
        '<obs from="A"><z-angle to="B" val="95.5"/></obs>'
    )
    found = kinds(read(tmp_path, document(body, section='zenith-angle-stdev="8"')))
    assert found["zenith"].values[0, 0] == pytest.approx(95.5 * GON)
    assert np.sqrt(found["zenith"].covariance[0, 0, 0]) == pytest.approx(8 * CC)


def test_degrees_minutes_seconds(tmp_path):
    body = PLANE + (
        '<obs from="A"><direction to="P" val="57-32-28.428" stdev="3.24"/>'
        '<direction to="B" val="63.9347" stdev="10"/>'
        '<direction to="P" val="-0-00-01" stdev="1"/></obs>'
    )
    directions = kinds(read(tmp_path, document(body)))["direction"]
    expected = [63.9347 * GON, 63.9347 * GON, 2 * np.pi - SEC]
    np.testing.assert_allclose(directions.values[:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(
        np.sqrt(directions.covariance[:, 0, 0]), [3.24 * SEC, 10 * CC, SEC], rtol=1e-12
    )


def test_band_matrix_of_mixed_units(tmp_path):
    """mm, cc and arc seconds in one matrix; right-handed angles change the covariances' sign."""
    body = PLANE + (
        '<obs from="A"><distance to="P" val="50"/><direction to="P" val="10"/>'
        '<direction to="B" val="10-00-00"/>'
        '<cov-mat dim="3" band="1">4 1\n 9 2\n 16</cov-mat></obs>'
    )
    expected = np.array([[4, 1, 0], [1, 9, 2], [0, 2, 16]])
    for hand, sign in (("left-handed", 1), ("right-handed", -1)):
        network = read(tmp_path, document(body, f'angles="{hand}"')).network()
        unit = np.array([1e-3, sign * CC, sign * SEC])
        (joint,) = network.joint
        np.testing.assert_allclose(joint.covariance, expected * np.outer(unit, unit))
        own = {o.kind: o.covariance[:, 0, 0] for o in network.observations}
        np.testing.assert_allclose(own["direction"], [9 * CC**2, 16 * SEC**2])


def test_diagonal_matrix_is_as_good_as_standard_deviations(tmp_path):
    first = full_network("ne", "left-handed")
    sights = [
        '<distance to="C" val="86.979883" {}/>',
        '<direction to="C" val="49.6" {}/>',
        '<s-distance to="D" val="83.5" {}/>',
    ]
    with_sigma = "".join(s.format(f'stdev="{k}"') for k, s in zip((3, 5, 4), sights, strict=True))
    with_matrix = "".join(s.format("") for s in sights)
    matrix = '<cov-mat dim="3" band="0">9 25 16</cov-mat>'
    results = []
    for more in (with_sigma, with_matrix + matrix):
        text = first.replace("<vectors>", f'<obs from="A">{more}</obs><vectors>')
        results.append(adjust(read(tmp_path, text).network()))
    np.testing.assert_allclose(results[0].state.points, results[1].state.points, atol=1e-9)
    np.testing.assert_allclose(results[0].vtpv, results[1].vtpv, rtol=1e-9)


def test_each_set_has_its_own_orientation(tmp_path):
    one = '<obs from="A"><direction to="P" val="{}" stdev="1"/></obs>\n'
    survey = read(tmp_path, document(PLANE + one.format(10) + one.format(250)))
    network = survey.network()
    assert network.start.layout.count("scalar") == 2
    assert list(network.observations[0].source) == ["net.gkf:9", "net.gkf:10"]


def test_height_differences(tmp_path):
    """Sigma from the section's length with sigma-apr, from stdev, in a list and in a set-up."""
    body = LEVEL + (
        '<height-differences><dh from="A" to="B" val="1.5" dist="4"/>'
        '<dh from="A" to="B" val="1.5" stdev="3" dist="4"/></height-differences>'
        '<obs from="A"><dh to="B" val="1.5" stdev="2"/></obs>'
    )
    found = kinds(read(tmp_path, document(body, parameters='sigma-apr="6"')))["height_difference"]
    np.testing.assert_allclose(np.sqrt(found.covariance[:, 0, 0]), [12e-3, 3e-3, 2e-3])


def test_parameters_and_sections_in_any_order(tmp_path):
    text = (
        f"{HEAD}<gama-local {XMLNS}><network>"
        '<points-observations><height-differences><dh from="A" to="B" val="1.5" dist="1"/>'
        f"</height-differences></points-observations><points-observations>{LEVEL}"
        '</points-observations><parameters sigma-apr="2" conf-pr="0.99" sigma-act="apriori"/>'
        "<description>A\n  line</description></network></gama-local>"
    )
    survey = read(tmp_path, text)
    assert survey.network().observations[0].covariance[0, 0, 0] == pytest.approx(4e-6)
    assert survey.sigma0 == 2
    assert survey.title == "A line"
    (facts,) = facts_of(survey.facts, GamaFacts)
    assert (facts.confidence, facts.sigma_act) == (0.99, "apriori")


def test_file_without_namespace(tmp_path):
    text = full_network("ne", "left-handed").replace(XMLNS, 'version="2.0"')
    assert read(tmp_path, text).network().count() == 32


def test_defaults_of_the_format(tmp_path):
    text = f"{HEAD}<gama-local {XMLNS}><network><points-observations>{LEVEL}</points-observations>"
    survey = read(tmp_path, text + "</network></gama-local>")
    assert survey.sigma0 == 10
    (facts,) = facts_of(survey.facts, GamaFacts)
    assert facts.axes.letters == "ne"
    assert facts.sigma_act == "aposteriori"


def test_fixed_counts_before_adjusted(tmp_path):
    body = '<point id="A" x="1" y="2" z="3" fix="xy" adj="XYZ"/>'
    given = read(tmp_path, document(body, 'axes-xy="en"')).points["A"]
    assert list(given.free) == [False, False, True]
    assert given.datum is not None
    assert list(given.datum) == [False, False, True]


def test_coordinates_not_in_use_are_zero(tmp_path):
    body = (
        '<point id="A" x="1" y="2" z="3" fix="xy"/><point id="B" adj="z"/>'
        '<point id="C" x="1" y="2" z="3"/><point id="D" adj="xyz"/>'
    )
    points = read(tmp_path, document(body, 'axes-xy="en"')).points
    assert list(points["A"].xyz) == [1, 2, 0]
    np.testing.assert_array_equal(points["B"].xyz, [0, 0, np.nan])
    assert list(points["C"].xyz) == [0, 0, 0]
    assert np.isnan(points["D"].xyz).all()
    assert not points["C"].free.any()


def test_unusable_observations_are_off_and_said(tmp_path):
    body = PLANE + (
        '<point id="Q" x="5" y="5"/>\n'
        '<obs from="A">\n<z-angle to="P" val="90" stdev="1"/>\n'
        '<distance to="Q" val="7" stdev="1"/>\n<distance to="P" val="50" stdev="1"/>\n'
        '<dh to="B" val="1" stdev="1"/></obs>\n'
        '<obs from="B"><distance to="P" val="60" stdev="1"/></obs>'
    )
    survey = read(tmp_path, document(body))
    found = kinds(survey)
    assert list(found["zenith"].use) == [Use.OFF]
    assert found["zenith"].reason[0] == "the height of A is neither fixed nor adjusted"
    assert list(found["height_difference"].use) == [Use.OFF]
    assert list(found["horizontal_distance"].use) == [Use.OFF, Use.ACTIVE, Use.ACTIVE]
    assert found["horizontal_distance"].reason[0].startswith("the position of Q")
    assert survey.warnings == [
        "3 observations are off because a coordinate that they need is neither fixed nor adjusted "
        "(net.gkf:11, net.gkf:12, net.gkf:14)."
    ]


def square(role):
    """Distances of a 100 m square with diagonals, one point's coordinates wrong by 10 mm."""
    at = {"A": (0, 0), "B": (100, 0), "C": (100, 100), "D": (0.010, 100)}
    lines = [f'<point id="{n}" x="{x}" y="{y}" {role(n)}/>' for n, (x, y) in at.items()]
    lines.append("<obs>")
    for pair, length in zip(
        ("AB", "BC", "CD", "DA", "AC", "BD"), [100] * 4 + [100 * 2**0.5] * 2, strict=True
    ):
        lines.append(f'<distance from="{pair[0]}" to="{pair[1]}" val="{length}" stdev="1"/>')
    return document("\n".join([*lines, "</obs>"]), 'axes-xy="en"')


def test_constrained_coordinates_carry_the_datum(tmp_path):
    """Capitals: the corrections of A and B sum to zero and do not turn, C and D follow."""
    survey = read(tmp_path, square(lambda n: 'adj="XY"' if n in "AB" else 'adj="xy"'))
    adjustment = adjust(survey.network())
    assert adjustment.defect == 3
    assert survey.warnings == []
    expected = [[0, 0], [100, 0], [100, 100], [0, 100]]
    np.testing.assert_allclose(adjustment.state.points[:, :2], expected, atol=1e-7)


def test_without_any_control_all_points_carry_the_datum(tmp_path):
    survey = read(tmp_path, square(lambda n: 'adj="xy"'))
    assert survey.warnings == [
        "No coordinate is fixed, observed or constrained: all points carry the datum."
    ]
    adjustment = adjust(survey.network())
    # the true square moved by the mean of the given corners' errors and turned by -0.025 mrad
    corners = np.array([[0, 0], [100, 0], [100, 100], [0, 100]])
    turned = -0.025e-3 * (corners - 50) @ [[0, 1], [-1, 0]]
    expected = corners + np.array([2.5e-3, 0]) + turned
    np.testing.assert_allclose(adjustment.state.points[:, :2], expected, atol=1e-6)


def test_observed_coordinates_are_control(tmp_path):
    body = (
        '<coordinates><point id="A" x="1" y="2" adj="xy"/><point id="B" y="2" x="9"/>'
        '<cov-mat dim="4" band="0">1 1 4 4</cov-mat></coordinates>'
        '<point id="B" adj="xy"/><obs><distance from="A" to="B" val="8.001" stdev="1"/></obs>'
    )
    survey = read(tmp_path, document(body, 'axes-xy="en"'))
    assert survey.datum.kind == "control"
    assert list(survey.points["B"].xyz) == [9, 2, 0]
    adjustment = adjust(survey.network())
    # corrections of x share the misclosure of 1 mm as 1 : 4 : 1 (variances)
    east = dict(zip(adjustment.layout.names["point"], adjustment.state.points[:, 0], strict=True))
    assert east["A"] == pytest.approx(1 - 1e-3 / 6, abs=1e-8)
    assert east["B"] == pytest.approx(9 + 4e-3 / 6, abs=1e-8)


def test_reductions_to_the_ellipsoid_are_not_made_and_said(tmp_path):
    survey = read(tmp_path, document(LEVEL, parameters='ellipsoid="wgs84" surprise="1"'))
    assert survey.warnings[0].startswith("net.gkf:4: ellipsoid is given")
    assert survey.warnings[1] == "net.gkf:4: surprise has no effect."


OBS = '<obs from="A">{}</obs>'
#: body, line of the error, what it says
BAD = {
    "no station": (PLANE + '<obs><distance to="A" val="1" stdev="1"/></obs>', 9, "no station"),
    "no target": (PLANE + OBS.format('<distance val="1" stdev="1"/>'), 9, "has no to"),
    "no value": (PLANE + OBS.format('<distance to="P" stdev="1"/>'), 9, "has no val"),
    "no sigma": (PLANE + OBS.format('<distance to="P" val="1"/>'), 9, "no standard deviation"),
    "zero sigma": (
        PLANE + OBS.format('<direction to="P" val="1" stdev="0"/>'),
        9,
        "stdev of <direction> is 0",
    ),
    "negative sigma": (
        PLANE + OBS.format('<direction to="P" val="1" stdev="-2"/>'),
        9,
        "stdev of <direction> is -2",
    ),
    "no number": (
        PLANE + OBS.format('<distance to="P" val="1,5" stdev="1"/>'),
        9,
        "not a number: '1,5'",
    ),
    "infinite": (
        PLANE + OBS.format('<distance to="P" val="inf" stdev="1"/>'),
        9,
        "not a finite number",
    ),
    "nan angle": (
        PLANE + OBS.format('<direction to="P" val="nan" stdev="1"/>'),
        9,
        "not a finite angle",
    ),
    "no angle": (
        PLANE + OBS.format('<direction to="P" val="12-61-00" stdev="1"/>'),
        9,
        "is not an angle",
    ),
    "negative distance": (
        PLANE + OBS.format('<distance to="P" val="-5" stdev="1"/>'),
        9,
        "val of <distance> is -5",
    ),
    "zenith angle below": (
        PLANE + OBS.format('<z-angle to="P" val="450" stdev="1"/>'),
        9,
        "not between 0 and 400 gon",
    ),
    "to itself": (
        PLANE + OBS.format('<distance to="A" val="5" stdev="1"/>'),
        9,
        "the same point at two ends",
    ),
    "unknown element": (
        PLANE + OBS.format('<bearing to="P" val="5"/>'),
        9,
        "<bearing> is unknown in <obs>",
    ),
    "unknown section": (PLANE + "<offsets/>", 9, "<offsets> is unknown"),
    "misspelt attribute": (
        PLANE + OBS.format('<distance to="P" val="5" stdv="1"/>'),
        9,
        "has no attribute stdv",
    ),
    "point twice": (PLANE + '<point id="A" adj="xy"/>', 9, "point A is defined twice"),
    "point without id": (PLANE + '<point adj="xy"/>', 9, "<point> has no id"),
    "unknown role": ('<point id="A" fix="yx" x="1" y="2"/>', 6, "fix is 'yx'"),
    "fixed at nowhere": ('<point id="A" fix="xyz" x="1" y="2"/>', 6, "fixed without z"),
    "x alone": ('<point id="A" adj="xy" x="1"/>', 6, "x and y must be given together"),
    "point no number": ('<point id="A" fix="z" z="12m"/>', 6, "not a number: '12m'"),
    "length in a set-up": (
        LEVEL + OBS.format('<dh to="B" val="1" dist="1"/>'),
        8,
        "no standard deviation",
    ),
    "zero length": (
        LEVEL + '<height-differences><dh from="A" to="B" val="1" dist="0"/></height-differences>',
        8,
        "dist of <dh> is 0",
    ),
    "no matrix": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/></coordinates>',
        9,
        "<coordinates> has no covariance matrix",
    ),
    "observed nothing": (
        PLANE + '<coordinates><point id="P"/><cov-mat dim="0" band="0"/></coordinates>',
        9,
        "point P has no coordinates here",
    ),
    "matrix of wrong size": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/>'
        '\n<cov-mat dim="3" band="0">1 1 1</cov-mat></coordinates>',
        10,
        "has dimension 3 for 2 values",
    ),
    "matrix with a hole": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/>'
        '\n<cov-mat dim="2" band="1">1 1</cov-mat></coordinates>',
        10,
        "has 2 elements instead of 3",
    ),
    "matrix not positive": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/>'
        '\n<cov-mat dim="2" band="1">1 2 1</cov-mat></coordinates>',
        10,
        "not symmetric and positive definite",
    ),
    "matrix broken": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/>'
        '\n<cov-mat dim="2" band="0">1 a</cov-mat></coordinates>',
        10,
        "not a number: 'a'",
    ),
    "odd band": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/>'
        '\n<cov-mat dim="2" band="0.5">1 1</cov-mat></coordinates>',
        10,
        "band is 0.5",
    ),
    "two matrices": (
        PLANE + '<coordinates><point id="P" x="1" y="2"/><cov-mat dim="2" band="0">1 1</cov-mat>'
        '\n<cov-mat dim="2" band="0">1 1</cov-mat></coordinates>',
        10,
        "a second covariance matrix",
    ),
    "vector with a hole": (
        PLANE + '<vectors><vec from="A" to="P" dx="1" dy="1"/></vectors>',
        9,
        "<vec> has no dz",
    ),
}


def test_observations_of_undefined_points_are_left_out(tmp_path):
    """As gama-local does; what is left has its own part of the covariance matrix."""
    matrix = np.array([[4, 1, 2, 1], [1, 9, 3, 2], [2, 3, 16, 1], [1, 2, 1, 25]])
    band = " ".join(str(matrix[i, j]) for i in range(4) for j in range(i, 4))
    body = PLANE + (
        '<obs from="A">\n<direction to="B" val="0"/>\n<direction to="X" val="20"/>\n'
        f'<direction to="P" val="50"/><distance to="P" val="80"/><cov-mat dim="4" band="3">{band}'
        '</cov-mat></obs>\n<obs from="X"><distance to="A" val="1" stdev="1"/></obs>\n'
        '<obs from="B"><angle bs="A" fs="Y" val="9" stdev="1"/>'
        '<distance to="P" val="70" stdev="1"/></obs>\n'
        '<coordinates><point id="Z" x="1" y="2"/><cov-mat dim="2" band="0">1 1</cov-mat>'
        "</coordinates>"
    )
    survey = read(tmp_path, document(body))
    assert survey.warnings == [
        "Point X is not defined: the observations of it are left out (net.gkf:11, net.gkf:13).",
        "Point Y is not defined: the observation of it is left out (net.gkf:14).",
        "Point Z is not defined: the observation of it is left out (net.gkf:15).",
    ]
    network = survey.network()
    (joint,) = network.joint
    kept = [0, 2, 3]
    unit = np.array([CC, CC, 1e-3])
    expected = matrix[np.ix_(kept, kept)] * np.outer(unit, unit)
    np.testing.assert_allclose(joint.covariance, expected, rtol=1e-12)
    assert set(survey.points) == {"A", "B", "P"}
    assert adjust(network).n_observations == 4


#: a trilateration with a cluster in which directions to U, which nothing else sees, are correlated
HANGING = PLANE + (
    '<point id="Q" adj="xy"/>\n{points}<obs from="A">\n<distance to="P" val="70.7" stdev="5"/>'
    '<distance to="Q" val="111.8" stdev="5"/></obs>\n<obs from="B">\n'
    '<distance to="P" val="70.72" stdev="5"/><distance to="Q" val="50.01" stdev="5"/></obs>\n'
    '<obs from="P"><direction to="A" val="350"/><direction to="B" val="250"/>{directions}'
    '<direction to="Q" val="200"/>{matrix}</obs>\n{more}'
)


def band(matrix: np.ndarray) -> str:
    """A full covariance matrix as an element."""
    n = len(matrix)
    numbers = " ".join(str(matrix[i, j]) for i in range(n) for j in range(i, n))
    return f'<cov-mat dim="{n}" band="{n - 1}">{numbers}</cov-mat>'


def test_points_that_nothing_places_are_left_out(tmp_path):
    """As gama-local does: the rest is adjusted as if they were not in the file."""
    matrix = 100 * (np.eye(4) + 0.2)
    more = '<obs from="U"><distance to="V" val="9" stdev="5"/></obs>\n'
    body = HANGING.format(
        points='<point id="U" adj="xy"/><point id="V" adj="xy"/>',
        directions='<direction to="U" val="120"/>',
        matrix=band(matrix),
        more=more,
    )
    survey = observed_part(read(tmp_path, document(body)))
    assert survey.warnings == [
        "Point U cannot be placed: it is left out with its observations (net.gkf:14, net.gkf:15).",
        "Point V cannot be placed: it is left out with its observation (net.gkf:15).",
    ]
    kept = [0, 1, 3]
    alone = HANGING.format(
        points="", directions="", matrix=band(matrix[np.ix_(kept, kept)]), more=""
    )
    found, expected = (
        adjust(s.network()) for s in (survey, observed_part(read(tmp_path, document(alone))))
    )
    assert found.layout.names["point"] == expected.layout.names["point"]
    np.testing.assert_allclose(found.state.points, expected.state.points, atol=1e-9)
    np.testing.assert_allclose(
        found.covariance("P", "Q"), expected.covariance("P", "Q"), rtol=1e-9, atol=1e-16
    )
    assert found.dof == expected.dof == 2


def test_a_network_of_which_half_hangs_is_not_taken_apart(tmp_path):
    points = "".join(f'<point id="U{k}" adj="xy"/>' for k in range(5))
    more = "".join(
        f'<obs from="A"><direction to="U{k}" val="1" stdev="1"/></obs>' for k in range(5)
    )
    body = HANGING.format(points=points, directions="", matrix=band(np.eye(3)), more=more)
    with pytest.raises(NoStartValues, match="U3"):
        adjust(observed_part(read(tmp_path, document(body))).network())


@pytest.mark.parametrize("case", BAD)
def test_bad_input_names_file_and_line(tmp_path, case):
    body, line, words = BAD[case]
    with pytest.raises(InputError) as caught:
        read(tmp_path, document(body))
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'net.gkf'}:{line}: ")
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("heads", "words"),
    [
        ({"network": 'axes-xy="nn"'}, ":3: axes-xy is 'nn'"),
        ({"network": 'angles="clockwise"'}, ":3: angles is 'clockwise'"),
        ({"network": 'axis-xy="en"'}, ":3: <network> has no attribute axis-xy"),
        ({"parameters": 'sigma-apr="0"'}, ":4: sigma-apr of <parameters> is 0"),
        ({"parameters": 'sigma-act="both"'}, ":4: sigma-act is 'both'"),
        ({"parameters": 'conf-pr="95"'}, ":4: conf-pr is 95"),
        ({"section": 'direction-sdtev="5"'}, ":5: <points-observations> has no attribute"),
    ],
)
def test_bad_heads(tmp_path, heads, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, document(LEVEL, **heads))
    assert words in str(caught.value)


def test_bad_distance_model(tmp_path):
    body = PLANE + OBS.format('<distance to="P" val="5"/>')
    for model, words in (("1 2 3 4", "more than three"), ("5;3", "not a number")):
        with pytest.raises(InputError, match=words):
            read(tmp_path, document(body, section=f'distance-stdev="{model}"'))


def test_networks_missing_or_doubled(tmp_path):
    with pytest.raises(InputError, match="there are 0 <network> elements"):
        read(tmp_path, f"<gama-local {XMLNS}/>")
    with pytest.raises(InputError, match="there is no <points-observations>"):
        read(tmp_path, f"<gama-local {XMLNS}><network/></gama-local>")
    with pytest.raises(InputError, match="the root element is"):
        read(tmp_path, "<dna/>")


#: what a plain sight may have, and next to it what makes one not plain
SIGHTS = """<point id="A" x="0" y="0" z="0" fix="xyz"/>
<point id="B" x="100" y="0" z="1" adj="xyz"/>
<point id="C" x="0" y="100" adj="xy"/>
<obs from="A" from_dh="1.5">
<direction to="B" val="399.9999" stdev="10"/>
<direction to=" C " val=" 0.0000 " stdev="10"/>
<direction to="B" val="410.5" stdev="10"/>
<direction to="C" val="12-30-15.5" stdev="3"/>
<direction to="D" val="1" stdev="3"/>
<z-angle to="B" val="98.5" stdev="1e1" from_dh="1.6" to_dh="0.1"/>
<z-angle to="C" val="98.5" stdev="10"/>
<s-distance to="B" val="+100.005" stdev="2" extern="x"/>
<s-distance to="B" val="100.006" stdev="2"/>
<distance to="B" val="100" stdev="2"/>
<!-- a comment -->
</obs>
<obs from="B">
<direction to="A" val="17.123456" stdev="5"/><direction to="C" val="80" stdev="5"/>
<cov-mat dim="2" band="0">25 25</cov-mat>
</obs>
"""


@pytest.mark.parametrize("hand", HANDS)
def test_plain_sights_are_read_as_all_others(tmp_path, hand, monkeypatch):
    """Columns filled at once are those that elements fill, to the last digit, with their lines."""
    text = document(SIGHTS, f'axes-xy="ne" angles="{hand}"')
    plain = read(tmp_path, text)
    taken = [t.n for t in plain.tables()]
    monkeypatch.setattr(observations, "_PLAIN_SIGHTS", {})
    other = read(tmp_path, text)
    assert plain.warnings == other.warnings
    assert taken == [t.n for t in other.tables()] == [6, 2, 2, 1]
    for one, two in zip(plain.tables(), other.tables(), strict=True):
        assert (one.kind, one.group, one.columns.keys()) == (
            two.kind,
            two.group,
            two.columns.keys(),
        )
        for name, column in one.columns.items():
            assert np.array_equal(column, two.columns[name]), name


@pytest.mark.parametrize(
    ("sight", "what"),
    [
        ('<direction to="B" val="nan" stdev="10"/>', "val of <direction> is not a finite angle"),
        ('<direction to="B" val="1" stdev="0"/>', "stdev of <direction> is 0"),
        ('<direction to="B" val="1" stdev="-1"/>', "stdev of <direction> is -1"),
        ('<direction to="A" val="1" stdev="1"/>', "<direction> has the same point at two ends"),
        ('<direction to="B" val="900" stdev="1"/>', "direction: 900 gon .* more than 2 circles"),
        ('<direction to="B" val="1" stdev="1" odd="1"/>', "<direction> has no attribute odd"),
        ('<direction val="1" stdev="1"/>', "<direction> has no to"),
        ('<z-angle to="B" val="200" stdev="1"/>', "the zenith angle is not between 0 and 400"),
        ('<s-distance to="B" val="0" stdev="1"/>', "val of <s-distance> is 0"),
        ('<s-distance to="B" val="1e300" stdev="1"/>', "beyond any measurement"),
        ('<s-distance to="B" val="1" stdev="1" to_dh="20000"/>', "height target of .* is 20000 m"),
    ],
)
def test_sights_that_are_not_plain_are_refused_with_their_line(tmp_path, sight, what):
    text = document(SIGHTS).splitlines()
    line = next(k for k, one in enumerate(text) if "100.006" in one)
    text[line] = sight
    with pytest.raises(InputError, match=what) as error:
        read(tmp_path, "\n".join(text))
    assert error.value.line == line + 1


def test_all_sights_that_are_refused_are_told(tmp_path):
    """Those that only the survey refuses come to the others, each with its line."""
    text = document(
        SIGHTS.replace('val="410.5"', 'val="1410.5"').replace('val="399.9999"', 'val="900"')
    )
    with pytest.raises(Refusals) as refused:
        read(tmp_path, text)
    assert [e.line for e in refused.value.errors] == [
        1 + next(k for k, one in enumerate(text.splitlines()) if word in one)
        for word in ('val="900"', "1410.5")
    ]
