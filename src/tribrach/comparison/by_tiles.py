"""Normals and distances along them (M3C2) of clouds that are cut into tiles.

Every core point belongs to the tile that it lies in, and all that its normal and its cylinder need
lies within a margin of that tile. So each tile is compared for itself, in the memory of one, and
the results are put back in the order of the core points. Metres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

from tribrach._types import Array, Index, Progress
from tribrach.cloud.placement import Placement
from tribrach.comparison.cloud_parts import Source, whole
from tribrach.comparison.core_points import Normals, core_normals
from tribrach.comparison.m3c2 import M3C2, M3C2Settings, checked_core, m3c2
from tribrach.comparison.m3c2_ep import M3C2EP, m3c2_ep
from tribrach.comparison.predicted import with_random
from tribrach.comparison.station_pair import StationPair
from tribrach.comparison.tiles import Tile, Tiles
from tribrach.tasks.engine import HERE, Call, Engine

R = TypeVar("R")

#: areas of the beams of both clouds on the surface [m^2] at the core points
Beams = tuple[Array, Array]


def _nothing(what: str, done: int, total: int | None) -> None:
    """Progress that nobody hears."""


def tile_normals(
    cut: Tiles,
    core: Array,
    settings: M3C2Settings,
    *,
    engine: Engine = HERE,
    progress: Progress = _nothing,
) -> Normals:
    """Normals at core points from the reference."""
    checked_core(core)

    def call(tile: Tile, rows: Index) -> tuple[Any, ...]:
        return tile, core[rows], settings

    return _each_tile(_normals, "normals", cut, core, call, engine, progress)


def tile_m3c2(
    cut: Tiles,
    core: Array,
    settings: M3C2Settings,
    normals: Normals,
    *,
    footprints: Beams | None = None,
    shares: tuple[float, float] = (1.0, 1.0),
    engine: Engine = HERE,
    progress: Progress = _nothing,
) -> M3C2:
    """Distances of the compared cloud from the reference at core points, as of :func:`m3c2`."""

    def call(tile: Tile, rows: Index) -> tuple[Any, ...]:
        return tile, core[rows], settings, _some(normals, rows), _beams(footprints, rows), shares

    return _each_tile(_distances, "distances along normals", cut, core, call, engine, progress)


def tile_m3c2_ep(
    cut: Tiles,
    core: Array,
    settings: M3C2Settings,
    normals: Normals,
    stations: StationPair,
    placements: tuple[Placement, Placement],
    *,
    incidence: bool = True,
    footprints: Beams | None = None,
    shares: tuple[float, float] = (1.0, 1.0),
    engine: Engine = HERE,
    progress: Progress = _nothing,
) -> M3C2EP:
    """The same with propagated uncertainty."""
    reach = _reach(settings)

    def call(tile: Tile, rows: Index) -> tuple[Any, ...]:
        # a point of a cylinder takes the normal of the nearest core point: one within two reaches
        near = tile.near(core, 2 * reach)
        surface = core[near], normals.vectors[near]
        one = (tile, core[rows], settings, _some(normals, rows), surface, stations)
        return *one, placements, incidence, _beams(footprints, rows), shares

    return _each_tile(_propagated, "distances with sigmas", cut, core, call, engine, progress)


def _each_tile(
    task: Callable[..., R],
    what: str,
    cut: Tiles,
    core: Array,
    call: Callable[[Tile, Index], tuple[Any, ...]],
    engine: Engine,
    progress: Progress,
) -> R:
    """Do a task for the core points of each tile and join its results in their order."""
    number = cut.numbers(core)
    order = np.argsort(number, kind="stable")
    rows = list(np.split(order, np.flatnonzero(np.diff(number[order])) + 1))
    calls = [
        Call(what, call(Tile(cut, int(number[some[0]])), some), cost=len(some)) for some in rows
    ]
    done, found = 0, {}
    for k, result in engine.completed(task, calls, progress):
        found[k], done = result, done + len(rows[k])
        progress(what, done, len(core))
    if len(rows) == 1:
        return found[0]
    joined: R = _joined([found[k] for k in range(len(rows))], rows)
    return joined


def _joined(several: Sequence[Any], rows: Sequence[Index]) -> Any:
    """One result of several: arrays row by row to where they belong, all else as in the first."""
    first = several[0]
    if isinstance(first, np.ndarray):
        out = np.empty((sum(len(some) for some in rows), *first.shape[1:]), dtype=first.dtype)
        for one, some in zip(several, rows, strict=True):
            out[some] = one
        return out
    if not is_dataclass(first) or isinstance(first, (type, M3C2Settings)):
        return first
    names = [field.name for field in fields(first)]
    columns = {name: _joined([getattr(one, name) for one in several], rows) for name in names}
    return type(first)(**columns)


def _some(normals: Normals, rows: Index) -> Normals:
    """Normals of some core points."""
    return Normals(**{f.name: getattr(normals, f.name)[rows] for f in fields(normals)})


def _beams(footprints: Beams | None, rows: Index) -> Beams | None:
    """Areas of some core points."""
    return None if footprints is None else (footprints[0][rows], footprints[1][rows])


def _reach(settings: M3C2Settings) -> float:
    """How far from its core point a point of a cylinder can be [m]."""
    return float(np.hypot(settings.diameter / 2, settings.depth))


def _first(tile: Tile, margin: float) -> Source:
    """The reference in and around a tile, read when it is asked for."""
    return lambda: whole(tile.reference(margin)[:, :3])()


def _second(tile: Tile, margin: float) -> Source:
    """The compared cloud in and around a tile, read when it is asked for."""
    return lambda: whole(tile.compared(margin)[:, :3])()


def _normals(tile: Tile, core: Array, settings: M3C2Settings, *, progress: Progress) -> Normals:
    """Normals of the core points of one tile."""
    return core_normals(
        _first(tile, max(settings.scales) / 2),
        core,
        settings.scales,
        scanner=settings.scanner,
        direction=settings.direction,
    )


def _distances(
    tile: Tile,
    core: Array,
    settings: M3C2Settings,
    normals: Normals,
    footprints: Beams | None,
    shares: tuple[float, float],
    *,
    progress: Progress,
) -> M3C2:
    """Distances at the core points of one tile."""
    reach = _reach(settings)
    one, two = _first(tile, reach), _second(tile, reach)
    return m3c2(one, two, core, settings, normals=normals, footprints=footprints, shares=shares)


def _propagated(
    tile: Tile,
    core: Array,
    settings: M3C2Settings,
    normals: Normals,
    surface: tuple[Array, Array],
    stations: StationPair,
    placements: tuple[Placement, Placement],
    incidence: bool,
    footprints: Beams | None,
    shares: tuple[float, float],
    *,
    progress: Progress,
) -> M3C2EP:
    """Distances with propagated uncertainty at the core points of one tile."""
    reach = _reach(settings)
    one, two = placements

    def side(read: Callable[[float], Array], where: Placement) -> Source:
        return with_random(lambda: _chunks(read(reach)), where, *surface, incidence=incidence)

    first, second = side(tile.reference, one), side(tile.compared, two)
    return m3c2_ep(
        first,
        second,
        core,
        settings,
        stations,
        normals=normals,
        footprints=footprints,
        shares=shares,
    )


def _chunks(rows: Array, most: int = 1_000_000) -> Sequence[Array]:
    """Rows in chunks, as covariances are wider than points."""
    return [rows[first : first + most] for first in range(0, len(rows), most)]
