"""Two clouds in files against each other, site by site or as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from tribrach._types import Array, Progress
from tribrach.comparison.by_tiles import tile_m3c2, tile_m3c2_ep, tile_normals
from tribrach.comparison.c2c import C2C, tile_distances
from tribrach.comparison.cloud_parts import plain
from tribrach.comparison.core_points import core_points
from tribrach.comparison.footprints import beam_areas, shared_share
from tribrach.comparison.m3c2 import M3C2Settings
from tribrach.comparison.m3c2_ep import M3C2EP, by_scatter
from tribrach.comparison.predicted import OffsetTest, Prediction, compare_offsets, predict
from tribrach.comparison.results import WHOLE, M3C2Figures, SiteResult
from tribrach.comparison.sites import ComparisonSite, cut, seen_from
from tribrach.comparison.station_pair import StationPair
from tribrach.comparison.streams import Stream
from tribrach.comparison.tiles import TiledCloud, Tiles, tiles
from tribrach.errors import InputError
from tribrach.job.cloud_file import CloudFile, refuse_other_frames
from tribrach.scratch import scratch_folder
from tribrach.tasks.engine import HERE, Engine

Method = Literal["c2c", "m3c2", "both"]

#: takes the number of a site and its distances
Distances = Callable[[int, M3C2EP], None]
#: distances beyond are no differences of one surface [m]
LIMIT = 0.2
#: cylinders are this wide over the root of the area per point: 28 points, more than twenty
_CYLINDER = 6.0
#: neighbourhoods for normals over the width of cylinders, and over the roughness (Lague 2013)
_WIDER, _ROUGH = 2.0, 25.0


#: said where nothing tells how well the clouds lie on each other
_UNKNOWN = (
    "how well the clouds are registered is not known and not in the levels of detection: what one "
    "is shifted or turned by against the other counts as change; give it with --registration-mm "
    "and --registration-arcsec"
)


@dataclass(frozen=True)
class Registration:
    """How well clouds of others lie on each other: sigmas along any axis and about any axis."""

    shift: float = 0.0  #: [m]
    turn: float = 0.0  #: [rad]

    def along(self, places: Array) -> float:
        """Sigma [m] along a normal, in the mean over places (m, 3) about their middle."""
        arm = places - places.mean(axis=0)
        # a turn about any axis moves along a normal by two thirds of the square at most
        return float(np.sqrt(self.shift**2 + self.turn**2 * (arm**2).sum(axis=1).mean() * 2 / 3))

    def pair(self, places: Array) -> StationPair:
        """Two clouds of which the later lies so on the earlier, turned about the middle (m, 3)."""
        middle = places.mean(axis=0)
        square = np.repeat([0.0, self.shift**2, self.turn**2], [6, 3, 3])
        return StationPair(middle, middle, np.diag(square))


@dataclass(frozen=True)
class _Pair:
    """Streams of one site: A and B within the limit around it, with light; the site itself."""

    name: str
    around: Stream
    reference: Stream
    site: ComparisonSite | None


def compare_clouds(
    a: CloudFile,
    b: CloudFile,
    sites: Sequence[ComparisonSite] = (),
    *,
    method: Method = "both",
    limit: float = LIMIT,
    stations: StationPair | None = None,
    registration: Registration | None = None,
    incidence: bool = True,
    distances: Distances | None = None,
    engine: Engine = HERE,
    progress: Progress = lambda what, done, total: None,
) -> list[SiteResult]:
    """Compare cloud A with B, the reference, on every site, or as a whole without sites.

    limit [m] : up to which distance points and surfaces belong together; stations : of B, then of
    A, with their joint covariance, for predictions where both clouds have placements with noise;
    registration : of clouds whose stations are not known; incidence : does the predicted noise of
    ranges grow with the incidence angle?; distances : called with the number of each site and its
    distances with propagated uncertainty; engine : who compares the tiles of large clouds; progress
    : called with what is done, points so far and in all.
    """
    refuse_other_frames(a, b)
    work = _Work(
        a, b, method, limit, stations, registration, incidence, distances, engine, progress
    )
    pairs = _pairs(a, b, sites, limit, progress)
    results = [work.compare(number, pair) for number, pair in enumerate(pairs)]
    if not any(r.c2c is not None and r.c2c.n for r in results):
        raise InputError(
            f"no point of {a.path.name} is within {limit:g} m of {b.path.name}"
            + (" on any site" if sites else ""),
            file=a.path,
            cure="check that both are in one frame, or give a larger limit",
        )
    return results if method != "m3c2" else [replace(r, c2c=None) for r in results]


def offset_test(results: Sequence[SiteResult], stations: StationPair | None) -> OffsetTest | None:
    """The offsets of all sites against the joint covariance; None without any prediction."""
    known = [site.prediction for site in results if site.prediction is not None]
    return None if stations is None else compare_offsets(known, stations)


def _pairs(
    a: CloudFile,
    b: CloudFile,
    sites: Sequence[ComparisonSite],
    limit: float,
    progress: Progress,
) -> Iterator[_Pair]:
    """The points of every site; each cloud is read once for all sites."""
    if not sites:
        yield _Pair(WHOLE, a.lit, b.lit, None)
        return
    with scratch_folder() as scratch:
        spools = []
        for side, cloud in (("a", a), ("b", b)):
            folder = scratch / side
            folder.mkdir()
            told = partial(_tell, progress, f"sites of {cloud.path.name}", cloud.records)
            spools.append(cut(cloud.lit, sites, folder, limit, told, cloud.columns))
        for number, site in enumerate(sites):
            around, reference = (spool.stream(number) for spool in spools)
            yield _Pair(site.name, around, reference, site)


def _tell(progress: Progress, what: str, total: int | None, done: int) -> None:
    """Progress with the number of points last."""
    progress(what, done, total)


def _middle(site: ComparisonSite | None, places: Array) -> tuple[float, float, float] | None:
    """Middle of a site, or of the compared places (n, 3) if there are no sites."""
    if site is None and not len(places):
        return None
    x, y, z = (site.center if site is not None else places.mean(axis=0)).tolist()
    return x, y, z


@dataclass(frozen=True)
class _Work:
    """Settings and inputs that all sites share."""

    a: CloudFile
    b: CloudFile
    method: Method
    limit: float
    stations: StationPair | None
    registration: Registration | None
    incidence: bool
    distances: Distances | None
    engine: Engine
    progress: Progress

    def compare(self, number: int, pair: _Pair) -> SiteResult:
        """One site."""
        clouds = {"A": self.a, "B": self.b}

        def told(which: str, points: int) -> None:
            # those of sites were told of when they were cut out
            if pair.site is None:
                cloud = clouds[which]
                self.progress(f"reading {cloud.path.name}", points, cloud.records)

        with tiles(pair.around, pair.reference, self.limit, site=pair.site, progress=told) as cut:
            # points in memory do not travel
            work = self if cut.on_disk else replace(self, engine=HERE)
            return work._compared(number, pair, cut)

    def _compared(self, number: int, pair: _Pair, cut: Tiles) -> SiteResult:
        """One site whose clouds are cut into tiles."""
        a, b = self.a, self.b
        c2c = tile_distances(
            cut,
            self.limit,
            viewpoint=a.scanner if b.scanner is None else b.scanner,
            what=f"distances on {pair.name}",
            engine=self.engine,
            progress=self.progress,
        )
        seen = [
            None if cloud.scanner is None else seen_from(cloud.scanner, c2c.places, c2c.normals)
            for cloud in (a, b)
        ]
        n = c2c.tally.count + c2c.tally.beyond
        middle = _middle(pair.site, c2c.places)
        result = SiteResult(pair.name, n, seen[0], seen[1], c2c.beside(None), center=middle)
        if self.method == "c2c" or c2c.pitch_a is None or c2c.pitch_b is None:
            return result
        along, prediction = self._along_normals(number, cut, c2c)
        nearest = c2c.beside(along.changed)
        result = replace(result, c2c=nearest, m3c2=along, prediction=prediction)
        if prediction is None:
            return result
        lights = (_mean_light(cloud) for cloud in (cut.compared, cut.reference))
        light_a, light_b = lights
        return replace(result, light_a=light_a, light_b=light_b)

    def _along_normals(
        self, number: int, cut: Tiles, c2c: C2C
    ) -> tuple[M3C2Figures, Prediction | None]:
        """M3C2 from B to A, and with propagated uncertainty where the stations are known."""
        settings = self._settings(c2c)
        core = core_points(plain(cut.queries), settings.diameter, origin=cut.origin)
        normals = tile_normals(cut, core, settings, engine=self.engine, progress=self.progress)
        one, two, stations = self.b.placement, self.a.placement, self.stations
        if one is None or two is None or stations is None:
            known = self.registration
            if known is not None:
                settings = replace(settings, registration=known.along(core))
            found = tile_m3c2(
                cut, core, settings, normals, engine=self.engine, progress=self.progress
            )
            if self.distances is not None and known is not None:
                self.distances(number, by_scatter(found, known.pair(core)))
            figures = M3C2Figures.of(found)
            unknown = (_UNKNOWN,) if known is None and stations is None else ()
            return replace(figures, notes=(*figures.notes, *unknown)), None
        along = partial(tile_m3c2, cut, core, settings, normals, engine=self.engine)
        beams = (
            beam_areas(core, normals.vectors, one),
            beam_areas(core, normals.vectors, two),
        )
        shares = shared_share(one), shared_share(two)
        plainly = along(footprints=beams, shares=shares, progress=self.progress)
        propagated = tile_m3c2_ep(
            cut,
            core,
            settings,
            normals,
            stations,
            (one, two),
            incidence=self.incidence,
            footprints=beams,
            shares=shares,
            engine=self.engine,
            progress=self.progress,
        )
        if self.distances is not None:
            self.distances(number, propagated)
        return M3C2Figures.of(plainly), predict(propagated, stations, settings.diameter)

    def _settings(self, c2c: C2C) -> M3C2Settings:
        """Cylinders for the coarser pitch, normals for it and for the roughness."""
        assert c2c.pitch_a is not None
        assert c2c.pitch_b is not None
        area = max(p.across * p.up for p in (c2c.pitch_a, c2c.pitch_b))
        cylinder = _CYLINDER * float(np.sqrt(area))
        rough = 0.0 if c2c.local_plane is None else c2c.local_plane.std / np.sqrt(2)
        scanner = self.b.scanner
        return M3C2Settings(
            scales=(max(_WIDER * cylinder, _ROUGH * rough),),
            diameter=cylinder,
            depth=self.limit,
            scanner=scanner,
            direction=None if scanner is not None else _facing(c2c.normals),
        )


def _mean_light(cloud: TiledCloud) -> float | None:
    """Mean intensity of the points of a cloud, None where it has none."""
    if cloud.columns == 3:
        return None
    total, count = 0.0, 0
    for number in range(len(cloud.blocks)):
        for rows in cloud.stream(number):
            known = rows[np.isfinite(rows[:, 3]), 3]
            total, count = total + float(known.sum()), count + len(known)
    return total / count if count else None


def _facing(normals: Array) -> Array:
    """The direction (3,) along which most of the normals (n, 3) lie, either way."""
    known = normals[np.isfinite(normals[:, 0])]
    direction = np.linalg.eigh(known.T @ known)[1][:, -1]
    facing: Array = direction * np.sign(direction[np.argmax(np.abs(direction))])
    return facing
