"""Autodesk field books: the same set-up in every unit and sense, and every command."""

import math

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.survey.formats import format_of, read_files
from tribrach.io.totalstation import fbk
from tribrach.network.adjustment import adjust
from tribrach.units import UNITS

#: E, N, U [m]
PLACES = {
    "A": (1000.0, 2000.0, 50.0),
    "B": (1080.0, 2030.0, 52.0),
    "P": (1050.0, 2090.0, 61.0),
    "Q": (960.0, 2070.0, 45.0),
}
HI, HT = 1.5, 1.6


def polar(start: str, end: str) -> tuple[float, float, float]:
    """Azimuth, zenith angle [rad] and slope distance [m] from instrument to prism."""
    d = np.subtract(PLACES[end], PLACES[start]) + np.array([0, 0, HT - HI])
    flat = math.hypot(d[0], d[1])
    return math.atan2(d[0], d[1]) % (2 * math.pi), math.atan2(flat, d[2]), math.hypot(flat, d[2])


def packed(angle: float) -> str:
    """DDD.MMSSsss of an angle [rad]."""
    seconds = round(math.degrees(angle) * 3600, 4)
    degrees, rest = divmod(seconds, 3600)
    minutes, seconds = divmod(rest, 60)
    return f"{degrees:.0f}.{minutes:02.0f}{seconds * 1e4:06.0f}"


def book(
    length: str = "METER",
    angle: str = "DMS",
    sense: str = "RIGHT",
    vertical: str = "ZENITH",
    how: str = "VA",
) -> str:
    """Both faces from A and single readings from B, in the units and senses that are asked for."""
    metre = 1 / UNITS["ft"] if length == "FOOT" else 1.0
    per_radian = {"DMS": 0.0, "DECDEG": 180 / math.pi, "GRAD": 200 / math.pi}[angle]

    def shown(value: float) -> str:
        return packed(value) if angle == "DMS" else f"{value * per_radian:.9f}"

    def upright(zenith: float) -> float:
        if vertical == "ZENITH":
            return zenith
        return (math.pi - zenith if vertical == "NADIR" else math.pi / 2 - zenith) % (2 * math.pi)

    def sight(command: str, start: str, end: str, back: str) -> str:
        azimuth, zenith, distance = polar(start, end)
        turned = (azimuth - polar(start, back)[0]) % (2 * math.pi)
        circle = turned if sense == "RIGHT" else (-turned) % (2 * math.pi)
        if command == "F2":
            circle, zenith = (circle + math.pi) % (2 * math.pi), 2 * math.pi - zenith
        values = [distance * metre, upright(zenith)]
        if how == "VD":
            flat = abs(math.sin(zenith)) * distance * metre
            up = math.cos(zenith) * distance * metre
            return f'{command} VD {end} {shown(circle)} {flat:.6f} {up:.6f} "a b"'
        return f'{command} VA {end} {shown(circle)} {values[0]:.6f} {shown(values[1])} "a b"'

    lines = [
        f"UNIT {length} {angle}",
        "! a comment",
        f"HORIZ ANGLE {sense}",
        f"VERT ANGLE {vertical}",
        "PRISM CONSTANT 0",
        "CR OFF",
        "SCALE FACTOR 1.0000",
        'JOB "TEST"',
    ]
    lines += [
        f'NEZ {name} {n * metre:.6f} {e * metre:.6f} {u * metre:.6f} "mark {name}"'
        for name, (e, n, u) in PLACES.items()
        if name in "AB"
    ]
    lines += [f"STN A {HI * metre:.6f}", "BS B 0", f"PRISM {HT * metre:.6f}"]
    faces = ("F1", "F2") if how == "VA" and vertical == "ZENITH" else ("F1",)
    lines += [sight(face, "A", end, "B") for face in faces for end in "BPQ"]
    lines += [f"STN B {HI * metre:.6f}", "BS A", *(sight("AD", "B", end, "A") for end in "APQ")]
    return "\n".join(lines) + "\n"


CASES = [
    {},
    {"length": "FOOT"},
    {"angle": "GRAD"},
    {"angle": "DECDEG", "sense": "LEFT"},
    {"vertical": "NADIR"},
    {"vertical": "HORIZ", "length": "FOOT", "angle": "GRAD"},
    {"how": "VD"},
]


@pytest.mark.parametrize("case", CASES, ids=lambda c: " ".join(c.values()) or "plain")
def test_units_and_senses(tmp_path, case) -> None:
    """New points come back to 0.1 mm, as far as the rounding of the file lets them."""
    path = tmp_path / "job.fbk"
    path.write_text(book(**case))
    assert format_of(path) == "totalstation"
    raw = fbk.read(path)
    assert raw.unknown == {}
    assert raw.problems == ()
    assert raw.setups.station.tolist() == ["A", "B"]
    assert set(raw.shots.code.tolist()) == {"a b"}
    adjustment = adjust(read_files([path]).network())
    points = dict(zip(adjustment.layout.names["point"], adjustment.state.points, strict=True))
    for name, place in PLACES.items():
        np.testing.assert_allclose(points[name], place, atol=1e-4)


def raw_of(tmp_path, *lines: str):
    path = tmp_path / "x.fbk"
    path.write_text("\n".join(["UNIT METER DMS", "VERT ANGLE ZENITH", *lines]) + "\n")
    return fbk.read(path)


def test_every_command(tmp_path) -> None:
    raw = raw_of(
        tmp_path,
        "NE 1 200 100",
        "NEZ 2 300 100 5",
        "AZ 1 2 45.0000",
        "STN 1 1.5 OCCUPIED",
        "BS 2 10.0000",
        "PRISM 1.6",
        "AD VA 20 30.0000 50 90.0000 IP",
        "DD VA 21 30.0000 50 90.0000",
        "ZD VA 22 30.0000 50 90.0000",
        "BD VA 23 30.0000 3 50 90.0000",
        "AP ON 30",
        "AD VA 40.0000 50 90.0000",
        "AD VA 50.0000 50 90.0000 FENCE",
        "AP OFF",
        "AD 24 60.0000 50",
        "F1 25 70.0000 0",
        "BEG EDGE",
        "END",
        "WIGGLE 3",
    )
    shots = raw.shots
    names = shots.target.tolist()
    direction = dict(zip(names, np.degrees(shots.direction), strict=True))
    assert names[:3] == ["2", "20", "21"]  # the circle was set on the backsight
    assert {"30", "31", "24", "25"} <= set(names)
    assert direction["20"] == pytest.approx(30)
    assert direction["21"] == pytest.approx(10 + 180 + 30)
    assert (direction["22"], direction["23"]) == pytest.approx((30, 210))
    assert (direction["30"], direction["31"]) == pytest.approx((40, 50))
    by_name = dict(zip(names, shots.setup.tolist(), strict=True))
    # azimuths are no readings of the circle that was set on the backsight
    assert by_name["22"] == by_name["23"] != by_name["20"] == by_name["21"]
    azimuth = np.degrees(raw.setups.azimuth[by_name["20"]])
    assert azimuth == pytest.approx(45)
    assert raw.unknown == {"command WIGGLE": 1}
    assert len(raw.notes) == 1
    assert raw.notes[0].startswith("1 sights have a horizontal distance")
    np.testing.assert_allclose(raw.points.xyz, [[100, 200, np.nan], [100, 300, 5]])


def test_corrections_are_said_and_not_applied(tmp_path) -> None:
    raw = raw_of(
        tmp_path,
        "PRISM CONSTANT 0.03",
        "SCALE FACTOR 0.9996",
        "ATMOSPHERE ON",
        "STN 1 1.5",
        "F1 VA 2 0.0000 50 90.0000",
    )
    assert [note.split(" is not applied")[0] for note in raw.notes] == [
        "PRISM CONSTANT 0.03",
        "SCALE FACTOR 0.9996",
        "ATMOSPHERE ON",
    ]
    assert raw.shots.distance.tolist() == [50.0]


@pytest.mark.parametrize(
    ("record", "what"),
    [
        ("F1 VA 2 0.6100 50 90.0000", "more than 60 minutes"),
        ("F1 VA 2 0.0000 -50 90.0000", "the distance is -50 m"),
        ("F1 VA 2 0.0000", "a point and 3 numbers are needed"),
        ("F1 VA 0.0000 50 90.0000", "a point and 3 numbers are needed"),
        ("VERT ANGLE SIDEWAYS", "'SIDEWAYS' is none of"),
        ("HORIZ ANGLE UP", "'UP' is none of"),
        ("UNIT CUBIT DMS", "the unit 'CUBIT' is unknown"),
        ("PRISM", "PRISM has too few values"),
        ("BD VA 3 20.0000 5 50 90.0000", "'5' is none of"),
        ("STN", "STN has too few values"),
        ("NE 1 north 5", "a point and 2 numbers are needed"),
    ],
)
def test_records_that_cannot_be_right(tmp_path, record: str, what: str) -> None:
    raw = raw_of(tmp_path, "STN 1 1.5", "F1 VA 9 0.0000 50 90.0000", record)
    assert [problem.line for problem in raw.problems] == [5]
    assert what in raw.problems[0].what


def test_a_sight_before_a_station_and_an_empty_book(tmp_path) -> None:
    with pytest.raises(InputError, match="a sight stands before the first STN"):
        raw_of(tmp_path, "F1 VA 9 0.0000 50 90.0000")
    with pytest.raises(InputError, match="no sight and no coordinates"):
        raw_of(tmp_path, "STN 1 1.5")
