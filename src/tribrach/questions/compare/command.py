"""The command compare: two clouds against each other, with the floor beside every figure."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Annotated, Self

import numpy as np
import typer
from numpy.typing import NDArray

from tribrach._types import Array, Progress
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.peer_exports import alignment
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader, CloudWriter
from tribrach.io.json_text import json_text
from tribrach.io.models.formats import is_model
from tribrach.io.site_table import read_sites
from tribrach.job.cloud_file import CloudFile, one_run, open_cloud, seen_at, station_pair
from tribrach.job.compare import LIMIT, Method, Registration, compare_clouds, offset_test
from tribrach.questions.compare.chapters import ComparedClouds, answer_of
from tribrach.questions.compare.design import Designing, compare_design
from tribrach.questions.compare.motions import CloudMotions, MotionCollector
from tribrach.questions.compare.moved import told_motions
from tribrach.report.answer import Answer
from tribrach.report.names import told_apart
from tribrach.scan.scan import Field
from tribrach.sentences import stopped
from tribrach.shell.command import WRITTEN, command
from tribrach.tasks.engine import Engine
from tribrach.units import MM, SEC

# Every point has its distance, its sigma with the part of the points and that of both stations, the
# level of detection and whether the distance is beyond it (method section 9.3), so that programs
# that show clouds show what moved and what could not have been seen. Where motions were found, it
# also says whether it is in the stable area, and in which part.

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


#: B is a cloud
_CLOUDS = Designing()


@command(html="Write a page with map and histogram.", scans=True)
def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="The compared cloud.")],
    b: Annotated[
        Path, typer.Argument(metavar="B", help="The reference, or a model of what was meant.")
    ],
    sites_file: Annotated[
        Path | None,
        typer.Option("--sites", help="Test sites as CSV: name,x,y,z,radius or name,xmin,...,zmax."),
    ] = None,
    method: Annotated[
        Method, typer.Option(help="Nearest points, along normals, or both.")
    ] = "both",
    poses: Annotated[
        Path | None,
        typer.Option(help="The poses.json of the clouds; else the one in their folder."),
    ] = None,
    limit_m: Annotated[
        float, typer.Option(min=1e-4, max=100, help="Longest distance that is compared in metres.")
    ] = LIMIT,
    registration_mm: Annotated[
        float,
        typer.Option(min=0, help="Sigma of a shift between clouds without poses.json."),
    ] = 0.0,
    registration_arcsec: Annotated[
        float, typer.Option(min=0, help="The same, a turn about the middle of what is compared.")
    ] = 0.0,
    origin: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the scanner of clouds that do not say it stood, in metres."),
    ] = None,
    alignment_file: Annotated[
        Path | None,
        typer.Option(
            "--alignment",
            help="Write what A's station is uncertain by for py4dgeo's M3C2-EP.",
        ),
        WRITTEN,
    ] = None,
    distances_file: Annotated[
        Path | None,
        typer.Option(
            "--distances",
            help="Write distances with sigma and level of detection as a cloud (.laz, .ply).",
        ),
        WRITTEN,
    ] = None,
    what_moved: Annotated[
        bool,
        typer.Option(
            "--moved",
            help="Say what moved from B to A as rigid parts, what is stable, what cannot be told.",
        ),
    ] = False,
    designing: Designing = _CLOUDS,
    *,
    engine: Engine,
    progress: Progress,
) -> Answer:
    """Compare two clouds, on test sites or as a whole, with the sampling floor beside."""
    given = registration_mm > 0 or registration_arcsec > 0
    stated = Registration(registration_mm * MM, registration_arcsec * SEC) if given else None
    if is_model(b):
        _refuse_for_models(b, sites_file, alignment_file, what_moved, method)
        cloud = open_cloud(a, poses)
        _refuse_stated(stated, cloud.placement)
        return compare_design(
            cloud,
            b,
            designing,
            limit=limit_m,
            registration=stated,
            distances=distances_file,
            progress=progress,
        )
    designing.refuse_clouds(b)
    sites = [] if sites_file is None else read_sites(sites_file)
    one, two = (seen_at(open_cloud(path, poses), origin) for path in (a, b))
    pair = station_pair(two, one)
    _refuse_stated(stated, pair)
    if method == "c2c" and (what_moved or distances_file is not None):
        raise InputError(
            "distances with sigmas are those along normals", cure="leave --method c2c out"
        )
    seen = tuple(cloud.scanner for cloud in (two, one) if cloud.scanner is not None)
    moving = MotionCollector(stated or _known(pair, a, _OR), seen) if what_moved else None
    motions = None
    with ExitStack() as stack:
        sink = None
        if distances_file is not None:
            stated or _known(pair, a, _OR)
            sink = stack.enter_context(DistanceCloud(distances_file, one, two))
        found = compare_clouds(
            one,
            two,
            sites,
            method=method,
            limit=limit_m,
            stations=pair,
            registration=stated,
            distances=sink if moving is None else moving,
            engine=engine,
            progress=progress,
        )
        if moving is not None:
            motions = moving.motions(
                two, found, sites, one_result=one_run(one, two), progress=progress
            )
            if sink is not None:
                sink.with_parts(moving, motions)
    compared = ComparedClouds(
        a.name,
        b.name,
        limit_m,
        tuple(found),
        offset_test(found, pair),
        None if motions is None else told_motions(motions),
    )
    files = {} if alignment_file is None else {alignment_file: _alignment(_known(pair, a))}
    beams = [stopped(sentence) for cloud in (one, two) for sentence in cloud.sentences]
    return answer_of(told_apart(a, b), compared, beams, files)


def _refuse_stated(stated: Registration | None, known: object) -> None:
    """Refuse a stated registration of what poses.json knows."""
    if stated is not None and known is not None:
        raise InputError(
            "the registration of these clouds is known by their poses.json",
            cure="leave --registration-mm and --registration-arcsec out",
        )


def _refuse_for_models(
    b: Path, sites: Path | None, alignment: Path | None, moved: bool, method: Method
) -> None:
    """Refuse options of two clouds where B is a model."""
    for option, asked in (
        ("--sites", sites is not None),
        ("--alignment", alignment is not None),
        ("--moved", moved),
        ("--method", method != "both"),
    ):
        if asked:
            raise InputError(
                f"{option} is of two clouds, and B is a model", file=b, cure="leave it out"
            )


#: what tells of clouds of others how they lie
_OR = ", or say --registration-mm and --registration-arcsec"


def _known(pair: StationPair | None, a: Path, more: str = "") -> StationPair:
    """The stations of both clouds; ``more``: what else would do."""
    if pair is None:
        raise InputError(
            "the stations of the clouds are not known with their covariance",
            file=a,
            cure="give clouds as runs wrote them, each with its poses.json and "
            f"poses_covariance.npy{more}",
        )
    return pair


def _alignment(pair: StationPair) -> str:
    """Uncertainty of the second station against the first, about the middle of both."""
    found = alignment(pair, (pair.first + pair.second) / 2)
    return json_text({name: value.tolist() for name, value in found.arguments.items()}) + "\n"
