"""Sokkia SDR, Nikon RAW, Topcon GTS, Carlson RW5 and Trimble M5: units and records."""

import math

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.totalstation import gts6, gts7, m5, nikon, rw5, sdr
from tribrach.io.totalstation.text import angle, number, packed_dms, read_lines
from tribrach.units import GON, UNITS


def write(tmp_path, *lines, name="job.raw"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", newline="")
    return path


def sdr_line(kind, names, numbers, width=16, digits=16, code=""):
    cells = [name.rjust(width) for name in names] + [f"{x:<{digits}.6f}" for x in numbers]
    return kind + "".join(cells) + code


def dms(degrees, minutes, seconds):
    return math.radians(degrees + minutes / 60 + seconds / 3600)


def test_packed_angles():
    assert packed_dms("87.46350") == pytest.approx(dms(87, 46, 35))
    assert packed_dms("326.1") == pytest.approx(dms(326, 10, 0))
    assert packed_dms("55.05521") == pytest.approx(dms(55, 5, 52.1))
    assert packed_dms("-0.3000") == pytest.approx(-dms(0, 30, 0))
    assert math.isnan(packed_dms("  "))
    for wrong in ("12.6100", "12.0061", "x", "1e2"):
        with pytest.raises(ValueError, match=r"is not a number|more than 60"):
            packed_dms(wrong)
    assert angle("1600", "mil") == pytest.approx(math.pi / 2)
    assert angle("100", "gon") == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("wrong", ["nan", "inf", "1_0", "1e5", "0x1", "--1", "1,5"])
def test_numbers_are_plain(wrong):
    with pytest.raises(ValueError, match="is not a number"):
        number(wrong)


def test_line_ends_of_all_kinds(tmp_path):
    path = tmp_path / "x"
    path.write_bytes(b"a\r\nb\rc\nd\r\r\r\ne")
    assert read_lines(path) == ["a", "b", "c", "d", "e"]


@pytest.mark.parametrize(
    ("units", "to_radians", "metre", "first_is_east"),
    [
        ("111111", math.radians(1), 1.0, False),
        ("211121", GON, 1.0, True),
        ("421121", math.pi / 3200, UNITS["ft"], True),
    ],
)
@pytest.mark.parametrize(
    ("version", "width", "digits"), [("SDR33V04-01", 16, 16), ("SDR20V03-05", 4, 10)]
)
def test_sdr(tmp_path, units, to_radians, metre, first_is_east, version, width, digits):
    def line(kind, names, numbers, code=""):
        return sdr_line(kind, names, numbers, width, digits, code)

    path = write(
        tmp_path,
        f"00NM{version:<16}    {'01-Jan-20 10:00':<16}{units}",
        line("02TP", ["S1"], [100.0, 200.0, 10.0, 1.5]),
        line("07TP", ["S1", "B"], [30.0, 20.0]),
        "03NM1.600000",
        line("09F1", ["S1", "P"], [50.0, 80.0, 20.0], "TREE"),
        line("09F2", ["S1", "P"], [50.0, 280.0, 200.0]),
        line("09MC", ["S1", "P"], [50.0, 80.0, 20.0]),
        line("08KI", ["B"], [300.0, 400.0, 20.0]),
        "05NM" + f"{760.0:<{digits}.3f}{20.0:<{digits}.3f}",
        "99XXwhatever",
    )  # fmt: skip
    raw = sdr.read(path)
    assert raw.setups.station.tolist() == ["S1"]
    np.testing.assert_allclose(raw.setups.height, [1.5 * metre])
    assert raw.setups.backsight.tolist() == ["B"]
    np.testing.assert_allclose(raw.setups.azimuth, [30 * to_radians])
    shots = raw.shots
    # the circle was set on the backsight, which no other record shows
    assert shots.target.tolist() == ["B", "P", "P", "P"]
    np.testing.assert_allclose(shots.direction / to_radians, [20, 20, 200, 20])
    np.testing.assert_allclose(shots.zenith[1:] / to_radians, [80, 280, 80])
    np.testing.assert_allclose(shots.distance[1:], [50 * metre] * 3)
    np.testing.assert_allclose(shots.height[1:], [1.6 * metre] * 3)
    assert shots.face[:3].tolist() == [1, 1, 2]
    assert shots.off.tolist() == ["", "", "", "the instrument made this mean"]
    assert shots.code[1] == "TREE"
    e, n = (100.0, 200.0) if first_is_east else (200.0, 100.0)
    np.testing.assert_allclose(raw.points.xyz[0], np.array([e, n, 10.0]) * metre)
    assert raw.points.given.all()
    assert raw.unknown == {"record 99XX": 1}


def test_sdr_with_bad_units(tmp_path):
    path = write(tmp_path, f"00NM{'SDR33V04-01':<16}    {'01-Jan-20 10:00':<16}911111")
    with pytest.raises(InputError, match="units '911111'"):
        sdr.read(path)
    with pytest.raises(InputError, match="no header record"):
        sdr.read(write(tmp_path, "02TP   S1"))


NIKON = ["CO,Nikon RAW data format V2.00", "CO,Dist Units: Metres", "CO,Zero VA: Zenith"]


@pytest.mark.parametrize(
    ("word", "text", "expected"),
    [("DDDMMSS", "120.4708", dms(120, 47, 8)), ("Gons", "120.4708", 120.4708 * GON)],
)
@pytest.mark.parametrize("order", ["NEZ", "ENZ"])
def test_nikon(tmp_path, word, text, expected, order):
    path = write(
        tmp_path,
        *NIKON,
        f"CO,Angle Units: {word}",
        f"CO,Coord Order: {order}",
        "CO,Temp:20C Press:760mmHg Prism:-30 04-Feb-2010 13:47:08",
        "MP,B,,10.000,20.000,30.000,code",
        f"ST,S1,,B,,1.280,{text},{text}",
        "F1,B,1.300,40.000,13.1726,88.5648, 09:00:28",
        f"SS,P,1.400,50.000,{text},88.5654,15:35:55,FENCE",
        f"*SS,Q,1.400,50.000,{text},88.5654,15:35:55,",
        "CC,Z,,1.0,2.0,3.0,",
        "ZZ,what",
    )
    raw = nikon.read(path)
    assert raw.setups.backsight.tolist() == ["B"]
    assert raw.setups.height.tolist() == [1.28]
    shots = raw.shots
    assert shots.target.tolist() == ["B", "P", "Q"]
    # the first reading at the backsight was taken before the circle was set
    np.testing.assert_allclose(shots.direction, expected)
    assert shots.distance.tolist() == [40.0, 50.0, 50.0]
    assert shots.height.tolist() == [1.3, 1.4, 1.4]
    assert shots.prism.tolist() == [-0.03] * 3
    np.testing.assert_allclose(shots.pressure_hpa, 1013.25)
    assert shots.code.tolist() == ["", "FENCE", ""]
    assert shots.off.tolist() == ["", "", "deleted in the field"]
    e, n = (20.0, 10.0) if order == "NEZ" else (10.0, 20.0)
    np.testing.assert_allclose(raw.points.xyz[0], [e, n, 30.0])
    assert raw.points.given.tolist() == [True, False]
    assert raw.unknown == {"record ZZ": 1}


def test_nikon_without_a_sight_of_the_backsight(tmp_path):
    """The circle was set on it: that pointing is a direction."""
    path = write(
        tmp_path, *NIKON, "CO,Angle Units: Gons", "ST,S1,,B,,1.280,100.0,50.0",
        "SS,P,1.400,50.000,60.0,100.0,15:35:55,",
    )  # fmt: skip
    shots = nikon.read(path).shots
    assert shots.target.tolist() == ["B", "P"]
    np.testing.assert_allclose(shots.direction / GON, [50.0, 60.0])
    assert np.isnan(shots.zenith[0])


def test_nikon_with_bad_minutes(tmp_path):
    path = write(
        tmp_path, *NIKON, "CO,Angle Units: DDDMMSS", "ST,S1,,,,1.280,0.0,0.0",
        "SS,P,1.4,50.0,326.0270,90.0,15:35:55,", "SS,Q,1.4,50.0,326.0250,90.0,15:35:55,",
    )  # fmt: skip
    raw = nikon.read(path)
    assert raw.shots.target.tolist() == ["Q"]
    assert [p.line for p in raw.problems] == [6]


@pytest.mark.parametrize(
    ("units", "metre", "turn"),
    [("M,D", 1.0, lambda t: packed_dms(t)), ("F,G", UNITS["ft"], lambda t: float(t) * GON)],
)
def test_gts7(tmp_path, units, metre, turn):
    path = write(
        tmp_path,
        "TopSURV v6.04(OnBoard)", "JOB     Test,", f"UNITS   {units}", "TEMP    20.0,1013.3",
        "STN     1001,1.500,", "XYZ     4000.000,2000.000,100.000",
        "BKB     1002,45.00000,10.00000",
        "XYZ     4500.000,2600.000,100.000", "BS      1002,1.600", "HV      10.00000,87.46350",
        "SS      100,1.700,wall", "SD      74.39010,87.47000,2.1650",
        "FS      101,1.700,wall", "HD      74.39010,3.0000,4.0000", "WHAT    1,2",
    )  # fmt: skip
    raw = gts7.read(path)
    assert raw.setups.station.tolist() == ["1001"]
    assert raw.setups.backsight.tolist() == ["1002"]
    shots = raw.shots
    assert shots.target.tolist() == ["1002", "100", "101"]
    np.testing.assert_allclose(
        shots.direction, [turn("10.00000"), turn("74.39010"), turn("74.39010")]
    )
    np.testing.assert_allclose(shots.zenith[:2], [turn("87.46350"), turn("87.47000")])
    assert shots.zenith[2] == pytest.approx(math.atan2(3, 4))
    np.testing.assert_allclose(shots.distance, [np.nan, 2.165 * metre, 5 * metre])
    np.testing.assert_allclose(shots.height, np.array([1.6, 1.7, 1.7]) * metre)
    assert shots.code.tolist() == ["", "wall", "wall"]
    np.testing.assert_allclose(raw.points.xyz[1], np.array([4500, 2600, 100]) * metre)
    assert raw.unknown == {"word WHAT": 1}


STREAM = (
    "_'110_(ST_)1.390_+111_ ?+00041951m0860312+1035120d+00041852t60+00+00103_*TREE_,1.500"
    "_+112_ ?+00010000m3000000+0500000g+00010000t60+00+00103_*_,1.600_+113_ <0900000+0100000d+0"
)


def test_gts6(tmp_path):
    raw = gts6.read(write(tmp_path, STREAM))
    assert raw.setups.station.tolist() == ["110"]
    assert raw.setups.height.tolist() == [1.39]
    shots = raw.shots
    assert shots.target.tolist() == ["111", "112", "113"]
    np.testing.assert_allclose(shots.distance, [41.951, 10.0, np.nan])
    expected = [dms(86, 3, 12), 300 * GON, dms(90, 0, 0)]
    np.testing.assert_allclose(shots.zenith, expected)
    np.testing.assert_allclose(shots.direction, [dms(103, 51, 20), 50 * GON, dms(10, 0, 0)])
    assert shots.face.tolist() == [1, 2, 1]
    np.testing.assert_allclose(shots.height[:2], [1.5, 1.6])


def test_gts6_in_packets(tmp_path):
    """Packets of 128 characters with a checksum and their frame say the same."""
    packets = [STREAM[k : k + 128].ljust(128) for k in range(0, len(STREAM), 128)]
    framed = [f"\x02{packet}1234\x03" for packet in packets]
    plain, packed = (
        gts6.read(write(tmp_path, *lines, name=name)).shots
        for lines, name in (([STREAM], "a"), (framed, "b"))
    )
    np.testing.assert_array_equal(plain.direction, packed.direction)
    assert packed.line.tolist() == [1, 1, 2]


@pytest.mark.parametrize(("unit", "metre"), [("0", UNITS["ft"]), ("1", 1.0), ("2", UNITS["usft"])])
def test_rw5(tmp_path, unit, metre):
    path = write(
        tmp_path,
        "JB,NMTEST,DT01-16-1998,TM04:33:09", f"MO,AD0,UN{unit},SF1.00000000,EC0,EO0.0,AU0",
        "SP,PN103,N 500.0,E 200.0,EL5.0,--TPT.", "OC,OP104,N 600.0,E 300.0,EL5.0,--TPT.",
        "LS,HI5.330,HR5.690", "BK,OP104,BP103,BS45.3000,BC0.0000",
        "BD,OP104,FP103,AR0.0000,ZE90.5408,SD100.0,--TPT., a, b", "LS,HI5.330,HR5.630",
        "FD,OP104,FP105,AR189.1420,ZE89.2229,SD60.0", "FR,OP104,FP105,AR9.1418,ZE270.3719,SD60.0",
        "BR,OP104,FP103,AR179.5958,ZE269.0541,SD100.0", "SS,OP104,FP106,AL90.0000,ZE90.0000,HD50.0",
        "TR,OP104,FP107,AZ10.0000,VA10.0000,SD50.0", "SS,OP104,FP108,AR1.0,CE3.0,HD50.0",
        "OC,OP104,N 600.0,E 300.0,EL5.0,--TPT.", "BK,OP104,BP103,BS45.3000,BC0.0000",
        "SS,OP104,FP109,AR1.0,ZE90.0,SD50.0", "QQ,OP1",
    )  # fmt: skip
    raw = rw5.read(path)
    # the same occupation written again goes on
    assert raw.setups.station.tolist() == ["104"]
    np.testing.assert_allclose(raw.setups.height, [5.33 * metre])
    shots = raw.shots
    assert shots.target.tolist() == ["103", "105", "105", "103", "106", "107", "109"]
    assert shots.face.tolist() == [1, 1, 2, 2, 1, 1, 1]
    np.testing.assert_allclose(shots.direction[4], math.radians(270))
    np.testing.assert_allclose(shots.zenith[5], math.radians(80))
    np.testing.assert_allclose(shots.distance[:2], np.array([100.0, 60.0]) * metre)
    np.testing.assert_allclose(shots.height[:2], np.array([5.69, 5.63]) * metre)
    assert [p.line for p in raw.problems] == [14]
    assert raw.unknown == {"record QQ": 1}
    assert raw.points.given.tolist() == [True, False, False]
    np.testing.assert_allclose(raw.points.xyz[0], np.array([200, 500, 5]) * metre)


def m5_line(number, kind, block, *values):
    cells = [f"{t:<2} {v:>14} {u:<4}" for t, v, u in values]
    cells += [" " * 22] * (3 - len(cells))
    return f"For M5|Adr {number:05d}|{kind:<3} {block:<27}|" + "|".join(cells) + "| "


def test_m5(tmp_path):
    level = ("V1", "90.0000", "DMS")
    place = [(axis, f"{k}.000", "m") for k, axis in enumerate("YXZ", start=1)]
    path = write(
        tmp_path,
        m5_line(1, "TI", "KN STAT"),
        m5_line(2, "PI1", f"{'A':>11}{'7':>16}", ("", "", ""), ("Hz", "10.0000", "DMS"), level),
        m5_line(3, "PI1", f"{'S':>11}{'8':>16}", *place),
        m5_line(4, "TI", "INPUT", ("th", "1.600", "m"), ("ih", "1.500", "m")),
        m5_line(5, "TI", "INPUT", ("T_", "68", "F"), ("P", "760", "Torr"), ("PC", "-0.018", "m")),
        m5_line(6, "PI1", f"{'9':>27}", ("SD", "10.000", "ft"), ("Hz", "50.0000", "gon"), level),
        m5_line(7, "PI1", f"{'9':>27}", ("SD", "10.000", "m"), ("Hz", "50.0000", "ell"), level),
        "For R4|something",
    )  # fmt: skip
    raw = m5.read(path)
    assert raw.setups.station.tolist() == ["8"]
    assert raw.setups.height.tolist() == [1.5]
    shots = raw.shots
    assert shots.target.tolist() == ["7", "9"]
    np.testing.assert_allclose(shots.direction, [math.radians(10), 50 * GON])
    np.testing.assert_allclose(shots.distance, [np.nan, 10 * UNITS["ft"]])
    np.testing.assert_allclose(shots.prism, [np.nan, -0.018])
    np.testing.assert_allclose(shots.temperature_c[1], 20.0)
    np.testing.assert_allclose(shots.pressure_hpa[1], 1013.25)
    np.testing.assert_allclose(raw.points.xyz, [[1.0, 2.0, 3.0]])
    assert [p.line for p in raw.problems] == [7]
    assert raw.unknown == {"line of another format": 1}
