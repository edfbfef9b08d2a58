"""PLY, binary little endian: coordinates as doubles, every field in its own type.

Reference system, epoch and facts are comments ``key: value``; long values go on in further comments
of the same key, because some readers take only lines of 1 kB.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.clouds.header import CloudHeader, CloudWriter, exactly
from tribrach.io.clouds.staged import Staged

_TYPES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}
#: names of PLY; others begin so that CloudCompare shows them without being asked
_RENAMED = {
    **{f"normal_{axis}": f"n{axis}" for axis in "xyz"},
    **{name: name for name in ("red", "green", "blue", "intensity")},
}
#: digits kept free for the number of points; characters of a comment's value
_DIGITS, _VALUE = 15, 200


class PlyWriter(CloudWriter):
    """Writes points chunk by chunk; their number is put into the header at the end."""

    def __init__(self, path: Path, header: CloudHeader) -> None:
        self._comments = list(_comments(header))
        self._header, self._staged = header, Staged(path)
        self._dtype: np.dtype[Any] | None = None
        self._places: dict[str, list[str]] = {}
        self._count = 0

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m] and values (n,) or (n, k) by field; those left out are zero."""
        if len(xyz) == 0:
            return
        if not np.isfinite(xyz).all():
            raise InputError("a coordinate is not a number", file=self._staged.path)
        dtype = self._begun(values)
        record = np.zeros(len(xyz), dtype=dtype)
        for name, coordinate in zip("xyz", xyz.T, strict=True):
            record[name] = coordinate
        for name, places in self._places.items():
            if name in values:
                columns = values[name].reshape(len(xyz), -1).T
                if len(columns) != len(places):
                    what = f"the field {name} has another number of values than before"
                    raise InputError(what, file=self._staged.path)
                for place, column in zip(places, columns, strict=True):
                    record[place] = exactly(column, dtype[place], name, self._staged.path)
        with self._staged.writing():
            self._staged.file.write(record.tobytes())
        self._count += len(xyz)

    def _begun(self, values: Mapping[str, NDArray[Any]]) -> np.dtype[Any]:
        """The type of a record; writes the header at the first call, once the widths are known."""
        if self._dtype is None:
            types = dict.fromkeys("xyz", "<f8")
            for field in self._header.fields:
                column = values.get(field.name)
                width = column.shape[1] if column is not None and column.ndim == 2 else 0
                bare = re.sub(r"\s+", "_", _RENAMED.get(field.name, f"scalar_{field.name}"))
                places = [f"{bare}_{k}" for k in range(width)] if width else [bare]
                kind = np.dtype(field.dtype).newbyteorder("<").str
                for k, place in enumerate(places):
                    while place in types:
                        place += "_2"
                    types[place] = kind if kind[1:] in _TYPES else "<f8"
                    places[k] = place
                self._places[field.name] = places
            self._dtype = np.dtype(list(types.items()))
            with self._staged.writing():
                self._staged.file.write(self._text(self._dtype))
        return self._dtype

    def _text(self, dtype: np.dtype[Any]) -> bytes:
        """The header; its length does not depend on the number of points."""
        count = str(self._count)
        properties = [f"property {_TYPES[dtype[n].str[1:]]} {n}" for n in dtype.names or ()]
        lines = [
            "ply",
            "format binary_little_endian 1.0",
            "comment Tribrach " + "_" * (_DIGITS - len(count)),
            *self._comments,
            f"element vertex {count}",
            *properties,
            "end_header",
        ]
        return ("\n".join(lines) + "\n").encode()

    def _finish(self) -> None:
        """Put the number of points into the header."""
        text = self._text(self._begun({}))
        self._staged.file.seek(0)
        self._staged.file.write(text)


def _comments(header: CloudHeader) -> Iterator[str]:
    """Name, reference system, epoch, facts and descriptions of fields as lines of ASCII."""
    pairs = {"name": header.name}
    if header.crs is not None:
        pairs["crs"] = str(CRS.from_user_input(header.crs).to_wkt())
    if header.epoch is not None:
        pairs["epoch"] = repr(float(header.epoch))
    pairs |= {key: value for key, value in header.facts.items() if key not in pairs}
    pairs |= {f"field {f.name}": f.description for f in header.fields if f.description}
    for key, value in pairs.items():
        plain = re.sub(r"\s", " ", str(value)).encode("ascii", "backslashreplace").decode()
        bare = re.sub(r"\s+|:", " ", key).encode("ascii", "backslashreplace").decode()
        for at in range(0, max(len(plain), 1), _VALUE):
            yield f"comment {bare}: {plain[at : at + _VALUE]}"
