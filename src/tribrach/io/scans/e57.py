"""E57: several scans in a file, each in its scanner frame with its pose, read in chunks.

Headers come from the XML section, points through libE57. Coordinates are Cartesian or range,
azimuth (counter-clockwise from x) and elevation (from the xy plane). Records that the file marks
as invalid, or that are no finite numbers, are dropped; so are points at exactly zero in scans with
a grid but without marks, which stand for no return. ``return_number`` counts from 1 (0 in the
file); values that the file flags as invalid are zero, intensities their low limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree
from numba import njit
from numpy.typing import NDArray
from pye57 import libe57

from tribrach.errors import InputError
from tribrach.io.e57_pages import CURE, child, damaged, parse, read_header, read_xml
from tribrach.io.scans.e57_columns import CARTESIAN, Column
from tribrach.io.scans.e57_header import (
    ScanHeader,
    crs_of,
    distance,
    scan_header,
    unique_names,
)
from tribrach.scan.scan import CHUNK, Chunk, Scan

__all__ = ["E57Scan", "read", "scan_elements", "xml_of"]

Array = NDArray[np.float64]

#: records that libE57 decodes at a time
_BLOCK = 50_000
#: points that are looked at to tell placed ones from others
_GLANCE = 1000


@dataclass(frozen=True)
class E57Scan(Scan):
    """One scan of an E57 file; ``columns`` are those besides the coordinates and their state."""

    coordinates: tuple[str, ...] = CARTESIAN
    state: str | None = None
    columns: tuple[Column, ...] = ()

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """The points in the file's order, a little under ``size`` if that is many blocks.

        Raises
        ------
        InputError : truncated or damaged, or fewer records than the header states.
        """
        records = self.records or 0
        if start >= records:
            return
        many = -(-min(size, records) // _BLOCK)
        block = min(size, records) // many
        with _damage(self.path):
            image = libe57.ImageFile(str(self.path), "r")
        try:
            buffers = _Buffers(self, image, block)
            with _damage(self.path):
                reader = image.root()["data3D"][self.index]["points"].reader(buffers.vector)
            done = 0
            while done < records:
                gathered = _Gathered(self, min(many * block, records - done))
                for _ in range(-(-gathered.size // block)):
                    count = self._read(reader, done)
                    done += count
                    if done > start:
                        gathered.add(buffers, max(count - done + start, 0), count)
                if done > start:
                    yield gathered.chunk()
            reader.close()
        finally:
            image.close()

    def _read(self, reader: Any, done: int) -> int:
        """Fill the buffers; the number of records."""
        with _damage(self.path):
            count = int(reader.read())
        if count == 0:
            raise InputError(
                f"the header states {self.records} points and the file holds {done}",
                file=self.path,
                record=self.name,
                cure=CURE,
            )
        return count


class _Gathered:
    """A chunk that grows block by block; blocks stay in the processor's cache."""

    def __init__(self, scan: E57Scan, size: int) -> None:
        self.scan, self.size, self.points, self.dropped = scan, size, 0, 0
        self.xyz = np.empty((size, 3))
        self.values = [np.empty(size, dtype=c.field.dtype) for c in scan.columns]

    def add(self, buffers: _Buffers, first: int, last: int) -> None:
        """Records first to last of the buffers, valid ones only."""
        scan, raw = self.scan, buffers.xyz[first:last]
        xyz = raw if scan.coordinates == CARTESIAN else _cartesian(raw)
        kept = _kept(xyz, buffers.state[first:last], scan.state is None and scan.grid is not None)
        some = len(kept) < len(xyz)
        to = slice(self.points, self.points + len(kept))
        if some:
            xyz.take(kept, axis=0, out=self.xyz[to], mode="clip")
        else:
            self.xyz[to] = xyz
        for column, whole, out in zip(scan.columns, buffers.values, self.values, strict=True):
            part, wrong = whole[first:last], buffers.flags.get(column.flag or "")
            wrong = None if wrong is None else wrong[first:last]
            if some:
                part, wrong = part.take(kept), None if wrong is None else wrong.take(kept)
            try:
                out[to] = column.values(part, wrong)
            except InputError as error:
                raise damaged(scan.path, error.what) from error
        self.points = to.stop
        self.dropped += len(xyz) - len(kept)

    def chunk(self) -> Chunk:
        """What was gathered."""
        names = (c.field.name for c in self.scan.columns)
        values = {n: v[: self.points] for n, v in zip(names, self.values, strict=True)}
        return Chunk(self.xyz[: self.points], values, self.dropped)


class _Buffers:
    """Arrays that libE57 fills again and again; they live as long as its reader."""

    def __init__(self, scan: E57Scan, image: Any, size: int) -> None:
        self.vector = libe57.VectorSourceDestBuffer()
        self.xyz = np.empty((size, 3))
        for k, path in enumerate(scan.coordinates):
            self._add(scan, image, path, self.xyz[:, k], stride=self.xyz.strides[0])
        self.state = np.zeros(size, dtype=np.int8)
        if scan.state is not None:
            self._add(scan, image, scan.state, self.state)
        self.values = [np.empty(size, dtype=np.dtype(c.buffer)) for c in scan.columns]
        for column, values in zip(scan.columns, self.values, strict=True):
            self._add(scan, image, column.path, values)
        by_path = {c.path: v for c, v in zip(scan.columns, self.values, strict=True)}
        self.flags = {c.flag: by_path[c.flag] for c in scan.columns if c.flag is not None}

    def _add(
        self, scan: E57Scan, image: Any, path: str, values: NDArray[Any], stride: int = 0
    ) -> None:
        stride = stride or values.itemsize
        with _damage(scan.path):
            self.vector.append(
                libe57.SourceDestBuffer(image, path, values, len(values), True, True, stride)
            )


@njit(cache=True, nogil=True)
def _kept(xyz, state, zeros):  # type: ignore[no-untyped-def]
    """Numbers of the records that hold a point; zeros : do coordinates of zero stand for none?"""
    out = np.empty(len(xyz), dtype=np.intp)
    count = 0
    for n in range(len(xyz)):
        x, y, z = xyz[n]
        if state[n] != 0 or not np.isfinite(x + y + z):
            continue
        if zeros and x == 0 and y == 0 and z == 0:
            continue
        out[count] = n
        count += 1
    return out[:count]


def _cartesian(polar: Array) -> Array:
    """Coordinates of range [m], azimuth and elevation [rad] (n, 3)."""
    r, azimuth, elevation = polar.T
    flat = r * np.cos(elevation)
    out = np.empty_like(polar)
    out[:, 0] = flat * np.cos(azimuth)
    out[:, 1] = flat * np.sin(azimuth)
    out[:, 2] = r * np.sin(elevation)
    return out


def read(path: Path) -> tuple[Scan, ...]:
    """All scans of a file.

    Raises
    ------
    InputError : no E57 file, truncated, damaged, or without scans.
    """
    root = xml_of(path)
    elements = scan_elements(root)
    if not elements:
        images = child(root, "images2D")
        besides = f" but {len(images)} images" if images is not None and len(images) else ""
        raise InputError(f"the file holds no scan{besides}", file=path, cure="give another file")
    crs, text = crs_of(root)
    scans: list[Scan] = []
    for k, (element, (name, said)) in enumerate(
        zip(elements, unique_names(elements, path), strict=True)
    ):
        header = scan_header(element, path, k)
        facts = header.facts | ({"coordinate metadata": text} if text and crs is None else {})
        scan = E57Scan(
            name=name,
            path=path,
            index=k,
            records=header.records,
            fields=tuple(c.field for c in header.columns),
            pose=header.pose,
            origin=header.origin,
            grid=header.grid,
            crs=crs,
            bounds=header.bounds if header.records else None,
            warnings=(*said, *header.warnings),
            facts=facts,
            coordinates=header.coordinates,
            state=header.state,
            columns=header.columns,
        )
        scans.append(_glanced(scan, header))
    return tuple(scans)


def xml_of(path: Path) -> etree._Element:
    """The root of the file's XML section.

    Raises
    ------
    InputError : it cannot be read, is no E57 file, is damaged.
    """
    try:
        with path.open("rb") as file:
            return parse(read_xml(file, read_header(file, path), path), path)
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error


def scan_elements(root: etree._Element) -> list[etree._Element]:
    """The children of ``data3D``, in order."""
    group = child(root, "data3D")
    return [] if group is None else [e for e in group if isinstance(e.tag, str)]


def _glanced(scan: E57Scan, header: ScanHeader) -> E57Scan:
    """Tell apart what stated bounds around the pose's position can mean.

    Some programs place the points and keep the pose; others place only the bounds.
    """
    if header.pose is None or scan.bounds is None or distance(scan.bounds, np.zeros(3)) <= 0:
        return scan
    if distance(scan.bounds, header.pose.translation) > 0:
        return scan
    first = next(scan.chunks(min(_GLANCE, header.records)))
    if len(first) and distance(scan.bounds, np.median(first.xyz, axis=0)) <= 0:
        said = "the points lie around the pose's position: they seem to be placed already"
        return replace(scan, origin="unknown", warnings=(*scan.warnings, said))
    said = "the stated bounds are not those of the points and are left out"
    return replace(scan, bounds=None, warnings=(*scan.warnings, said))


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """What libE57 raises, as a sentence."""
    try:
        yield
    except libe57.E57Exception as error:
        words = str(error).strip().splitlines()[0].split(" (Error")[0].rstrip(".")
        raise damaged(path, words) from error
    except (IndexError, KeyError, RuntimeError, ValueError) as error:
        raise damaged(path, str(error) or type(error).__name__) from error
