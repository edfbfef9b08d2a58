"""What a comparison found as plain numbers, to be remembered, and back: equal in every digit."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.c2c import C2C, Pitch, Signed
from tribrach.comparison.floor import Floor
from tribrach.comparison.predicted import OffsetTest, Prediction
from tribrach.comparison.results import M3C2Figures, SiteResult
from tribrach.comparison.sites import Geometry
from tribrach.comparison.tally import Tally

__all__ = ["from_facts", "to_facts"]

#: dataclasses inside of others, by the names of their fields
_INSIDE: dict[str, type[Any]] = {
    "seen_a": Geometry,
    "seen_b": Geometry,
    "c2c": C2C,
    "m3c2": M3C2Figures,
    "prediction": Prediction,
    "floor": Floor,
    "pitch_a": Pitch,
    "pitch_b": Pitch,
    "plane": Signed,
    "tally": Tally,
}
#: arrays of millions of numbers are no results of a comparison; files may be tampered with
_MOST = 10_000_000


def to_facts(
    sites: Sequence[SiteResult], offsets: OffsetTest | None, remarks: Sequence[str]
) -> dict[str, Any]:
    """Sites, the test of all their offsets, and remarks as plain numbers."""
    return {
        "sites": [_plain(site) for site in sites],
        "offsets": None if offsets is None else asdict(offsets),
        "remarks": list(remarks),
    }


def from_facts(facts: Mapping[str, Any]) -> tuple[list[SiteResult], OffsetTest | None, list[str]]:
    """The same three again.

    Raises
    ------
    ValueError, KeyError, TypeError : these are facts of something else, or damaged.
    """
    sites = [_made(SiteResult, site) for site in facts["sites"]]
    offsets = facts["offsets"]
    return sites, None if offsets is None else OffsetTest(**offsets), list(facts["remarks"])


def _plain(value: Any) -> Any:
    """Dataclasses as mappings, arrays packed, numbers of numpy as those of Python."""
    if is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, np.ndarray):
        little = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        packed = base64.b64encode(zlib.compress(little.tobytes(), 1)).decode()
        return {"type": little.dtype.str, "shape": list(value.shape), "packed": packed}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def _made(kind: type[Any], facts: Mapping[str, Any]) -> Any:
    """A dataclass from its fields; lists of them were tuples."""
    given: dict[str, Any] = {}
    for name, value in facts.items():
        if isinstance(value, Mapping):
            given[name] = _array(value) if "packed" in value else _made(_INSIDE[name], value)
        else:
            given[name] = tuple(value) if isinstance(value, list) else value
    return kind(**given)


def _array(facts: Mapping[str, Any]) -> NDArray[Any]:
    dtype, shape = np.dtype(facts["type"]), tuple(int(n) for n in facts["shape"])
    size = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if dtype.kind not in "fi" or not 0 <= size <= 8 * _MOST:
        raise ValueError("this is no array of numbers")
    try:
        unpacked = zlib.decompressobj().decompress(base64.b64decode(facts["packed"]), size + 1)
    except zlib.error as error:
        raise ValueError("the packed numbers are damaged") from error
    return np.frombuffer(unpacked, dtype=dtype).reshape(shape).copy()
