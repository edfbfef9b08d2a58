"""Baselines that two frequencies do not fix: real receivers, and phases moved on purpose.

PANA writes L2C for satellites that have it and P(Y) for the others, IGNF writes P(Y) for all
(French permanent network, 2.47 km, two sessions of four hours). What their agreement is held to
comes from the two days and from sessions of ten minutes cut out of them. The receivers of Japan
have phases of one kind; a quarter of a cycle is put into some, and the truth is what was computed
before.
"""

import functools
import gzip
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.gnss.baseline import Baseline, Processing, compute_baseline
from tribrach.gnss.engine import engines
from tribrach.questions.baseline.command import answer_of

from .test_baseline import BASE_3040, ROVER_0759, geonet

pytestmark = [
    pytest.mark.skipif(not engines(), reason="RTKLIB is not installed"),
    pytest.mark.data,
]
RUN = CliRunner()
IGNF = np.array([4201694.1440, 177888.8370, 4779371.7670])
DAYS = {"230910": "253z", "230913": "256z"}
AS_ASKED = Processing(alternatives=False)
#: without pieces, which cost as much again for each attempt
QUICK = Processing(pieces=False)


def rgp(folder: Path, day: str) -> tuple[Path, Path, list[Path]]:
    there = folder / "gnss" / "rgp_pana_ignf" / day
    if not there.is_dir():
        pytest.skip("the sessions of PANA and IGNF are not there")
    base, rover = (there / f"{name}{DAYS[day]}.23o.gz" for name in ("ignf", "pana"))
    return base, rover, [there / f"ignf{DAYS[day]}.23n.gz"]


@functools.cache
def whole(folder: Path, day: str) -> Baseline:
    """The session of a day, computed once for all tests."""
    return compute_baseline(*rgp(folder, day), IGNF)


def epochs_2(text: str) -> tuple[str, list[tuple[float, list[str]]]]:
    """Header of a file of RINEX 2, and its epochs with the second of the day of each."""
    end = text.index("\n", text.index("END OF HEADER")) + 1
    kinds = int(re.search(r"^(.{6}).*# / TYPES OF OBSERV", text, re.M).group(1))  # type: ignore[union-attr]
    lines, epochs = text[end:].splitlines(keepends=True), []
    while lines:
        head = lines[0]
        count, flag = int(head[29:32]), int(head[28])
        size = 1 + (count if flag > 1 else max(-(-count // 12) - 1, 0) + count * -(-kinds // 5))
        if flag < 2:
            second = 3600 * int(head[10:12]) + 60 * int(head[13:15]) + float(head[15:26])
            epochs.append((second, lines[:size]))
        lines = lines[size:]
    return text[:end], epochs


def window(source: Path, target: Path, start: float, minutes: float) -> Path:
    """A session cut out of a file, from so many minutes after its start."""
    data = source.read_bytes()
    head, epochs = epochs_2((gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode())
    first = epochs[0][0] + 60 * start
    kept = [rows for t, rows in epochs if first <= t + 0.05 < first + 60 * minutes]
    target.write_text(head + "".join(line for rows in kept for line in rows))
    return target


def disagreement(one: Baseline, two: Baseline) -> float:
    """Square of the difference in the metric of both covariances."""
    apart = one.vector - two.vector
    return float(apart @ np.linalg.solve(one.covariance + two.covariance, apart))


@pytest.mark.parametrize("day", ["230910", pytest.param("230913", marks=pytest.mark.slow)])
def test_two_frequencies_that_do_not_fix_are_float_and_l1_is_taken(
    shared_data: Path, day: str
) -> None:
    files = rgp(shared_data, day)
    asked = compute_baseline(*files, IGNF, AS_ASKED)
    assert asked.ambiguities == "float"
    assert asked.fixed_share < 0.5
    assert not asked.attempts
    assert any("float solution" in text and "80 % are needed" in text for text in asked.warnings)
    found = whole(shared_data, day)
    assert (found.ambiguities, found.frequencies) == ("fixed", 1)
    assert found.fixed_share > 0.95
    first, moved, alone = found.attempts
    assert [a.taken for a in found.attempts] == [False, False, True]
    assert (first.ambiguities, first.fixed_share) == (asked.ambiguities, asked.fixed_share)
    assert alone.ratio > 10 * first.ratio
    # the cause: with phases of L2C a quarter of a cycle on, the same frequencies are fixed
    assert (moved.ambiguities, moved.frequencies) == ("fixed", 2)
    assert moved.fixed_share > 0.95
    assert "mixed in pana" in found.choice
    # sigma of the float solution says how far it is from the fixed one
    assert disagreement(asked, found) < chi2.ppf(0.99, 3)


def test_two_days_agree(shared_data: Path) -> None:
    one, two = (whole(shared_data, day) for day in DAYS)
    assert disagreement(one, two) < chi2.ppf(0.95, 3)
    assert np.linalg.norm(one.vector - two.vector) < 0.006


def test_ten_minutes_and_the_whole_session_agree(shared_data: Path, tmp_path: Path) -> None:
    """Six sessions of ten minutes against the four hours of their day: sigmas cover the difference.

    The four hours contain the ten minutes, which makes differences smaller than the sum of both
    covariances and not larger.
    """
    total = 0.0
    for day in DAYS:
        base, rover, orbits = rgp(shared_data, day)
        long = whole(shared_data, day)
        for start in (15, 95, 175):
            cut = [window(p, tmp_path / p.stem, start, 10) for p in (base, rover)]
            short = compute_baseline(*cut, orbits, IGNF)
            assert disagreement(short, long) < chi2.ppf(0.999, 3)
            # hours may show errors that minutes do not: only what the engine states must fall
            assert np.trace(short.formal) > np.trace(long.formal)
            total += disagreement(short, long)
    assert total < chi2.ppf(0.99, 18)


@pytest.mark.slow
def test_all_sessions_of_ten_minutes_agree_with_their_day(
    shared_data: Path, tmp_path: Path
) -> None:
    """Twelve of a day and its four hours, all together: their errors and the error of the day.

    The statistic is that of 36 differences with the covariances of the short sessions and, the same
    in all, that of the day. Phase centres are those of IGS: one frequency stands against two.
    """
    antex = tmp_path / "igs14.atx"
    packed = shared_data / "gnss" / "products" / "igs14.atx.gz"
    antex.write_bytes(gzip.decompress(packed.read_bytes()))
    # what stays alike within a day is in both
    settings = Processing(antex=antex, session=(0.0, 0.0))
    total = 0.0
    for day in DAYS:
        base, rover, orbits = rgp(shared_data, day)
        long = compute_baseline(base, rover, orbits, IGNF, settings)
        apart, joint = [], np.kron(np.ones((12, 12)), long.covariance)
        for k, start in enumerate(range(0, 240, 20)):
            cut = [window(p, tmp_path / p.stem, start, 10) for p in (base, rover)]
            short = compute_baseline(*cut, orbits, IGNF, settings)
            assert short.ambiguities == "fixed"
            # one in a thousand: the limit for 24 of them
            assert disagreement(short, long) < chi2.ppf(1 - 0.001 / 24, 3)
            apart.append(short.vector - long.vector)
            joint[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += short.covariance
        e = np.concatenate(apart)
        total += e @ np.linalg.solve(joint, e)
    assert chi2.ppf(0.01, 72) < total < chi2.ppf(0.95, 72)


def test_without_indicators_l1_alone_is_left(shared_data: Path, tmp_path: Path) -> None:
    """The same files, from which nothing tells P(Y) from L2C."""
    base, rover, orbits = rgp(shared_data, "230913")
    head, epochs = epochs_2(gzip.decompress(rover.read_bytes()).decode())
    plain = tmp_path / "pana.23o"
    body = ["".join(rows) for _, rows in epochs]
    plain.write_text(head + re.sub(r"(\.\d{3})4(\d)", r"\1 \2", "".join(body)))
    found = compute_baseline(base, plain, orbits, IGNF, QUICK)
    assert [a.what for a in found.attempts] == ["L1 and L2", "L1 alone"]
    assert (found.ambiguities, found.frequencies) == ("fixed", 1)
    assert "mixed" not in found.choice


def flagged(text: str, satellites: Callable[[str], bool], shift: float) -> str:
    """Phases on L2 (types L1, C1, L2, P2) marked as those of P(Y), others moved [cycles]."""
    head, epochs = epochs_2(text)
    out = [head]
    for _, rows in epochs:
        count = int(rows[0][29:32])
        names = "".join(
            line[32:68].rstrip("\n").ljust(36) for line in rows[: 1 + (count - 1) // 12]
        )
        first = len(rows) - count
        out += rows[:first]
        for k, row in enumerate(rows[first:]):
            line = row.rstrip("\n").ljust(80)
            if line[32:46].strip():
                if satellites(names[3 * k : 3 * k + 3]):
                    line = line[:46] + "4" + line[47:]
                else:
                    line = f"{line[:32]}{float(line[32:46]) + shift:14.3f} {line[47:]}"
            out.append(line.rstrip() + "\n")
    return "".join(out)


def test_a_quarter_of_a_cycle_put_into_good_phases_comes_out_again(
    shared_data: Path, tmp_path: Path
) -> None:
    base, rover, orbits = geonet(shared_data)
    before = compute_baseline(base, rover, orbits, BASE_3040, QUICK)
    assert not before.attempts
    one, two = tmp_path / "3040.05o", tmp_path / "0759.05o"
    one.write_text(flagged(base.read_text(), lambda name: True, 0.0))
    two.write_text(flagged(rover.read_text(), lambda name: int(name[1:]) % 2 == 0, 0.25))
    spoiled = compute_baseline(one, two, orbits, BASE_3040, replace(QUICK, alternatives=False))
    assert spoiled.ambiguities == "float" or spoiled.residual > 0.0104  # type: ignore[operator]
    found = compute_baseline(one, two, orbits, BASE_3040, QUICK)
    moved = found.attempts[1]
    assert (moved.ambiguities, moved.frequencies) == ("fixed", 2)
    assert moved.fixed_share == pytest.approx(before.fixed_share, abs=0.02)
    assert moved.ratio == pytest.approx(before.ratio, rel=0.02)
    assert np.linalg.norm(found.rover - ROVER_0759) < 0.015
    # moved the wrong way they are half a cycle off
    two.write_text(flagged(rover.read_text(), lambda name: int(name[1:]) % 2 == 0, -0.25))
    wrong = compute_baseline(one, two, orbits, BASE_3040, QUICK)
    assert wrong.attempts[1].ambiguities == "float"
    assert (wrong.ambiguities, wrong.frequencies) == ("fixed", 1)


def test_headline_of_the_command(shared_data: Path) -> None:
    base, rover, orbits = rgp(shared_data, "230913")
    where = ",".join(map(str, IGNF))
    call = ["baseline", str(base), str(rover), str(orbits[0]), "--base-xyz", where]
    asked = RUN.invoke(app, [*call, "--no-alternatives"])
    assert asked.exit_code == 0, asked.output
    assert "float ambiguities, 4 % of 480 epochs fixed, ratio 1.6, sigma" in asked.output
    assert "choice:" not in asked.output
    words = [one.words for one in answer_of(whole(shared_data, "230913")).findings]
    assert re.search("fixed ambiguities, 9[89][.0-9]* % of 480 epochs fixed, ratio", words[0])
    choice = next(line for line in words if line.startswith("choice: L1 alone is taken"))
    # how far the pieces of both ways scatter
    its, others = (float(x) for x in re.findall(r"10 pieces scatter by ([\d.]+) mm", choice))
    assert others > 3 * its
    assert sum(line.endswith("(taken)") for line in words) == 1
