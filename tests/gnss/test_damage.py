"""Files with random damage end in one sentence or are read: nothing else ever happens."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.io.survey.gnss_samples import write_gvx, write_sinex
from tests.io.survey.test_gnss_files import KONYA, XYZ, covariance_of, pos, row
from tribrach.errors import InputError
from tribrach.io.gnss.gvx import read_gvx
from tribrach.io.gnss.navigation_file import read_navigation
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.gnss.precise_file import read_sp3
from tribrach.io.gnss.rtklib_pos import read_rtklib
from tribrach.io.gnss.sinex import read_sinex

from .rinex_samples import navigation, rinex_2, rinex_3
from .sp3_samples import sp3
from .test_precise_orbits import SKY, START

PIECES = (b"999", b"1e9", b"nan", b"inf", b"   ", b"-99", b"\x00", b"\xff", b"\n", b"<")


def samples(folder: Path) -> list[tuple[Callable[[Path], Any], bytes]]:
    names = tuple(f"G{k:02d}" for k in range(1, 15))
    epochs = [row(KONYA, 1, "0.004 0.004 0.004 0 0 0", k) for k in range(5)]
    pair = np.array([KONYA, KONYA + 9])
    return [
        (read_observations, rinex_2(4, names).encode()),
        (read_observations, rinex_3(4).encode()),
        (read_navigation, navigation().encode()),
        (lambda path: read_sp3(path, path.read_bytes()), sp3(SKY, START, 11).encode()),
        (read_gvx, write_gvx(folder / "a.gvx").read_bytes()),
        (
            read_sinex,
            write_sinex(folder / "a.snx", ["A", "B"], pair, covariance_of(6)).read_bytes(),
        ),
        (read_rtklib, pos(folder / "a.pos", XYZ, epochs).read_bytes()),
    ]


def damaged(data: bytes, rng: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 5, 20])):
        i = rng.randrange(max(len(out), 1))
        length = rng.randrange(1, 80)
        match rng.randrange(3):
            case 0:
                del out[i : i + length]
            case 1:
                out[i:i] = out[i : i + length]
            case _:
                piece = rng.choice(PIECES)
                out[i : i + len(piece)] = piece
    return bytes(out)


@pytest.mark.parametrize("seed", range(6))
def test_damaged_files(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    path = tmp_path / "x"
    files = samples(tmp_path)
    said = []
    for _ in range(40):
        for read, data in files:
            path.write_bytes(damaged(data, rng))
            try:
                read(path)
            except InputError as error:
                said.append(str(error))
    assert said
    assert not any("\n" in text for text in said)
