"""Grids of geoid heights in the formats of agencies: they have the heights that PROJ reads."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyproj
import pytest

from tribrach.errors import InputError
from tribrach.io.geoid_files import read_geoid

#: a grid of steps that are no whole parts of each other
SOUTH, WEST, DLAT, DLON, ROWS, COLUMNS = 45.5, 7.25, 0.125, 0.25, 9, 13
LATITUDES = SOUTH + DLAT * np.arange(ROWS)
LONGITUDES = WEST + DLON * np.arange(COLUMNS)
HEIGHTS = np.round(
    47 + 3 * np.sin(LATITUDES[:, None]) + 2 * np.cos(1.7 * LONGITUDES) * LATITUDES[:, None] / 45, 3
)
NORTH, EAST = LATITUDES[-1], LONGITUDES[-1]


def gtx(path: Path) -> None:
    head = struct.pack(">4d2i", SOUTH, WEST, DLAT, DLON, ROWS, COLUMNS)
    path.write_bytes(head + HEIGHTS.astype(">f4").tobytes())


def gsb(path: Path, *, major_to: float = 6378137.0, order: str = "<") -> None:
    def number(name: str, value: int) -> bytes:
        return struct.pack(f"{order}8si4x", name.ljust(8).encode(), value)

    def real(name: str, value: float) -> bytes:
        return struct.pack(f"{order}8sd", name.ljust(8).encode(), value)

    def word(name: str, value: str) -> bytes:
        return name.ljust(8).encode() + value.ljust(8).encode()

    head = number("NUM_OREC", 11) + number("NUM_SREC", 11) + number("NUM_FILE", 1)
    head += word("GS_TYPE", "SECONDS") + word("VERSION", "1.0.0.0")
    head += word("SYSTEM_F", "GDA94") + word("SYSTEM_T", "AHD_1971")
    head += real("MAJOR_F", 6378137.0) + real("MINOR_F", 6356752.314)
    head += real("MAJOR_T", major_to) + real("MINOR_T", 6356752.314)
    head += word("SUB_NAME", "GRID") + word("PARENT", "NONE")
    head += word("CREATED", "20200101") + word("UPDATED", "20200101")
    head += real("S_LAT", 3600 * SOUTH) + real("N_LAT", 3600 * NORTH)
    head += real("E_LONG", -3600 * EAST) + real("W_LONG", -3600 * WEST)
    head += real("LAT_INC", 3600 * DLAT) + real("LONG_INC", 3600 * DLON)
    head += number("GS_COUNT", ROWS * COLUMNS)
    four = np.zeros((ROWS, COLUMNS, 4), dtype=f"{order}f4")
    four[:, :, 0], four[:, :, 1:] = HEIGHTS[:, ::-1], 5.0
    path.write_bytes(head + four.tobytes() + word("END", ""))


def byn(path: Path, *, width: int = 4) -> None:
    head = bytearray(80)
    limits = [round(3600 * v) for v in (SOUTH, NORTH, WEST, EAST)]
    head[:24] = struct.pack("<4i4h", *limits, round(3600 * DLAT), round(3600 * DLON), 0, 1)
    factor = 1000.0 if width == 4 else 100.0
    head[24:36] = struct.pack("<d2h", factor, width, 2)
    head[48:52] = struct.pack("<2h", 1, 0)
    values = np.rint(factor * HEIGHTS[::-1]).astype(f"<i{width}")
    path.write_bytes(bytes(head) + values.tobytes())


def ggf(path: Path, *, scaled: bool = False, south_first: bool = True) -> None:
    head = bytearray(146)
    head[:16] = struct.pack("<H", 1) + b"TNL GRID FILE\0"
    head[48:104] = struct.pack("<6d2I", SOUTH, NORTH, WEST, EAST, DLAT, DLON, ROWS, COLUMNS)
    head[120:136] = struct.pack("<2d", -999.0, 1000.0)
    head[138] = 4 | (2 if scaled else 0)
    head[141], head[142], head[143] = (4 if scaled else 8), (1 if south_first else 2), 1
    values = HEIGHTS if south_first else HEIGHTS[::-1]
    kind = np.rint(1000 * values).astype("<i4") if scaled else values.astype("<f4")
    path.write_bytes(bytes(head) + kind.tobytes() + bytes(16))


def isg(path: Path, *, cells: bool = False, mark: str = "=") -> None:
    half = (DLAT / 2, DLON / 2) if cells else (0.0, 0.0)
    said = {
        "model name": "TEST", "data units": "meters", "data ordering": "N-to-S, W-to-E",
        "lat min": SOUTH - half[0], "lat max": NORTH + half[0],
        "lon min": WEST - half[1], "lon max": EAST + half[1],
        "delta lat": DLAT, "delta lon": DLON, "nrows": ROWS, "ncols": COLUMNS,
        "nodata": -9999.0, "ISG format": 2.0,
    }  # fmt: skip
    lines = ["begin_of_head ====", *(f"{k:<15}{mark} {v}" for k, v in said.items())]
    lines += ["end_of_head ====", *(" ".join(map(repr, row)) for row in HEIGHTS[::-1].tolist())]
    path.write_text("\n".join(lines) + "\n")


WRITERS: dict[str, Callable[[Path], None]] = {
    "gtx": gtx,
    "gsb": gsb,
    "gsb of big ends": lambda p: gsb(p, order=">"),
    "byn": byn,
    "ggf": ggf,
    "ggf of integers from the north": lambda p: ggf(p, scaled=True, south_first=False),
    "isg": isg,
    "isg of cells": lambda p: isg(p, cells=True, mark=":"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_has_the_heights_of_proj(name: str, tmp_path: Path) -> None:
    gtx(tmp_path / "proj.gtx")
    proj = pyproj.Transformer.from_pipeline(
        f'+proj=vgridshift +grids="{tmp_path / "proj.gtx"}" +multiplier=1'
    )
    rng = np.random.default_rng(3)
    lat = np.radians([*rng.uniform(SOUTH, NORTH, 200), SOUTH, NORTH - 1e-9])
    lon = np.radians([*rng.uniform(WEST, EAST, 200), WEST, EAST - 1e-9])
    expected = np.asarray(proj.transform(lon, lat, 0 * lat, radians=True)[2])
    # a name tells nothing
    WRITERS[name](tmp_path / "grid.bin")
    grid = read_geoid(tmp_path / "grid.bin")
    np.testing.assert_allclose(grid.undulation(lat, lon), expected, atol=1e-5)
    # a circle away it is the same place
    np.testing.assert_allclose(grid.undulation(lat, lon - 2 * np.pi), expected, atol=1e-5)
    with pytest.raises(InputError, match="does not reach"):
        grid.undulation(np.radians([SOUTH - 0.01]), np.radians([WEST + 1]))


def test_the_grid_of_geographiclib_goes_around_the_earth(tmp_path: Path) -> None:
    rows, columns = 19, 36
    pixels = (10 * np.arange(rows * columns)).reshape(rows, columns).astype(">u2")
    head = (
        b"P5\n# Geoid file in PGM format\n# Offset -108\n# Scale 0.003\n# Origin 90N 0E\n"
        b"36    19\n65535\n"
    )
    (tmp_path / "g.pgm").write_bytes(head + pixels.tobytes())
    grid = read_geoid(tmp_path / "g.pgm")
    nodes = -108 + 0.003 * pixels.astype(float)
    assert grid.undulation(np.radians([90.0, 40.0]), np.radians([0.0, 20.0])) == pytest.approx(
        [nodes[0, 0], nodes[5, 2]]
    )
    between = grid.undulation(np.radians([40.0, 40.0]), np.radians([355.0, -5.0]))
    assert between == pytest.approx([(nodes[5, 35] + nodes[5, 0]) / 2] * 2)


@pytest.mark.data
def test_a_real_grid_is_read_as_proj_does(shared_data: Path) -> None:
    path = shared_data / "geoid" / "egm96_15.gtx"
    proj = pyproj.Transformer.from_pipeline(f'+proj=vgridshift +grids="{path}" +multiplier=1')
    rng = np.random.default_rng(1)
    lat, lon = rng.uniform(-1.5, 1.5, 500), rng.uniform(-3.1, 3.1, 500)
    expected = np.asarray(proj.transform(lon, lat, 0 * lat, radians=True)[2])
    np.testing.assert_allclose(read_geoid(path).undulation(lat, lon), expected, atol=1e-6)


def test_nodes_without_value_are_outside(tmp_path: Path) -> None:
    gtx(tmp_path / "g.gtx")
    data = bytearray((tmp_path / "g.gtx").read_bytes())
    data[40:44] = struct.pack(">f", -88.8888)
    (tmp_path / "g.gtx").write_bytes(data)
    grid = read_geoid(tmp_path / "g.gtx")
    with pytest.raises(InputError, match="does not reach"):
        grid.undulation(np.radians([SOUTH + DLAT / 2]), np.radians([WEST + DLON / 2]))
    edge = grid.undulation(np.radians([SOUTH + DLAT]), np.radians([WEST + DLON]))
    assert edge == pytest.approx([HEIGHTS[1, 1]], abs=1e-5)


def cut(write: Callable[[Path], None], size: int) -> Callable[[Path], None]:
    def made(path: Path) -> None:
        write(path)
        path.write_bytes(path.read_bytes()[:size])

    return made


@pytest.mark.parametrize(
    ("write", "what"),
    [
        (lambda p: p.write_bytes(b""), "no grid of geoid heights"),
        (lambda p: p.write_text("latitude,longitude,height\n"), "no grid of geoid heights"),
        (lambda p: gsb(p, major_to=6377397.155), "shifts between two ellipsoids"),
        (cut(gsb, 800), "ends before"),
        (cut(ggf, 300), "ends before"),
        (cut(isg, 500), "cannot be read"),
        (cut(gtx, 300), "no grid of geoid heights"),
        (cut(byn, 300), "no grid of geoid heights"),
    ],
)  # fmt: skip
def test_what_is_no_grid_is_refused(
    write: Callable[[Path], object], what: str, tmp_path: Path
) -> None:
    write(tmp_path / "g")
    with pytest.raises(InputError, match=what):
        read_geoid(tmp_path / "g")
