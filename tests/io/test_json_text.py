"""JSON as every reader takes it: no NaN, no Infinity; and what is remembered comes back."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.io.clouds.header import CloudHeader
from tribrach.io.clouds.las import las_header
from tribrach.io.json_text import json_text, restored
from tribrach.io.lever_arm_file import LeverArmResult, lever_arm_text, read_lever_arm
from tribrach.io.scans.las import FACTS

TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda below: st.lists(below) | st.dictionaries(st.text(), below),
    max_leaves=20,
)


def refuse(word: str) -> float:
    raise AssertionError(word)


@given(TREES)
def test_any_data_are_strict_json_and_what_is_no_number_is_null(data: object) -> None:
    read = json.loads(json_text(data, indent=1), parse_constant=refuse)
    expected = json.loads(json.dumps(data), parse_constant=lambda _: None)
    assert read == expected


@given(TREES)
def test_what_is_remembered_comes_back_to_the_bit(data: object) -> None:
    text = json_text(data, restorable=True)
    read = json.loads(text, parse_constant=refuse, object_hook=restored)
    assert json.dumps(read) == json.dumps(data)


def test_finite_data_are_written_as_python_does() -> None:
    data = {"b": [1, 2.5, None], "a": {"name": "ö", "yes": True}}
    assert json_text(data, indent=1, sort_keys=True) == json.dumps(data, indent=1, sort_keys=True)
    assert json_text((1.0, math.inf, np.float64("nan"))) == "[1.0, null, null]"
    with pytest.raises(TypeError):
        json_text({"at": object()})
    with pytest.raises(ValueError, match="could not convert"):
        restored({"not_finite": "__import__"})


def test_facts_in_clouds_are_strict() -> None:
    header = CloudHeader("S1", facts={"sigma": math.nan, "station": {"S1": math.inf}})
    (facts,) = [v for v in las_header(header).vlrs if (v.user_id, v.record_id) == FACTS]
    read = json.loads(facts.record_data, parse_constant=refuse)
    assert (read["sigma"], read["station"]) == (None, {"S1": None})


@pytest.mark.parametrize("name", ['"] \\ = [', "prism \U0001f4d0", "a\x7f\x1b\u202eb\n", "'''"])
def test_names_of_lever_arms_come_back_from_their_file(tmp_path: Path, name: str) -> None:
    arm = LeverArmResult(
        name=name, vector=np.arange(3.0), covariance=np.eye(3) * 1e-6, stations=(name, "S2"),
        date="", datum=name, sigma_origin="a priori",
    )  # fmt: skip
    path = tmp_path / "arm.toml"
    path.write_text(lever_arm_text(arm), encoding="utf-8")
    read = read_lever_arm(path)
    assert (read.name, read.stations, read.datum) == (name, (name, "S2"), name)
