"""Samples the surface of a scan: some hundred points with normals, without reading it all.

Blocks of consecutive records, spread over the scan; in each some points with the normal of their
neighbours in the block. Scanner frame, metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.scan.scan import Chunk, Scan

#: blocks, records in each, and points that are taken from it
_BLOCKS, _RECORDS, _POINTS = 5, 100_000, 300
#: neighbours that a normal is taken from
_NEIGHBOURS = 32
#: a neighbourhood that is thicker than this share of its width has no normal
_THICK = 0.3


@dataclass(frozen=True)
class SurfaceSample:
    """Points of a scan and how the surface lies there."""

    xyz: Array  #: (n, 3), points [m]
    normals: Array  #: (n, 3), unit normals towards the scanner, NaN where unknown
    intensity: Array | None = None  #: (n,), intensities as in the file; None if it has none


def surface_sample(scan: Scan) -> SurfaceSample:
    """Take about 1500 points of a scan, with normals.

    Of a scan whose header does not state the number of its points the first 500,000 are looked at.
    """
    xyz, normals, light = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)]
    for chunk in _blocks(scan):
        block = chunk.xyz
        chosen = np.unique(np.linspace(0, len(block) - 1, _POINTS).astype(np.int64))
        far = chosen[np.linalg.norm(block[chosen], axis=1) > 0]
        xyz.append(block[far])
        normals.append(_normals(block, far))
        if "intensity" in chunk.values:
            light.append(chunk.values["intensity"][far].astype(np.float64))
    points, seen = np.concatenate(xyz), np.concatenate(light)
    return SurfaceSample(
        points, np.concatenate(normals), seen if len(seen) == len(points) else None
    )


def _blocks(scan: Scan) -> Iterator[Chunk]:
    """Blocks of consecutive points, those without points left out."""
    if scan.records is None or scan.records <= _BLOCKS * _RECORDS:
        for number, chunk in enumerate(scan.chunks(_RECORDS)):
            if number == _BLOCKS:
                return
            if len(chunk):
                yield chunk
        return
    for start in np.linspace(0, scan.records - _RECORDS, _BLOCKS).astype(int):
        chunk = next(scan.chunks(_RECORDS, start=int(start)))
        if len(chunk):
            yield chunk


def _normals(block: Array, chosen: NDArray[np.int64]) -> Array:
    """Direction of least spread of the neighbours of chosen points (k,), towards the scanner."""
    if len(block) <= _NEIGHBOURS:
        return np.full((len(chosen), 3), np.nan)
    points = block[chosen]
    _, near = KDTree(np.ascontiguousarray(block)).query(points, k=_NEIGHBOURS)
    around = block[near.astype(np.int64)]
    around = around - around.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    normal: Array = vectors[:, :, 0]
    normal = np.where((np.einsum("ni,ni->n", normal, points) > 0)[:, None], -normal, normal)
    normal[values[:, 0] > _THICK * values[:, 1]] = np.nan
    return normal
