"""What is remembered, and when it is void."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.io.keeping import STATE_FOLDER as FOLDER
from tribrach.job.state import Remembered, digest


def test_a_product_is_recalled_until_its_key_or_its_file_changes(tmp_path: Path) -> None:
    state, product = Remembered(tmp_path), tmp_path / "a.laz"
    product.write_bytes(b"12345")
    state.remember("a", "key", 5, product)
    assert state.recall("a", "key", int, product) == 5
    assert state.recall("a", "other", int, product) is None
    assert state.recall("b", "key", int, product) is None
    product.write_bytes(b"123")
    assert state.recall("a", "key", int, product) is None
    product.unlink()
    assert state.recall("a", "key", int, product) is None


def test_what_is_handed_on_is_no_memory(tmp_path: Path) -> None:
    """Whoever recalls it next gets the object itself, and nobody else."""
    state, made = Remembered(tmp_path), [1.0, 2.0]
    state.remember("a", "key", made)
    state.hand_on("a", "key", made)
    assert state.recall("a", "key", list[float]) is made
    again = state.recall("a", "key", list[float])
    assert again == made
    assert again is not made
    state.hand_on("a", "key", made)
    assert state.recall("a", "other", list[float]) is None
    assert state.known("a", "key", list[float])
    (tmp_path / FOLDER / "a.json").unlink()
    assert state.recall("a", "key", list[float]) == made
    assert state.recall("a", "key", list[float]) is None


def test_damaged_memory_is_no_memory(tmp_path: Path) -> None:
    state = Remembered(tmp_path)
    state.remember("a", "key", [1])
    for text in ("{", "[1]", '{"key": "key", "files": [], "facts": "1"}'):
        (tmp_path / FOLDER / "a.json").write_text(text)
        assert state.recall("a", "key", list[int]) is None


def test_what_is_no_number_is_recalled_as_it_was(tmp_path: Path) -> None:
    state, facts = Remembered(tmp_path), {"a": [np.nan, 1.5], "b": [-np.inf, np.inf]}
    state.remember("a", "key", facts)
    text = (tmp_path / FOLDER / "a.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    assert repr(state.recall("a", "key", dict[str, list[float]])) == repr(facts)


def test_files_are_known_by_their_contents(tmp_path: Path) -> None:
    state, one, two = Remembered(tmp_path), tmp_path / "1", tmp_path / "2"
    one.write_bytes(b"same" * 1000)
    two.write_bytes(b"same" * 1000)
    assert state.file_digest(one) == state.file_digest(two) == Remembered(tmp_path).file_digest(one)
    two.write_bytes(b"diff" * 1000)
    assert state.file_digest(one) != state.file_digest(two)


def test_a_clock_that_is_set_back_hides_no_change(tmp_path: Path) -> None:
    """A file of the same size is another one with an earlier date, and with the date it had."""
    state, file = Remembered(tmp_path), tmp_path / "1"
    file.write_bytes(b"same" * 1000)
    before, date = state.file_digest(file), file.stat().st_mtime_ns
    changed = set()
    for number, back in enumerate((3600 * 10**9, 0), start=1):
        file.write_bytes(b"edit%d" % number * 800)
        os.utime(file, ns=(date - back, date - back))
        assert file.stat().st_size == 4000
        changed.add(state.file_digest(file))
    assert len(changed) == 2
    assert before not in changed
    # and the file as it was is known by its content again
    file.write_bytes(b"same" * 1000)
    os.utime(file, ns=(date, date))
    assert state.file_digest(file) == before


def test_one_bit_changes_the_digest() -> None:
    x = np.array([1.0, 2.0])
    assert digest(x, {"b": 1, "a": 2}) == digest(x.copy(), {"a": 2, "b": 1})
    assert digest(x) != digest(np.nextafter(x, 9))
    assert digest("1") != digest(1) != digest(1.0)
    assert digest(["ab", "c"]) != digest(["a", "bc"])


@given(st.lists(st.one_of(st.integers(), st.text(), st.floats(allow_nan=False)), max_size=6))
def test_a_digest_depends_on_nothing_else(parts: list[object]) -> None:
    assert digest(*parts) == digest(*parts)
    assert digest(*parts) != digest(*parts, 0)


@pytest.mark.parametrize("name", ["targets-../../x", "a/b", "..", "x" * 300, "a\0b", ""])
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    state = Remembered(tmp_path / "out")
    state.remember(name, "key", 5)
    state.remember("a_b", "key", 6)
    assert state.recall(name, "key", int) == 5
    assert state.recall("a_b", "key", int) == 6
    assert {p.parent for p in tmp_path.rglob("*.json")} == {tmp_path / "out" / FOLDER}
