"""Phases of P(Y) and L2C in one column of RINEX 2: which they are, and moving the latter."""

from pathlib import Path

import pytest

from tribrach.io.gnss.l2_phases import aligned_l2, mixed_l2
from tribrach.io.gnss.observation_file import RinexObservations, read_observations

from .rinex_samples import HEADER_2, rinex_2, rinex_3

#: fourteen satellites, whose names take two lines, and seven types, which take two more
NAMES = tuple(f"G{k:02d}" for k in range(1, 15))
PRECISE = ("G03", "G07", "G13")
TYPES = "     7    C1    L1    P1    S1    S2    L2    P2              # / TYPES OF OBSERV"


def line(satellite: str, flag: str, phase: float) -> str:
    """Two lines of values of which L2 is the first of the second, with an indicator."""
    first = "".join(f"{value:14.3f}  " for value in (2e7, 1e8, 2e7, 45.0)).rstrip()
    return f"{first}\n{phase:14.3f}{flag}7{2e7:14.3f}"


def mixed(precise: tuple[str, ...] = PRECISE, newline: str = "\n") -> bytes:
    header = HEADER_2.replace(
        "     4    L1    C1    L2    P2                              # / TYPES OF OBSERV", TYPES
    )
    assert TYPES in header
    text = header
    for k in range(3):
        names = "".join(NAMES)
        text += f" 05  4  2  0  0{10.0 * k:11.7f}  0 14{names[:36]}\n{' ' * 32}{names[36:]}\n"
        for n, name in enumerate(NAMES):
            text += line(name, "4" if name in precise else " ", -5.1 + 1e6 * n) + "\n"
    return text.replace("\n", newline).encode()


def read(folder: Path, data: bytes) -> RinexObservations:
    path = folder / "a.obs"
    path.write_bytes(data)
    return read_observations(path)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_only_phases_of_l2c_are_moved(tmp_path: Path, newline: str) -> None:
    file = read(tmp_path, mixed(newline=newline))
    found = mixed_l2(file)
    assert found is not None
    assert found.precise == set(PRECISE)
    assert found.civil == set(NAMES) - set(PRECISE)
    moved = aligned_l2(file).text.decode().split("\n")
    changed = 0
    for before, after in zip(file.text.decode().split("\n"), moved, strict=True):
        if before != after:
            changed += 1
            assert float(after[:14]) == pytest.approx(float(before[:14]) - 0.25, abs=1e-9)
            assert (after[14:], before[14]) == (before[14:], " ")
    assert changed == 3 * (14 - 3)
    # what is read back is a whole file
    (tmp_path / "b.obs").write_bytes(aligned_l2(file).text)
    assert read_observations(tmp_path / "b.obs").satellites == set(NAMES)


def test_files_that_do_not_tell_stay_as_they_are(tmp_path: Path) -> None:
    changing = mixed().replace(
        b" 05  4  2  0  0 10.0", f"{'':26}  4  1\n{TYPES}\n 05  4  2  0  0 10.0".encode(), 1
    )
    cases = {
        "all of P(Y)": mixed(NAMES),
        "no indicator": mixed(()),
        "RINEX 3 names its signals": rinex_3().encode(),
        "plain": rinex_2().encode(),
        "types change": changing,
    }
    for case, data in cases.items():
        file = read(tmp_path, data)
        assert mixed_l2(file) is None, case
        assert aligned_l2(file) is file, case


def test_other_systems_are_left_alone(tmp_path: Path) -> None:
    data = mixed().replace(b"G01G02", b"R01R02")
    found = mixed_l2(read(tmp_path, data))
    assert found is not None
    assert not {name for name in found.civil | found.precise if name[0] != "G"}
