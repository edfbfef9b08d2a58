"""Lines that end anywhere: what is left of them is read or counted, nothing else happens."""

import contextlib
from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.io.totalstation import formats

FILES = {
    "Nikon RAW": """CO,Nikon RAW data format V2.00
CO,Dist Units: Metres
CO,Angle Units: Gons
CO,Temp:20C Press:760mmHg Prism:-30 04-Feb-2010 13:47:08
MP,B,,10.000,20.000,30.000,code
ST,S1,,B,,1.280,100.0,50.0
F1,B,1.300,40.000,13.1726,88.5648, 09:00:28
SS,P,1.400,50.000,60.0,88.5654,15:35:55,FENCE
SO,P,7,1.400,50.000,60.0,88.5654,15:35:55,FENCE
CP,Q,8,1.400,50.000,60.0,88.5654,15:35:55,FENCE
SS,R,1.400,50.000,70.0,88.5654,15:35:55,FENCE""",
    "Topcon GTS-7": """TopSURV v6.04(OnBoard)
JOB     Test,
UNITS   M,D
TEMP    20.0,1013.3
STN     1001,1.500,
XYZ     4000.000,2000.000,100.000
BKB     1002,45.00000,10.00000
BS      1002,1.600
HV      10.00000,87.46350
SS      100,1.700,wall
SD      74.39010,87.47000,2.1650
FS      101,1.700,wall
HD      74.39010,3.0000,4.0000""",
    "Topcon GTS-6": "_'110_(ST_)1.390_+111_ ?+00041951m0860312+1035120d+00041852t60+00+00103"
    "_*TREE_,1.500_+112_ ?+00010000m3000000+0500000g+00010000t60+00+00103_*_,1.600"
    "_+113_ <0900000+0100000d+0",
    "Carlson RW5": """JB,NMTEST,DT01-16-1998,TM04:33:09
MO,AD0,UN1,SF1.00000000,EC0,EO0.0,AU0
OC,OP104,N 600.0,E 300.0,EL5.0,--TPT.
LS,HI5.330,HR5.690
BK,OP104,BP103,BS45.3000,BC0.0000
BD,OP104,FP103,AR0.0000,ZE90.5408,SD100.0,--TPT., a, b
FD,OP104,FP105,AR189.1420,ZE89.2229,SD60.0
SS,OP104,FP106,AL90.0000,ZE90.0000,HD50.0
TR,OP104,FP107,AZ10.0000,VA10.0000,SD50.0""",
    "Autodesk field book": """UNIT FOOT DMS
HORIZ ANGLE LEFT
VERT ANGLE NADIR
PRISM CONSTANT 0.03
NEZ 1 5000 5000 100 "a b"
AZ 1 2 10.3000
BRG 1 3 10.3000 2
AP ON 10
STN 1 1.5
BS 2 0.0000
PRISM 1.6
F1 VA 2 0.0000 50.0 90.3000 "IP"
F2 VD 2 180.0000 50.0 1.0
AD VA 45.1000 50.0 89.5000
BD VA 5 45.1000 1 50.0 89.5000
AD 6 45.1000 50.0""",
    "Sokkia SDR": """00NMSDR33V04-01         01-Jan-20 10:00 111111
02TP              S1100.000000      200.000000      10.000000       1.500000
07TP              S1               B30.000000       20.000000
03NM1.600000
09F1              S1               P50.000000       80.000000       20.000000       TREE
08KI               B300.000000      400.000000      20.000000
05NM760.000         20.000""",
    "Leica GSI": """410001+00000001 42....+00000000 43....+00000000
110001+0000ST01 84..10+00100000 85..10+00200000 86..10+00010000 88..10+00001500
110002+0000000A 21.102+12345678 22.102+10000000 31..00+00010000 51..0.+0000+000 87..10+00001400
110003+0000000B 21.102+32345678 22.102+30000000 31..00+00010000 51..0.+0000+000 87..10+00001400""",
    "Trimble M5": "\n".join(
        f"For M5|Adr {k:05d}|{body}|{' ':22}| "
        for k, body in enumerate(
            [
                "TI  KN STAT                    |                      |                      ",
                "PI1           A               7|                      |Hz        10.0000 DMS ",
                "PI1           S               8|Y          1.000 m    |X          2.000 m    ",
                "TI  INPUT                      |th         1.600 m    |ih         1.500 m    ",
                "PI1                           9|SD        10.000 m    |Hz        50.0000 gon ",
            ]
        )
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_every_cut_of_every_line(tmp_path: Path, name: str) -> None:
    """The others stay, so that what was begun goes on with what comes next."""
    lines = FILES[name].split("\n")
    path = tmp_path / "field.book"
    for number, line in enumerate(lines):
        for end in range(len(line)):
            path.write_text("\n".join([*lines[:number], line[:end], *lines[number + 1 :]]))
            with contextlib.suppress(InputError):
                formats.read(path)


@pytest.mark.parametrize("name", FILES)
def test_every_cell_left_out(tmp_path: Path, name: str) -> None:
    """Between commas, bars and blanks."""
    path = tmp_path / "field.book"
    for separator in (",", "|", " ", "_"):
        cells = FILES[name].split(separator)
        for k in range(len(cells)):
            for cell in ((), ("",)):
                path.write_text(separator.join([*cells[:k], *cell, *cells[k + 1 :]]))
                with contextlib.suppress(InputError):
                    formats.read(path)
