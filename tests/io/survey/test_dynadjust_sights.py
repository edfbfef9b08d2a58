"""Terrestrial measurements in DynaML and DNA files: simulated from places, read back, adjusted."""

from pathlib import Path

import numpy as np
import pyproj
import pytest

from tests.io.survey.dynadjust_files import (
    Directions,
    Line,
    Network,
    Station,
    write_dna,
    write_jsonl,
    write_xml,
)
from tests.io.survey.test_dynadjust import ENU, A
from tests.network.test_deflections import zenith_frame
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite, curvature_radii, ecef_from_geodetic
from tribrach.io.survey.dynadjust import reader as dynadjust
from tribrach.io.survey.formats import read as read_survey
from tribrach.network.adjustment import adjust
from tribrach.observations.base import Use

PLACES = {
    "A": (0, 0, 0),
    "B": (300.0, 400.0, 20.0),
    "C": (-350.0, 150.0, 35.0),
    "D": (80, -420, -15),
}
ANYWHERE = EllipsoidSite(0.0, 0.0, 0.0)
TRUE = {name: np.round(A + np.array(v) @ ENU, 4) for name, v in PLACES.items()}
ARCSEC = np.pi / 180 / 3600


def local(first: str, second: str, hi: float = 0.0, ht: float = 0.0) -> np.ndarray:
    """East, north, up from instrument to target in the verticals of the ellipsoid."""
    x = ANYWHERE.from_ecef(np.stack([TRUE[first], TRUE[second]]))
    axes = ANYWHERE.axes(x)
    return axes[0] @ (x[1] + ht * axes[1, 2] - x[0] - hi * axes[0, 2])


def azimuth(first: str, second: str) -> float:
    """Clockwise from north [rad]."""
    east, north, _ = local(first, second)
    return float(np.arctan2(east, north))


def dms(angle: float) -> tuple[int, int, float]:
    """Degrees, minutes, seconds of a positive angle."""
    tenths = round(np.degrees(angle % (2 * np.pi)) * 3600e4)
    seconds, fraction = divmod(tenths, 10000)
    return seconds // 3600, seconds // 60 % 60, seconds % 60 + fraction / 1e4


def height(name: str) -> float:
    """Ellipsoidal height."""
    return float(ANYWHERE.height(ANYWHERE.from_ecef(TRUE[name][None]))[0])


def network() -> Network:
    """A is held; everything else follows from one measurement or another."""
    out = Network([Station(n, [f"{v:.4f}" for v in x], "CCC" if n == "A" else "FFF")
                   for n, x in TRUE.items()])  # fmt: skip
    m = out.measurements
    m.append(Line("B", ["A", "B"], dms(azimuth("A", "B")), 1.0))
    m.append(
        Line("S", ["A", "B"], float(np.linalg.norm(local("A", "B", 1.6, 1.4))), 0.002, (1.6, 1.4))
    )
    for target in "BCD":
        u = local("A", target, 1.55, 1.7)
        zenith = np.arctan2(np.hypot(u[0], u[1]), u[2])
        m.append(Line("V", ["A", target], dms(zenith), 2.0, (1.55, 1.7)))
    u = local("B", "C", 1.5, 1.3)
    elevation = np.arctan2(u[2], np.hypot(u[0], u[1]))
    m.append(Line("Z", ["B", "C"], dms(elevation), 2.0, (1.5, 1.3)))
    m.append(Line("A", ["A", "B", "C"], dms(azimuth("A", "C") - azimuth("A", "B")), 1.5))
    m.append(Line("S", ["A", "C"], float(np.linalg.norm(local("A", "C"))), 0.002))
    m.append(Line("S", ["A", "D"], float(np.linalg.norm(local("A", "D"))), 0.002))
    m.append(Line("L", ["C", "D"], height("D") - height("C"), 0.001))
    m.append(Line("R", ["D"], height("D"), 0.002))
    m.append(Line("H", ["C"], height("C"), 0.002))
    turn = 1.234
    rays = [(t, dms(azimuth("B", t) - turn)) for t in "ACD"]
    m.append(Directions("B", rays, 1.0))
    return out


@pytest.fixture(params=["dna", "xml", "jsonl"])
def read(request, tmp_path):
    """Write a network in one of the formats and read it."""
    write = {"dna": write_dna, "xml": write_xml, "jsonl": write_jsonl}[request.param]
    return lambda net: dynadjust.read(write(net, tmp_path))


def test_values_and_sigmas(read):
    tables = {o.kind: o for o in read(network()).network().observations}
    kinds = "angle azimuth direction height height_difference slope_distance zenith"
    assert set(tables) == set(kinds.split())
    np.testing.assert_allclose(tables["azimuth"].values[0, 0], azimuth("A", "B"), atol=1e-9)
    np.testing.assert_allclose(tables["azimuth"].sigma[0, 0], ARCSEC)
    np.testing.assert_allclose(tables["slope_distance"].sigma[:, 0], 0.002)
    np.testing.assert_allclose(tables["zenith"].height_target, [1.7, 1.7, 1.7, 1.3])
    assert len(tables["direction"]) == 3


def test_adjusts_to_the_truth(read):
    survey = read(network())
    assert any("orthometric" in warning for warning in survey.warnings)
    adjustment = adjust(survey.network())
    assert adjustment.dof == 15 - 10
    # values are rounded to 0.1 mm and 0.0001 arc seconds
    assert adjustment.vtpv < 0.02
    for name, x in TRUE.items():
        got = survey.site.to_ecef(adjustment.state.points[[adjustment.layout.index("point", name)]])
        np.testing.assert_allclose(got[0], x, atol=2e-4)


def test_ignored(read):
    net = network()
    net.measurements.append(Line("S", ["A", "B"], 1.0, 0.002, ignored=True))
    table = next(o for o in read(net).network().observations if o.kind == "slope_distance")
    assert list(table.use) == [Use.ACTIVE] * 3 + [Use.OFF]


def packed(angle: float) -> str:
    """Degrees.minutesseconds with nine decimals, 0.3 mm on the ground."""
    hundred_thousandths = round(np.degrees(abs(angle)) * 3600e5)
    seconds, fraction = divmod(hundred_thousandths, 100000)
    sign = "-" if angle < 0 else ""
    return f"{sign}{seconds // 3600}.{seconds // 60 % 60:02d}{seconds % 60:02d}{fraction:05d}"


def on_ellipsoid(name: str) -> tuple[float, float]:
    """Longitude and latitude [rad]."""
    latitude, longitude, _ = ANYWHERE.geodetic(ANYWHERE.from_ecef(TRUE[name][None]))[0]
    return float(longitude), float(latitude)


def chord(first: str, second: str) -> float:
    """Between the feet of two stations on the ellipsoid."""
    feet = [ecef_from_geodetic(np.float64(b), np.float64(a), np.float64(0.0))
            for a, b in map(on_ellipsoid, (first, second))]  # fmt: skip
    return float(np.linalg.norm(feet[1] - feet[0]))


def arc(first: str, second: str) -> float:
    """Geodesic on the ellipsoid."""
    ends = *on_ellipsoid(first), *on_ellipsoid(second)
    return float(pyproj.Geod(ellps="GRS80").inv(*ends, radians=True)[2])


def older() -> Network:
    """Latitudes, longitudes, distances on the ellipsoid and astronomic azimuths, with heights."""
    out = Network([Station(n, [f"{v:.4f}" for v in x]) for n, x in TRUE.items()])
    m = out.measurements
    for name in TRUE:
        m.append(Line("R", [name], height(name), 0.01))
    for letters, name in (("PQ", "A"), ("IJ", "C")):
        longitude, latitude = on_ellipsoid(name)
        m.append(Line(letters[0], [name], packed(latitude), 0.001))
        m.append(Line(letters[1], [name], packed(longitude), 0.001))
    m.append(Line("K", ["A", "B"], dms(azimuth("A", "B")), 0.3))
    m.append(Line("K", ["A", "D"], dms(azimuth("A", "D")), 0.3))
    for kind, first, second in (("C", "A", "B"), ("C", "B", "C"), ("E", "A", "D"), ("M", "D", "C")):
        length = chord(first, second) if kind == "C" else arc(first, second)
        m.append(Line(kind, [first, second], length, 0.005))
    return out


def test_older_types(read):
    """C, E, I, J, K, M, P and Q give the places that they were computed from."""
    survey = read(older())
    for word in ("astronomic latitudes", "distances at sea level"):
        assert any(word in warning for warning in survey.warnings)
    network = survey.network()
    values = {o.kind: o for o in network.observations}
    longitude, latitude = on_ellipsoid("A")
    assert values["latitude"].values[0, 0] == pytest.approx(latitude, abs=1e-10)
    assert values["longitude"].values[0, 0] == pytest.approx(longitude, abs=1e-10)
    assert values["latitude"].sigma[0, 0] == pytest.approx(0.001 * ARCSEC)
    adjustment = adjust(network)
    assert adjustment.defect == 0
    assert adjustment.dof == 14 - 12
    assert adjustment.vtpv < 0.01
    for name, x in TRUE.items():
        got = survey.site.to_ecef(adjustment.state.points[[adjustment.layout.index("point", name)]])
        np.testing.assert_allclose(got[0], x, atol=5e-4)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (Line("S", ["A", "Q"], 1.0, 0.002), "station Q is in no station file"),
        (Line("S", ["A", "B"], 1.0, 0.0), "sigma of slope_distance is 0"),
        (Line("S", ["A", "B"], 1.0, -0.01), "sigma of slope_distance is -0.01"),
        (Line("F", ["A", "B"], (1, 2, 3.0), 1.0), "type F (unknown) is not read"),
        (Line("P", ["A"], "-36.6100", 1.0), "more than 60 minutes"),
        (Line("A", ["A", "B"], (1, 2, 3.0), 1.0), ""),
        (Line("V", ["A", "B"], (90, 61, 3.0), 1.0), "60"),
    ],
)
def test_bad_input_is_named(read, line, sentence):
    net = network()
    net.measurements.append(line)
    with pytest.raises(InputError) as caught:
        read(net)
    assert sentence in str(caught.value)


#: geoid height [m], deflections in the meridian and in the prime vertical [arc seconds]
GEOID = {
    "A": (4.780, -7.168, -4.144),
    "B": (4.796, 21.5, 12.25),
    "C": (4.727, -15.0, 30.5),
    "D": (4.81, 8.0, -11.0),
}


def geoid_file(folder: Path) -> Path:
    """As DynAdjust writes it: the numbers end at columns 50, 69 and 79."""
    lines = [f"{name:<40}{n:>10.3f}{xi:>19.3f}{eta:>10.3f}" for name, (n, xi, eta) in GEOID.items()]
    path = folder / "net.geo"
    path.write_text("\n".join(["# DNA geoid file.", *lines, ""]))
    return path


@pytest.mark.parametrize("write", [write_dna, write_xml, write_jsonl])
def test_a_geoid_file_leans_plumb_lines_and_lowers_heights(tmp_path: Path, write) -> None:
    """Readings along the plumb line of each station, orthometric heights, astronomic values."""
    geodetic = ANYWHERE.geodetic(ANYWHERE.from_ecef(np.stack(list(TRUE.values()))))
    place = dict(zip(TRUE, geodetic, strict=True))
    astronomic, axes = {}, {}
    for name, (_, xi, eta) in GEOID.items():
        latitude, longitude, _ = place[name]
        there = latitude + xi * ARCSEC, longitude + eta * ARCSEC / np.cos(latitude)
        astronomic[name], axes[name] = there, zenith_frame(*there)

    def plumb(first: str, second: str, hi: float = 0.0, ht: float = 0.0) -> np.ndarray:
        start = TRUE[first] + hi * axes[first][2]
        return axes[first] @ (TRUE[second] + ht * axes[second][2] - start)

    def bearing(first: str, second: str) -> float:
        east, north, _ = plumb(first, second)
        return float(np.arctan2(east, north))

    level = {name: place[name][2] - GEOID[name][0] for name in GEOID}
    held = packed(place["A"][0]), packed(place["A"][1]), f"{level['A']:.4f}"
    net = Network([Station("A", held, "CCC", "LLH")])
    net.stations += [Station(n, [f"{v:.4f}" for v in TRUE[n]]) for n in "BCD"]
    m = net.measurements
    m.append(Line("K", ["A", "B"], dms(bearing("A", "B")), 0.1))
    m.append(Line("B", ["A", "C"], dms(azimuth("A", "C")), 0.1))
    for first, second in ("AB", "AC", "AD", "BC", "CD"):
        u = plumb(first, second, 1.5, 1.8)
        zenith = np.arctan2(np.hypot(u[0], u[1]), u[2])
        m.append(Line("V", [first, second], dms(zenith), 0.1, (1.5, 1.8)))
        m.append(Line("S", [first, second], float(np.linalg.norm(u)), 0.001, (1.5, 1.8)))
    for first, second in ("BC", "CD", "AD"):
        m.append(Line("L", [first, second], level[second] - level[first], 0.001))
    m.append(Line("H", ["D"], level["D"], 0.001))
    m.append(Directions("B", [(t, dms(bearing("B", t) - 1.234)) for t in "ACD"], 0.1))
    files = write(net, tmp_path)
    without = adjust(dynadjust.read(files).network())
    assert without.sigma0_posterior > 20
    survey = dynadjust.read([*files, geoid_file(tmp_path)])
    assert not any("orthometric" in warning for warning in survey.warnings)
    adjustment = adjust(survey.network())
    assert adjustment.sigma0_posterior < 1.0
    found = adjustment.network.site.to_ecef(adjustment.state.points)
    names = adjustment.layout.names["point"]
    for name, xyz in zip(names, found, strict=True):
        # the files have four decimals
        assert xyz == pytest.approx(TRUE[name], abs=3e-4), name


def test_distances_at_sea_level_follow_the_geoid(tmp_path: Path) -> None:
    """On a geoid of one height N an arc of radius R is longer by N/R, DynaML like DNA text.

    Its ends at heights N1 and N2 over the ellipsoid are a right-angled triangle apart besides.
    """
    net = Network([Station(n, [f"{v:.4f}" for v in x]) for n, x in TRUE.items()])
    net.measurements.append(Line("M", ["A", "B"], arc("A", "B"), 0.001))
    xml, text = (write(net, tmp_path) for write in (write_xml, write_dna))
    path = tmp_path / "net.geo"
    ellipsoidal = read_survey(text)
    assert any("distances at sea level" in warning for warning in ellipsoidal.warnings)
    (plain,) = ellipsoidal.network().observations
    length = plain.predict(ellipsoidal.network().start)[0, 0]
    latitude = on_ellipsoid("A")[1]
    radii = curvature_radii(np.array([latitude]), ANYWHERE.ellipsoid)
    bearing = azimuth("A", "B")
    radius = 1 / (np.sin(bearing) ** 2 / radii[0][0] + np.cos(bearing) ** 2 / radii[1][0])
    for low, high in ((60.0, 60.0), (60.0, 70.0)):
        heights = {"A": low, "B": high, "C": 0.0, "D": 0.0}
        path.write_text("".join(f"{n:<40}{v:10.3f} 0 0\n" for n, v in heights.items()))
        for files in (text, xml):
            survey = read_survey([*files, path])
            assert not any("sea level" in warning for warning in survey.warnings)
            network = survey.network()
            (table,) = network.observations
            assert (table.geoid_start[0], table.geoid_end[0]) == (low, high)
            found = table.predict(network.start)[0, 0]
            expected = np.hypot(length * (1 + (low + high) / 2 / radius), high - low)
            assert found == pytest.approx(expected, abs=2e-5)


def test_geoid_files_are_looked_at(tmp_path: Path) -> None:
    files = write_dna(network(), tmp_path)
    path = geoid_file(tmp_path)
    path.write_text(path.read_text().replace(f"{'D':<40}", f"{'E':<40}"))
    (warning,) = [w for w in dynadjust.read([*files, path]).warnings if "geoid file" in w]
    assert warning.startswith("the geoid file has nothing for 1 stations: D;")
    for text, words in (
        ("A 4.8 -7 -4\n", "a name and three numbers"),
        (f"{'A':<40} 4.8 -7 x\n", "net.geo:1"),
        (f"{'A':<40} 4.8 -7 -4\n" * 2, "twice"),
        (f"{'A':<40} 4800 -7 -4\n", "give metres and arc seconds"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            dynadjust.read([*files, path])
