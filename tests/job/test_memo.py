"""Values that are taken apart and put together again are the same in every bit, or refused."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.job.memo import put_together, settled, taken_apart
from tribrach.sentences import Notation, Sentence

KINDS = ("<f8", "<f4", "<i8", "<i1", "|u1", "|b1", ">f8")


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True, eq=False)
class Inner:
    place: Array
    name: str = ""


@dataclass(frozen=True)
class Outer:
    inner: Inner
    several: tuple[Inner, ...]
    pair: tuple[int, float]
    numbers: Mapping[int, bytes]
    colour: Colour
    kind: Literal["a", "b"]
    either: Index | float | None
    step: float = 0.0
    words: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.step < 0:
            raise InputError("there is no negative step")


def outer(**changes: Any) -> Outer:
    inner = Inner(np.array([0.1, -0.0, np.nan]), "S1")
    given: dict[str, Any] = {"inner": inner, "several": (inner, Inner(np.zeros((0, 3))))}
    given |= {"pair": (1, 0.5), "numbers": {-1: b"\0\xff", 2: b""}, "colour": Colour.RED}
    return Outer(**given | {"kind": "b", "either": np.array([[1, 2]]), "step": 1e-300} | changes)


def same(one: Any, other: Any) -> bool:
    """Equal in every bit, in type and order."""
    if isinstance(one, np.ndarray):
        bits = one.dtype == other.dtype and one.tobytes() == other.tobytes()
        return bits and one.shape == other.shape and one.flags.c_contiguous
    if is_dataclass(one) and not isinstance(one, type):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, Mapping):
        return same(list(one.items()), list(other.items()))
    if isinstance(one, list | tuple):
        return type(one) is type(other) and len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and bool(one == other)


def carried(form: Any, value: Any) -> Any:
    return put_together(form, json.loads(json.dumps(taken_apart(value))))


@pytest.mark.parametrize("either", [np.array([7]), 2.5, None])
def test_a_dataclass_comes_back(either: Any) -> None:
    value = outer(either=either)
    assert same(carried(Outer, value), value)


@given(
    st.sampled_from(KINDS).flatmap(
        lambda kind: arrays.arrays(np.dtype(kind), arrays.array_shapes(min_dims=0, min_side=0))
    )
)
def test_arrays_come_back_bit_for_bit(array: NDArray[Any]) -> None:
    """Whatever their numbers mean: unusual NaN and zeros with a sign included."""
    for one in (array, array.T, array[..., ::-1] if array.ndim else array):
        there = carried(NDArray[Any], settled(one))
        assert there.tobytes() == one.astype(one.dtype.newbyteorder("<")).tobytes()
        assert there.shape == one.shape
        assert there.flags.c_contiguous
        assert there.flags.writeable


def test_what_is_handed_on_is_what_comes_back() -> None:
    """Numbers of numpy and arrays in another order would be others a run later."""
    matrix = np.arange(6.0).reshape(2, 3).T
    found = settled(
        outer(inner=Inner(matrix), step=np.float64(2), pair=(np.int64(3), np.float32(4)))
    )
    assert found.inner.place.flags.c_contiguous
    assert not np.shares_memory(found.inner.place, matrix)
    assert [type(number) for number in (found.step, *found.pair)] == [float, int, float]
    assert same(carried(Outer, found), found)


def test_sentences_come_back_with_their_figures() -> None:
    """A second run writes them in the notation of the report as the first one did."""
    inner = Sentence("off by {by:mm2}", by=np.float64(0.00321))
    said = Sentence("{name} is {inner}, {n} times ({colour})", name="P", inner=inner, n=np.int64(3),
                    colour=Colour.RED)  # fmt: skip
    value = Inner(np.zeros(1), said)
    found, comma = settled(value), Notation(decimal=",", angle="gon")
    again = carried(Inner, found)
    assert same(again, found)
    assert again.name == said
    assert comma.words(again.name) == comma.words(said) != said
    assert again.name.values["inner"].values == {"by": 0.00321}


def damaged(**changes: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(taken_apart(outer())))
    return data | changes


PACKED = taken_apart(np.zeros(3))


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        "x",
        {},
        damaged(more=1),
        damaged(step=-1.0),
        damaged(step="1"),
        damaged(kind="c"),
        damaged(kind=["a"]),
        damaged(colour="GREEN"),
        damaged(colour=["RED"]),
        damaged(pair=[1]),
        damaged(pair=[1, 2.0, 3]),
        damaged(several=3),
        damaged(numbers=[[1, "no base64"]]),
        damaged(numbers=[[1]]),
        damaged(numbers={"1": ""}),
        damaged(words=[1]),
        damaged(words=[{"template": "{by:mm2}", "values": {}}]),
        damaged(words=[{"template": "{by:mm2}", "values": {"by": "x"}}]),
        damaged(words=[{"template": "{by", "values": {"by": 1.0}}]),
        damaged(words=[{"template": 3, "values": {}}]),
        damaged(words=[{"template": "", "values": []}]),
        damaged(words=[{"values": {}}]),
        *(
            damaged(inner={"name": "S1", "place": place})
            for place in (
                None,
                [0.0, 1.0],
                PACKED | {"shape": [4]},
                PACKED | {"shape": [-3]},
                PACKED | {"shape": [10**9, 10**9]},
                PACKED | {"shape": "x"},
                PACKED | {"shape": [float("inf")]},
                PACKED | {"type": "|O"},
                PACKED | {"type": "<U8"},
                PACKED | {"type": "nonsense"},
                PACKED | {"packed": "AAAA"},
                PACKED | {"packed": PACKED["packed"][:-8]},
                PACKED | {"packed": "\u00e4"},
                PACKED | {"packed": 3},
                {"type": "<f8"},
            )
        ),
    ],
)
def test_what_does_not_fit_is_refused(data: Any) -> None:
    with pytest.raises(ValueError, match="this is no"):
        put_together(Outer, data)


@pytest.mark.parametrize("value", [object(), {1, 2}, 1j, np.array([object()]), np.array(["a"])])
def test_other_values_are_not_taken_apart(value: Any) -> None:
    with pytest.raises(TypeError, match="cannot be taken apart"):
        taken_apart([value])
