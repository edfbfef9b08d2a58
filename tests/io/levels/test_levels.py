"""Files of digital levels: set-ups, double readings, heights that were keyed in, closures."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.io.levels.files import Levelled, recognised
from tribrach.io.survey.formats import format_of, read_files
from tribrach.network.adjustment import adjust
from tribrach.network.facts import facts_of
from tribrach.network.level_closures import LevelSection, level_closures
from tribrach.network.survey import Survey, observed_part

#: set-ups of a line: backsight and foresight with their readings and distances, in the order of
#: reading
Setup = list[tuple[str, str, float, float]]
ENGLISH = {"b": "Rb", "f": "Rf", "i": "Rz", "d": "HD", "start": "Start-Line", "end": "End-Line"}
GERMAN = {"b": "Lr", "f": "Lv", "i": "Lz", "d": "E", "start": "Linienanfang", "end": "Linienende"}


def line_of(heights: dict[str, float], names: list[str], order: str) -> list[Setup]:
    """Set-ups from point to point without error, read in an order such as BFFB."""
    out = []
    for a, b in pairwise(names):
        horizon = max(heights[a], heights[b]) + 1.2
        ends = {"B": ("b", a), "F": ("f", b)}
        out.append(
            [(*ends[letter], horizon - heights[ends[letter][1]], 20.0 + k)
             for k, letter in enumerate(order)]
        )  # fmt: skip
    return out


def m5(start: str, height: float | None, setups: list[Setup], words: dict[str, str]) -> str:
    rows = [("TO  " + words["start"].ljust(16) + "BF     1", "", "", "")]
    if height is not None:
        rows.append((f"KD1 {start:>8}                  1", "", "", f"Z {height:14.5f} m   "))
    for setup in setups:
        for kind, point, value, far in setup:
            rows.append(
                (f"KD1 {point:>8}       08:01:12  1", f"{words[kind]} {value:14.5f} m   ",
                 f"{words['d']:2} {far:14.3f} m   ", "")
            )  # fmt: skip
    rows.append(("TO  " + words["end"], "", "", ""))
    return "".join(
        f"For M5|Adr {k:5d}|{a:<32}|{b:<22}|{c:<22}|{d:<22}|\n"
        for k, (a, b, c, d) in enumerate(rows, start=1)
    )


def rec500(start: str, height: float | None, setups: list[Setup]) -> str:
    rows = ["Start-Line       BFFB    101"]
    if height is not None:
        rows.append(f"{start:>8}    0            101                Z {height:11.5f}")
    rows += [
        f"{point:>8}    0            101 {ENGLISH[kind]} {value:12.5f} HD {far:9.3f}"
        for setup in setups
        for kind, point, value, far in setup
    ]
    rows.append("End-Line                 101")
    return "".join(f"{k:7d} {row}\n" for k, row in enumerate(rows, start=65))


def gsi(start: str, height: float | None, setups: list[Setup], width: int) -> str:
    star, rows = "*" if width == 16 else "", []

    def word(index: str, data: int | str, sign: str = "+") -> str:
        return f"{index:.<5}6{sign}{data:0>{width}}"

    def block(name: str, *words: str) -> None:
        rows.append(f"{star}11{len(rows) + 1:04d}+{name:0>{width}} " + " ".join(words) + " ")

    rows.append(f"{star}410001+" + "?......1".ljust(width, "."))
    if height is not None:
        block(start, word("83", round(height * 1e4)))
    for setup in setups:
        seen: dict[str, int] = {}
        for kind, point, value, far in setup:
            seen[kind] = seen.get(kind, 0) + 1
            index = {"b": ("331", "335"), "f": ("332", "336"), "i": ("333",)}[kind]
            block(
                point, word("32", round(far * 1e4)), word(index[seen[kind] - 1], round(value * 1e4))
            )
        block(setup[-1][1], word("573", 0), word("83", 0))
    return "\n".join(rows) + "\n"


def kolida(start: str, height: float | None, setups: list[Setup]) -> str:
    rows = [f"B {start} {height or 0:.3f}m 1"]
    for setup in setups:
        seen = {"b": 0, "f": 0}
        for kind, point, value, far in setup:
            seen[kind] += 1
            letter = {"b": "G", "f": "I"}[kind]
            method = {"b": "B", "f": "F"}[kind]
            rows.append(f"{letter} {value:.5f}m {far:.3f}m {point} {start} 3{method}{seen[kind]}")
    return "\n".join([*rows, f"W 0.00037m 262.807m {start} {start}", ""])


WRITERS = {
    "kolida.txt": kolida,
    "dini.dat": lambda *line: m5(*line, ENGLISH),
    "deutsch.dat": lambda *line: m5(*line, GERMAN),
    "rec.raw": rec500,
    "level8.gsi": lambda *line: gsi(*line, 8),
    "level16.gsi": lambda *line: gsi(*line, 16),
}
HEIGHTS = {"BM01": 100.0, "TP1": 100.312, "TP2": 99.4153, "BM02": 100.0409, "TP4": 98.7}


def survey(folder: Path, name: str, text: str) -> Survey:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    assert format_of(path) == "levels"
    return read_files([path])


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("order", ["BF", "BFFB", "BBFF", "FBBF", "BFBF"])
def test_lines_of_every_maker_and_order(tmp_path: Path, name: str, order: str) -> None:
    names = ["BM01", "TP1", "TP2", "BM02"]
    text = WRITERS[name]("BM01", 100.0, line_of(HEIGHTS, names, order))
    found = survey(tmp_path, name, text)
    (fact,) = facts_of(found.facts, Levelled)
    assert [(s.start, s.end) for s in fact.sections] == list(pairwise(names))
    np.testing.assert_allclose(
        [s.difference for s in fact.sections],
        [HEIGHTS[b] - HEIGHTS[a] for a, b in pairwise(names)],
        atol=1e-9,
    )
    # two readings of each end are two height differences
    network = observed_part(found).network()
    assert len(network.observations[0]) == 3 * len(order) // 2
    assert len(fact.doubles) == (3 if len(order) == 4 else 0)
    adjustment = adjust(network)
    for point in names:
        assert adjustment.points[point].xyz[2] == pytest.approx(HEIGHTS[point], abs=1e-9)
    # together they are as good as one line of the same length
    far = sum(d for _, _, _, d in line_of(HEIGHTS, names[:2], order)[0]) / (len(order) // 2)
    sigma = adjustment.points["TP1"].sigma[2]
    assert sigma == pytest.approx(1e-3 * np.sqrt(far / 1000), rel=1e-6)


@pytest.mark.parametrize("name", [name for name in WRITERS if name != "kolida.txt"])
def test_intermediate_sights(tmp_path: Path, name: str) -> None:
    setups = line_of(HEIGHTS, ["BM01", "TP1", "BM02"], "BF")
    horizon = HEIGHTS["TP1"] + 1.2
    setups[-1].append(("i", "IS1", horizon - 99.5, 12.0))
    found = survey(tmp_path, name, WRITERS[name]("BM01", 100.0, setups))
    adjustment = adjust(observed_part(found).network())
    assert adjustment.points["IS1"].xyz[2] == pytest.approx(99.5, abs=1e-9)


@pytest.mark.parametrize("name", WRITERS)
def test_without_a_height_all_points_carry_the_datum(tmp_path: Path, name: str) -> None:
    found = survey(
        tmp_path, name, WRITERS[name]("BM01", None, line_of(HEIGHTS, ["BM01", "TP1"], "BF"))
    )
    assert found.datum.kind == "free"
    assert not found.points


def test_heights_of_a_list_take_the_place_of_keyed_ones(tmp_path: Path) -> None:
    control = tmp_path / "control.csv"
    control.write_text("point,u_m,role\nBM01,50.0,fixed\n")
    path = tmp_path / "dini.dat"
    path.write_text(m5("BM01", 100.0, line_of(HEIGHTS, ["BM01", "TP1"], "BF"), ENGLISH))
    for order in ([control, path], [path, control]):
        adjustment = adjust(observed_part(read_files(order)).network())
        assert adjustment.points["TP1"].xyz[2] == pytest.approx(50.312, abs=1e-9)


@given(st.floats(-5e-3, 5e-3))
def test_loops_close_as_by_hand(tmp_path_factory: pytest.TempPathFactory, off: float) -> None:
    names = ["BM01", "TP1", "TP2", "TP4", "BM01"]
    setups = line_of(HEIGHTS, names, "BF")
    kind, point, value, far = setups[2][1]
    setups[2][1] = (kind, point, round(value - off, 5), far)
    path = tmp_path_factory.mktemp("level") / "dini.dat"
    path.write_text(m5("BM01", 100.0, setups, ENGLISH))
    (fact,) = facts_of(read_files([path]).facts, Levelled)
    (closure,) = fact.closures
    assert closure.loop
    assert abs(closure.misclosure) == pytest.approx(abs(off), abs=6e-6)
    assert closure.length == pytest.approx(4 * 41.0)
    assert closure.limit == pytest.approx(3e-3 * np.sqrt(4 * 0.041))
    assert closure.passed == (abs(closure.misclosure) <= closure.limit)


def test_double_runs_and_lines_between_given_heights() -> None:
    sections = [
        LevelSection("A", "B", 1.000, 400.0),
        LevelSection("B", "A", -1.003, 400.0),
        LevelSection("B", "C", 2.000, 600.0),
    ]
    closures = level_closures(sections, {"A": 10.0, "C": 13.010}, 4e-3)
    loop = next(c for c in closures if c.loop)
    line = next(c for c in closures if not c.loop)
    assert abs(loop.misclosure) == pytest.approx(0.003)
    assert loop.length == pytest.approx(800.0)
    assert loop.limit == pytest.approx(4e-3 * np.sqrt(0.8))
    assert loop.passed
    assert (line.points, line.passed) == (("A", "B", "C"), False)
    assert line.misclosure == pytest.approx(-0.010)


def test_random_networks_have_as_many_loops_as_sections_beyond_a_tree() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        n = int(rng.integers(3, 12))
        heights = rng.uniform(0, 10, n)
        pairs = [(k, int(rng.integers(k))) for k in range(1, n)]
        pairs += [tuple(rng.choice(n, 2, replace=False)) for _ in range(int(rng.integers(1, 9)))]
        sections = [
            LevelSection(f"P{a}", f"P{b}", heights[b] - heights[a], float(rng.uniform(50, 900)))
            for a, b in pairs
        ]
        closures = level_closures(sections, {"P0": heights[0], "P1": heights[1]}, 1e-3)
        assert sum(c.loop for c in closures) == len(sections) - n + 1
        assert max(abs(c.misclosure) for c in closures) < 1e-9
        assert all(c.points[0] == c.points[-1] or {"P0", "P1"} == {c.points[0], c.points[-1]}
                   for c in closures)  # fmt: skip


def test_numbered_turning_points_belong_to_their_line(tmp_path: Path) -> None:
    heights = {"A": 10.0, "B": 11.0, "1": 10.4, "2": 10.8}
    there = line_of(heights, ["A", "1", "B"], "BF")
    back = line_of(heights | {"1": 10.9}, ["B", "1", "A"], "BF")
    text = m5("A", 10.0, there, ENGLISH) + m5("B", None, back, ENGLISH)
    found = survey(tmp_path, "dini.dat", text)
    (fact,) = facts_of(found.facts, Levelled)
    (loop,) = fact.closures
    assert abs(loop.misclosure) < 1e-9
    assert loop.length == pytest.approx(164.0)


def test_a_double_reading_that_differs_is_told(tmp_path: Path) -> None:
    setups = line_of(HEIGHTS, ["BM01", "TP1"], "BFFB")
    kind, point, value, far = setups[0][3]
    setups[0][3] = (kind, point, value + 0.01, far)
    found = survey(tmp_path, "dini.dat", m5("BM01", 100.0, setups, ENGLISH))
    (fact,) = facts_of(found.facts, Levelled)
    assert fact.doubles == (pytest.approx(0.01),)
    assert any("double readings" in w and "dini.dat:5" in w for w in found.warnings)


def test_a_foresight_that_is_missing_is_told_with_its_line(tmp_path: Path) -> None:
    setups = line_of(HEIGHTS, ["BM01", "TP1", "TP2"], "BF")
    del setups[1][1]
    found = survey(tmp_path, "dini.dat", m5("BM01", 100.0, setups, ENGLISH))
    assert any("dini.dat:5" in w and "TP1" in w for w in found.warnings)


def test_without_any_set_up_it_is_refused(tmp_path: Path) -> None:
    setups = line_of(HEIGHTS, ["BM01", "TP1"], "BF")
    del setups[0][1]
    with pytest.raises(InputError, match="no set-up"):
        survey(tmp_path, "dini.dat", m5("BM01", 100.0, setups, ENGLISH))


def test_total_stations_are_not_levels(shared_data: Path) -> None:
    files = [p for p in (shared_data / "totalstation").rglob("*") if p.is_file()]
    assert len(files) > 10
    assert [p.name for p in files if recognised(p)] == ["test.gsi"]


def test_networks_of_programs_are_not_levels(shared_data: Path) -> None:
    files = [p for p in (shared_data / "networks").rglob("*") if p.is_file()]
    assert len(files) > 100
    assert not [p.name for p in files if recognised(p)]


def test_a_job_of_33_lines(shared_data: Path) -> None:
    """BFFB throughout, turning points numbered from one in every line, no height keyed in."""
    paths = list((shared_data / "totalstation").rglob("test.gsi"))
    if not paths:
        pytest.skip(f"third-party data are not in {shared_data}")
    found = read_files(paths)
    (fact,) = facts_of(found.facts, Levelled)
    assert len(fact.doubles) == len(fact.sections) == 336
    assert max(fact.doubles) < 3e-4
    assert not found.points
    # fifteen loops of up to 4.4 km; one line of 0.3 km is wrong by 73 mm, all others close
    assert len(fact.closures) == 15
    (bad,) = (c for c in fact.closures if not c.passed)
    assert set(bad.marks) == {"N", "I"}
    assert bad.misclosure == pytest.approx(-0.0734, abs=1e-4)
    long = max(fact.closures, key=lambda c: c.length)
    assert long.length == pytest.approx(4363, abs=1)
    assert abs(long.misclosure) < 5e-4


@pytest.mark.parametrize("name", ["dini.dat", "level_gsi8.gsi"])
def test_lines_of_others(shared_data: Path, name: str) -> None:
    path = shared_data / "faults" / "networks2" / "14-level-files" / name
    if not path.is_file():
        pytest.skip(f"third-party data are not in {path.parent}")
    found = read_files([path])
    (fact,) = facts_of(found.facts, Levelled)
    assert [(s.start, s.end) for s in fact.sections] == [
        ("BM01", "TP1"), ("TP1", "TP2"), ("TP2", "BM02"),
    ]  # fmt: skip
    np.testing.assert_allclose(
        [s.difference for s in fact.sections], [0.3120, -0.8967, 0.6256], atol=1e-9
    )
    np.testing.assert_allclose([s.length for s in fact.sections], [50.21, 59.77, 37.35])
    heights = adjust(observed_part(found).network()).points
    field_book = {"TP1": 100.312, "TP2": 99.4153, "BM02": 100.0409, "IS01": 98.7124}
    for point, height in field_book.items():
        assert heights[point].xyz[2] == pytest.approx(height, abs=6e-5)


def test_a_line_of_rec_500(shared_data: Path) -> None:
    path = shared_data / "faults" / "networks2" / "14-level-files" / "rec500.raw"
    if not path.is_file():
        pytest.skip(f"third-party data are not in {path.parent}")
    found = read_files([path])
    heights = adjust(observed_part(found).network()).points
    assert heights["1"].xyz[2] == pytest.approx(2175.260, abs=6e-4)
    # lines are missing before the intermediate sight
    assert "4960" not in heights


def test_a_loop_of_kolida_closes_as_its_sums_say(tmp_path: Path) -> None:
    """Readings whose sum is 0.11 mm and 90 m by hand; a sort of reading that is not known."""
    text = """\
B BM 0.000m 1
G 1.50012m 15.000m BM BM 3B1
I 1.40000m 15.000m 1 BM 3F1
I 1.40002m 15.000m 1 BM 3F2
G 1.50010m 15.000m BM BM 3B2
K 1.00000m 9.000m X BM 3S1
G 1.20000m 20.000m 1 BM 3B1
I 1.30000m 10.000m 2 BM 3F1
G 1.10001m 10.000m 2 BM 3B1
I 1.10000m 20.000m BM BM 3F1
W 0.00011m 90.000m BM BM
"""
    found = survey(tmp_path, "raw.txt", text)
    (fact,) = facts_of(found.facts, Levelled)
    (closure,) = fact.closures
    assert abs(closure.misclosure) == pytest.approx(0.00011, abs=1e-9)
    assert closure.length == pytest.approx(90.0)
    assert fact.files[0].problems == ((6, "the reading K is of no known sort"),)
    assert found.datum.kind == "free"
