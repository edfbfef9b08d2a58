"""DynaML and DNA readers on small synthetic networks: one meaning in both formats."""

import json

import numpy as np
import pytest

from tests.io.survey.dynadjust_files import (
    Gnss,
    Line,
    Network,
    Station,
    baseline,
    write_dna,
    write_jsonl,
    write_xml,
)
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.geodesy.site import EllipsoidSite, ecef_from_geodetic, enu_rotation
from tribrach.io.survey.dynadjust import reader as dynadjust
from tribrach.network.adjustment import adjust
from tribrach.observations.base import Use

FORMATS = {"dna": write_dna, "xml": write_xml, "jsonl": write_jsonl}
LATITUDE, LONGITUDE = np.radians(-36.5), np.radians(146.25)
#: rows east, north, up in ECEF at A
ENU = enu_rotation(np.float64(LATITUDE), np.float64(LONGITUDE))
A = ecef_from_geodetic(np.float64(LATITUDE), np.float64(LONGITUDE), np.float64(200.0))
OFFSETS = {
    "A": (0, 0, 0),
    "B": (900.0, 400.0, 30.0),
    "C": (-300.0, 1200.0, -10.0),
    "D": (500, -700, 5),
}
#: true ECEF, rounded to the 0.1 mm of the files
TRUE = {name: np.round(A + np.array(v) @ ENU, 4) for name, v in OFFSETS.items()}


def covariance(seed: int, n: int = 1, sigma: float = 0.003) -> np.ndarray:
    """A full covariance (3n, 3n) with strong correlations."""
    factor = np.random.default_rng(seed).normal(size=(3 * n, 3 * n))
    return sigma**2 * (factor @ factor.T / (3 * n) + np.eye(3 * n))


def stations(**constraints: str) -> list[Station]:
    """The four stations, their given coordinates a little wrong unless constrained."""
    out = []
    for i, (name, x) in enumerate(TRUE.items()):
        letters = constraints.get(name, "FFF")
        given = x if "C" in letters else x + 0.02 * (i + 1)
        out.append(Station(name, [f"{v:.4f}" for v in given], letters))
    return out


def points(names: str, c: np.ndarray, **more) -> Gnss:
    """A point cluster at the true places."""
    values = [[f"{v:.4f}" for v in TRUE[n]] for n in names]
    return Gnss("Y", [(n, "") for n in names], values, c, **more)


def cluster(pairs: list[str], c: np.ndarray, **more) -> Gnss:
    """A baseline cluster of true vectors."""
    values = [[f"{v:.4f}" for v in TRUE[b] - TRUE[a]] for a, b in pairs]
    return Gnss("X", [tuple(p) for p in pairs], values, c, **more)


def full() -> Network:
    """Every GNSS type, consistent with the truth."""
    return Network(
        stations(),
        [
            baseline("A", "B", TRUE["B"] - TRUE["A"], covariance(1)),
            baseline("B", "C", TRUE["C"] - TRUE["B"], covariance(2), scales=(4, 1, 1, 1)),
            cluster(["AC", "AD"], covariance(3, 2)),
            points("AB", covariance(4, 2)),
            baseline("C", "D", TRUE["D"] - TRUE["C"], covariance(5)),
        ],
    )


@pytest.fixture(params=FORMATS)
def read(request, tmp_path):
    """Write a network in one of the formats and read it."""
    write = FORMATS[request.param]
    return lambda network: dynadjust.read(write(network, tmp_path))


def table(survey, kind):
    """The network's observations of a kind."""
    return next(o for o in survey.network().observations if o.kind == kind)


def ecef(adjustment, name):
    """Adjusted ECEF of a point."""
    x = adjustment.state.points[adjustment.layout.index("point", name)]
    return adjustment.network.site.to_ecef(x[None])[0]


def test_adjusts_to_the_truth(read):
    adjustment = adjust(read(full()).network())
    assert adjustment.dof == 15 + 6 - 12
    for name, x in TRUE.items():
        np.testing.assert_allclose(ecef(adjustment, name), x, atol=2e-8)


def test_dense_least_squares_agrees(read):
    """Covariance of the estimates against the plain Gauss-Markov formulas in ECEF."""
    survey = read(full())
    adjustment = adjust(survey.network())
    index = {name: 3 * i for i, name in enumerate("ABCD")}
    ends = ["AB", "BC", "AC", "AD", "CD"]
    design = np.zeros((21, 12))
    for k, (a, b) in enumerate(ends):
        design[3 * k : 3 * k + 3, index[a] : index[a] + 3] = -np.eye(3)
        design[3 * k : 3 * k + 3, index[b] : index[b] + 3] = np.eye(3)
    design[15:21, 0:6] = np.eye(6)
    c = np.zeros((21, 21))
    for at, block in ((0, covariance(1)), (3, 4 * covariance(2)), (6, covariance(3, 2)),
                      (12, covariance(5)), (15, covariance(4, 2))):  # fmt: skip
        c[at : at + len(block), at : at + len(block)] = block
    cofactor = np.linalg.inv(design.T @ np.linalg.solve(c, design))
    turn = survey.site.w_from_ecef
    for a in "ABCD":
        for b in "ABCD":
            expected = cofactor[index[a] : index[a] + 3, index[b] : index[b] + 3]
            got = turn.T @ adjustment.covariance(a, b) @ turn
            np.testing.assert_allclose(got, expected, atol=1e-12)


def test_both_formats_give_the_same_network(tmp_path):
    networks = [dynadjust.read(w(full(), tmp_path)).network() for w in FORMATS.values()]
    for a, b in zip(networks[0].observations, networks[1].observations, strict=True):
        assert type(a) is type(b)
        np.testing.assert_array_equal(a.values, b.values)
        np.testing.assert_array_equal(a.covariance, b.covariance)
    for a, b in zip(networks[0].joint, networks[1].joint, strict=True):
        np.testing.assert_array_equal(a.covariance, b.covariance)


def test_partial_scales_stretch_local_axes(read):
    """P, L and H multiply variances in north, east and up, V everything."""
    middle = TRUE["A"] + (TRUE["B"] - TRUE["A"]) / 2
    site = EllipsoidSite(0.0, 0.0, 0.0)
    axes = site.axes(site.from_ecef(middle[None]))[0] @ site.w_from_ecef
    local = np.diag([1e-6, 4e-6, 9e-6])  # east, north, up
    given = baseline("A", "B", TRUE["B"] - TRUE["A"], axes.T @ local @ axes, scales=(2, 3, 5, 7))
    network = Network(stations(A="CCC"), [given])
    survey = read(network)
    turn = axes @ survey.site.w_from_ecef.T
    got = turn @ table(survey, "gnss_baseline").covariance[0] @ turn.T
    np.testing.assert_allclose(got, 2 * np.diag([5e-6, 12e-6, 63e-6]), rtol=1e-6, atol=1e-10)


def test_geographic_points(read):
    """Latitude and longitude in degrees.minutesseconds, variances in rad^2."""
    c = np.diag([1e-18, 4e-18, 1e-4])
    at = ["-36.3000000000", "146.1500000000", "200.0000"]
    network = Network(stations(), [Gnss("Y", [("A", "")], [at], c, coordinates="LLh")])
    survey = read(network)
    position = table(survey, "gnss_position")
    np.testing.assert_allclose(survey.site.to_ecef(position.values)[0], A, atol=1e-8)
    axes = survey.site.axes(position.values)[0]
    step = 1e-7
    by_latitude = (
        ecef_from_geodetic(np.float64(LATITUDE + step), np.float64(LONGITUDE), np.float64(200.0))
        - A
    ) / step
    by_longitude = (
        ecef_from_geodetic(np.float64(LATITUDE), np.float64(LONGITUDE + step), np.float64(200.0))
        - A
    ) / step
    up = ENU[2]
    jacobian = np.stack([by_latitude, by_longitude, up], axis=1)
    turn = axes @ survey.site.w_from_ecef
    expected = turn @ jacobian @ c @ jacobian.T @ turn.T
    np.testing.assert_allclose(
        axes @ position.covariance[0] @ axes.T, expected, rtol=1e-6, atol=1e-11
    )
    assert not [w for w in survey.warnings if "orthometric" in w]


def test_orthometric_heights_are_announced(read):
    at = ["-36.3000000000", "146.1500000000", "200.0000"]
    c = np.diag([1e-18, 1e-18, 1e-4])
    network = Network(stations(), [Gnss("Y", [("A", "")], [at], c, coordinates="LLH")])
    assert any("orthometric" in warning for warning in read(network).warnings)


def test_ignored_measurements_stay_as_off(read):
    network = full()
    wrong = baseline("A", "D", TRUE["D"] - TRUE["A"] + 5.0, covariance(9), ignored=True)
    network.measurements.insert(1, wrong)
    survey = read(network)
    lines = table(survey, "gnss_baseline")
    off = np.flatnonzero(lines.use == Use.OFF)
    assert len(off) == 1
    assert lines.reason[off[0]] == "ignored in the file"
    adjustment = adjust(survey.network())
    assert adjustment.dof == 9
    np.testing.assert_allclose(ecef(adjustment, "D"), TRUE["D"], atol=2e-8)


def test_sources_name_file_and_line(read):
    sources = table(read(full()), "gnss_baseline").source
    for source in sources:
        path, _, line = source.rpartition(":")
        with open(path) as file:
            text = file.read().splitlines()[int(line) - 1]
        words = "<DnaMeasurement>", "<GPSBaseline>", '{"DnaMeasurement"'
        assert text[:1] in "GX" or any(word in text for word in words)


def test_constrained_station_carries_the_datum(read):
    network = full()
    network.stations = stations(A="CCC")
    del network.measurements[3]
    survey = read(network)
    adjustment = adjust(survey.network())
    assert survey.datum.kind == "control"
    np.testing.assert_allclose(ecef(adjustment, "C"), TRUE["C"], atol=2e-8)
    np.testing.assert_array_equal(adjustment.covariance("A"), np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("type_", "letters", "held"),
    [("XYZ", "CFF", "X"), ("LLh", "CFF", "north"), ("LLh", "FCF", "east"), ("LLh", "FFC", "up"),
     ("LLh", "CCF", "north east")],
)  # fmt: skip
def test_partly_constrained_station(read, type_, letters, held):
    """The component named by each letter keeps its given value; the others follow the points."""
    network = full()
    values = [f"{v:.4f}" for v in TRUE["A"]]
    if type_ == "LLh":
        values = ["-36.3000010000", "146.1500010000", "200.5000"]
    network.stations[0] = Station("A", values, letters, type_)
    survey = read(network)
    adjustment = adjust(survey.network())
    given = survey.site.to_ecef(survey.points["A"].xyz[None])[0]
    moved = ecef(adjustment, "A") - given
    axes = {"X": np.eye(3)[0], "east": ENU[0], "north": ENU[1], "up": ENU[2]}
    for name in held.split():
        assert abs(axes[name] @ moved) < 1e-6
    if type_ == "LLh":
        assert np.linalg.norm(moved) > 0.1
    assert adjustment.n_constraints == letters.count("C")


def test_free_network_keeps_the_mean_of_the_given_places(read):
    network = full()
    del network.measurements[3]
    survey = read(network)
    assert survey.datum.kind == "free"
    assert any("inner constraints" in warning for warning in survey.warnings)
    adjustment = adjust(survey.network())
    given = np.mean([[float(v) for v in s.values] for s in network.stations], axis=0)
    mean = np.mean([ecef(adjustment, name) for name in TRUE], axis=0)
    np.testing.assert_allclose(mean, given, atol=1e-8)


def test_unmeasured_and_ignored_only_stations(read):
    network = full()
    network.stations.append(Station("lonely", [f"{v:.4f}" for v in TRUE["A"] + 9]))
    network.stations.append(Station("silent", [f"{v:.4f}" for v in TRUE["A"] + 8]))
    network.measurements.append(baseline("A", "silent", np.ones(3), covariance(8), ignored=True))
    survey = read(network)
    assert "lonely" not in survey.points
    assert any("lonely" in warning for warning in survey.warnings)
    assert any("silent" in warning for warning in survey.warnings)
    assert adjust(survey.network()).dof == 9


@pytest.mark.parametrize("zone", ["S55", "55"])
def test_projected_station(read, zone):
    """Flinders Peak in MGA94 zone 55 and geographically (GDA Technical Manual)."""
    network = Network(
        [
            Station("grid", ["273741.2966", "5796489.7769", "0.0"], "FFF", "UTM", zone),
            Station("geographic", ["-37.570372030", "144.252952440", "0.0"], "FFF", "LLh"),
        ],
        [baseline("grid", "geographic", np.array([0.0, 0, 1e-3]), covariance(1))],
    )
    survey = read(network)
    a, b = survey.points["grid"].xyz, survey.points["geographic"].xyz
    assert np.linalg.norm(a - b) < 1e-3


def test_baselines_of_another_frame_are_turned(read):
    """An ITRF2014 vector at its epoch against both its ends transformed by hand."""
    network = full()
    vector = TRUE["B"] - TRUE["A"]
    network.measurements[0] = baseline(
        "A", "B", vector, covariance(1), frame="ITRF2014", epoch="01.07.2010"
    )
    survey = read(network)
    start = np.array([float(v) for v in network.stations[0].values])
    year = 2010 + 181 / 365
    ends = frames.transform(np.stack([start, start + vector]), "ITRF2014", "GDA2020", year)[0]
    expected = survey.site.w_from_ecef @ (ends[1] - ends[0])
    got = table(survey, "gnss_baseline").values[0]
    np.testing.assert_allclose(got, expected, atol=1e-8)
    assert 1e-5 < np.linalg.norm(got - survey.site.w_from_ecef @ vector) < 1e-3


BAD = {
    "unknown station": (
        lambda n: n.measurements.append(baseline("A", "Q", np.ones(3), covariance(1))),
        "station Q is in no station file",
    ),
    "duplicate": (lambda n: n.stations.append(n.stations[0]), "defined twice"),
    "covariance": (
        lambda n: n.measurements.append(
            baseline("A", "B", np.ones(3), np.array([[1.0, 2, 0], [2, 1, 0], [0, 0, 1]]))
        ),
        "positive definite",
    ),
    "zero variance": (
        lambda n: n.measurements.append(baseline("A", "B", np.ones(3), np.zeros((3, 3)))),
        "positive definite",
    ),
    "scale": (
        lambda n: n.measurements.append(
            baseline("A", "B", np.ones(3), covariance(1), scales=(1, 0, 1, 1))
        ),
        "covariance scale is 0",
    ),
    "not a number": (
        lambda n: n.measurements.append(
            Gnss("G", [("A", "B")], [["nan", "1", "1"]], covariance(1))
        ),
        "not a number",
    ),
    "text": (
        lambda n: n.measurements.append(Gnss("G", [("A", "B")], [["1", "a", "1"]], covariance(1))),
        "'a', not a number",
    ),
    "frame": (
        lambda n: n.measurements.append(
            baseline("A", "B", np.ones(3), covariance(1), frame="ATLANTIS")
        ),
        "'ATLANTIS' is not known",
    ),
    "epoch": (
        lambda n: n.measurements.append(
            baseline("A", "B", np.ones(3), covariance(1), frame="ITRF2014", epoch="31.02.2015")
        ),
        "'31.02.2015' is not a date",
    ),
    "constraints": (lambda n: setattr(n.stations[0], "constraints", "CXF"), "'CXF'"),
    "coordinate type": (lambda n: setattr(n.stations[0], "type", "ABC"), "'ABC'"),
    "minutes": (
        lambda n: n.stations.append(Station("E", ["-36.6100", "146.15", "1"], type="LLh")),
        "more than 60",
    ),
    "zone": (
        lambda n: n.stations.append(
            Station("E", ["500000", "6000000", "1"], type="UTM", zone="X99")
        ),
        "hemisphere and zone",
    ),
    "cluster coordinates": (
        lambda n: setattr(n.measurements[3], "coordinates", "ABC"),
        "'ABC' of the point cluster",
    ),
    "type": (
        lambda n: n.measurements.append(Line("F", ["A", "B"], 3.0, 0.01)),
        "measurement type F (unknown) is not read",
    ),
    "no measurements": (lambda n: n.measurements.clear(), "no observations"),
    "no stations": (lambda n: n.stations.clear(), "there are no stations"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named(read, case, tmp_path):
    spoil, sentence = BAD[case]
    network = full()
    spoil(network)
    with pytest.raises(InputError) as caught:
        read(network).network()
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
    if case != "no measurements":
        assert str(tmp_path) in str(caught.value)


def test_positions_of_another_epoch_are_refused(read):
    network = full()
    network.frame, network.epoch = "ITRF2014", "01.01.2020"
    network.measurements = [
        points("A", covariance(1), frame="ITRF2014", epoch="01.01.2015"),
        *network.measurements[:1],
    ]
    with pytest.raises(InputError, match=r"epoch 01\.01\.2015 of ITRF2014"):
        read(network)


def test_baselines_of_another_epoch_are_warned_about(read):
    network = full()
    network.frame, network.epoch = "ITRF2014", "01.01.2020"
    for m in network.measurements:
        m.frame = "ITRF2014"
    network.measurements[0].epoch = "01.01.2015"
    assert any("turn of the plate" in warning for warning in read(network).warnings)


def test_uncertain_frames_are_warned_about(read):
    network = full()
    network.measurements[3].frame = "WGS84"
    assert any("stated accuracy 3 m" in warning for warning in read(network).warnings)


def test_ignored_type_that_is_not_read_is_reported(read):
    network = full()
    network.measurements.append(Line("F", ["A", "B"], 3.0, 0.01, ignored=True))
    assert any("type F" in warning for warning in read(network).warnings)


def test_broken_files(tmp_path):
    cases = {
        "no header\n": "not the header",
        "!#=DNA 2.00 STN\n": "not the header",
        "!#=DNA 3.01 MSR\nG A                   B\n": "the file ends",
        "": "empty",
        "<DnaXmlFormat>": "XML cannot be read",
        "<other/>": "root element is <other>",
        "<DnaXmlFormat><Thing/></DnaXmlFormat>": "<Thing>",
        "<DnaXmlFormat><DnaStation/></DnaXmlFormat>": "no <",
        '<!DOCTYPE a [<!ENTITY b "c">]>\n<DnaXmlFormat/>': "entities",
        '<?xml version="1.0" encoding="x-nonsense"?><DnaXmlFormat/>': "XML cannot",
    }
    for text, sentence in cases.items():
        path = tmp_path / "net.txt"
        path.write_text(text)
        with pytest.raises(InputError) as caught:
            dynadjust.read(path)
        assert sentence in str(caught.value), text
    path.write_bytes(b"!#=DNA 3.01 STN\n\xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        dynadjust.read(path)
    with pytest.raises(InputError, match="cannot be read"):
        dynadjust.read(tmp_path / "absent.stn")


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("{", "not JSON"),
        ('{"DnaStation":[]}', "no record"),
        ('{"DnaThing":{}}', "not of DynaML"),
        ('{"DnaMeasurement":{"Type":"G","First":"A","Second":"B"}}', "0 of 1"),
        ('{"DnaMeasurement":{"Type":"S","a b":"1"}}', "not of DynaML"),
        ("[" * 100_000, "not JSON"),
    ],
)
def test_what_is_no_line_of_json_of_dynadjust(tmp_path, line, what):
    stations, measurements = write_jsonl(full(), tmp_path)
    measurements.write_text(f"{measurements.read_text()}{line}\n")
    with pytest.raises(InputError, match=what) as caught:
        dynadjust.read([stations, measurements])
    assert str(caught.value).count(f":{len(measurements.read_text().splitlines())}:") == 1


def test_json_lines_may_have_flags_texts_and_stations_of_the_measurement(tmp_path):
    """What DynAdjust takes: Ignore as a boolean, numbers as texts, ends beside the list."""
    stations, measurements = write_jsonl(full(), tmp_path)
    vector = dict.fromkeys("XYZ", "1.5") | {f"Sigma{a}{a}": "1e-4" for a in "XYZ"}
    vector |= {f"Sigma{pair}": 0 for pair in ("XY", "XZ", "YZ")}
    record = {"GPSBaseline": [vector], "Type": "G", "Ignore": True, "First": "A", "Second": "B"}
    measurements.write_text(
        json.dumps({"DnaAdjustmentReport": {"referenceframe": "GDA2020", "epoch": "01.01.2020"}})
        + "\n"
        + json.dumps({"DnaMeasurement": record})
        + "\n"
        + json.dumps({"DnaMeasurement": record | {"Ignore": False}})
        + "\n"
    )
    (table,) = dynadjust.read([stations, measurements]).tables()
    assert table.columns["use"].tolist() == [Use.OFF, Use.ACTIVE]
