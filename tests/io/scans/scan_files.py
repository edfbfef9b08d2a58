"""What the tests of readers share: whole scans in one piece, text of numbers."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tribrach.scan.scan import Chunk, Scan


def whole(scan: Scan, size: int = 1000, start: int = 0) -> Chunk:
    """All points of a scan and all that were dropped."""
    chunks = list(scan.chunks(size, start))
    if not chunks:
        return Chunk(np.zeros((0, 3)), {})
    assert all(len(chunk) + chunk.dropped <= size for chunk in chunks)
    values = {
        name: np.concatenate([chunk.values[name] for chunk in chunks]) for name in chunks[0].values
    }
    xyz = np.concatenate([chunk.xyz for chunk in chunks])
    return Chunk(xyz, values, sum(chunk.dropped for chunk in chunks))


def same(a: Chunk, b: Chunk) -> None:
    """The same points and values, bit for bit."""
    assert np.array_equal(a.xyz, b.xyz)
    assert a.values.keys() == b.values.keys()
    for name, column in a.values.items():
        assert column.dtype == b.values[name].dtype
        assert np.array_equal(column, b.values[name]), name


def lines(*parts: str | Iterable[Iterable[float]]) -> str:
    """Strings as they are; rows of numbers with all their digits."""
    out = []
    for part in parts:
        if isinstance(part, str):
            out.append(part)
        else:
            out += [" ".join(repr(float(v)) for v in row) for row in part]
    return "\n".join(out) + "\n"


def written(folder: Path, name: str, text: str | bytes) -> Path:
    """A new file."""
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path
