"""Distances between two clouds as a cloud of their own: one point for each core point.

Every point has its distance, its sigma with the part of the points and that of both stations, the
level of detection and whether the distance is beyond it (method section 9.3), so that programs that
show clouds show what moved and what could not have been seen. Where motions were found, it also
says whether it is in the stable area, and in which part.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader, CloudWriter
from tribrach.job.cloud_file import CloudFile
from tribrach.questions.compare.motions import CloudMotions, MotionCollector
from tribrach.scan.scan import Field

#: coordinate step of core points on disk [m]
_STEP = 1e-4

#: formats with room for what every distance has
_SUFFIXES = (".laz", ".las", ".ply")

_FIELDS = (
    Field("distance", "float32", description="A minus B along the normal, m"),
    Field("sigma", "float32", description="of the distance, m"),
    Field("sigma_points", "float32", description="its part from points, m"),
    Field("sigma_stations", "float32", description="its part from stations, m"),
    Field("lod95", "float32", description="1.96 sigma, m"),
    Field("significant", "uint8", description="1 where beyond lod95"),
    Field("points_a", "uint32", description="points of A in the cylinder"),
    Field("points_b", "uint32", description="points of B in the cylinder"),
    Field("site", "uint16", description="number of the site, from 1"),
    Field("nx", "float32", description="normal of B"),
    Field("ny", "float32", description="normal of B"),
    Field("nz", "float32", description="normal of B"),
)
#: parts that the header of the file tells of, which has room for 64 kB
_TOLD = 200
#: what a place is part of
_MEMBERSHIP = (
    Field("stable", "uint8", description="1 in the stable area"),
    Field("part", "uint16", description="number of the part, 0 none"),
)


class DistanceCloud:
    """Writes the distances of site after site into one cloud; nothing is left after an error."""

    def __init__(self, path: Path, a: CloudFile, b: CloudFile) -> None:
        if not path.name.lower().endswith(_SUFFIXES):
            raise InputError(
                "distances are written as a cloud with dimensions of its own",
                file=path,
                cure=f"give a name that ends with {', '.join(_SUFFIXES)}",
            )
        self._path, self._a, self._b = path, a, b
        self._writer: CloudWriter | None = None
        self._fields: tuple[Field, ...] = _FIELDS
        self._facts: dict[str, str] = {}

    def with_parts(self, collector: MotionCollector, motions: CloudMotions) -> None:
        """Write the distances of all sites, each with its stable area and its part."""
        self._fields = (*_FIELDS, *_MEMBERSHIP)
        parts = [f"{k} ({p.name}): {p.verdict}" for k, p in enumerate(motions.parts, start=1)]
        more = ["more in the report"] if len(parts) > _TOLD else []
        self._facts = {"parts": "; ".join([*parts[:_TOLD], *more]) or "none"}
        for number, found, stable, part in collector.labelled(motions.places):
            self._write(number, found, {"stable": stable, "part": part})

    def __call__(self, number: int, found: M3C2EP) -> None:
        """Write the distances of a site."""
        self._write(number, found, {})

    def _write(
        self, number: int, found: M3C2EP, membership: Mapping[str, NDArray[np.generic]]
    ) -> None:
        """Write a site with what each core point (m,) is part of."""
        rows = found.usable & np.isfinite(found.distance) & np.isfinite(found.sigma)
        core, normals = found.core[rows], found.normals.vectors[rows]
        if not len(core):
            return
        if self._writer is None:
            self._writer = self._begun(np.floor(core.min(axis=0))).__enter__()
        values = {
            "distance": found.distance[rows],
            "sigma": found.sigma[rows],
            "sigma_points": found.sigma_random[rows],
            "sigma_stations": found.sigma_registration[rows],
            "lod95": found.lod95_quadratic[rows],
            "significant": found.significant[rows],
            "points_a": found.second.count[rows],
            "points_b": found.first.count[rows],
            "site": np.full(len(core), number + 1),
            "nx": normals[:, 0],
            "ny": normals[:, 1],
            "nz": normals[:, 2],
            **{name: values[rows] for name, values in membership.items()},
        }
        types = {field.name: field.dtype for field in self._fields}
        self._writer.write(core, {name: v.astype(types[name]) for name, v in values.items()})

    def _begun(self, offset: Array) -> CloudWriter:
        """The file, its coordinates relative to an offset (3,) [m]."""
        facts = {
            "a": self._a.path.name,
            "b": self._b.path.name,
            "distance": "A minus B along the normal of B, positive towards the scanner of B",
            "level": "95 %, points and stations propagated (M3C2-EP)",
            **self._facts,
        }
        header = CloudHeader(
            self._path.stem, self._fields, step=_STEP, offset=offset, crs=self._b.crs, facts=facts
        )
        return create(self._path, header)

    def __enter__(self) -> Self:
        """The writer itself; the file is begun with its first points."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the file, or remove it after an error."""
        if self._writer is not None:
            self._writer.__exit__(kind, error, trace)
        elif kind is None:
            raise InputError(
                "there are no distances along normals to write",
                file=self._path,
                cure="give larger sites, a larger limit, or denser clouds",
            )
