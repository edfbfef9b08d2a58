"""The command compare: two clouds against each other, with the floor beside every figure."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.comparison.peer_exports import alignment
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.io.json_text import json_text
from tribrach.io.models.formats import is_model
from tribrach.io.site_table import read_sites
from tribrach.job.cloud_file import one_run, open_cloud, seen_at, station_pair
from tribrach.job.compare import LIMIT, Method, Registration, compare_clouds, offset_test
from tribrach.questions.compare.chapters import ComparedClouds, answer_of
from tribrach.questions.compare.design import Designing, compare_design
from tribrach.questions.compare.distance_cloud import DistanceCloud
from tribrach.questions.compare.motions import MotionCollector
from tribrach.questions.compare.moved import told_motions
from tribrach.report.answer import Answer
from tribrach.report.names import told_apart
from tribrach.sentences import stopped
from tribrach.shell.command import WRITTEN, command
from tribrach.tasks.engine import Engine
from tribrach.units import MM, SEC

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
    moving = MotionCollector(_known(pair, a)) if what_moved else None
    motions = None
    with ExitStack() as stack:
        sink = None
        if distances_file is not None:
            _known(pair, a)
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


def _known(pair: StationPair | None, a: Path) -> StationPair:
    """The stations of both clouds."""
    if pair is None:
        raise InputError(
            "the stations of the clouds are not known with their covariance",
            file=a,
            cure="give clouds as runs wrote them, each with its poses.json and "
            "poses_covariance.npy",
        )
    return pair


def _alignment(pair: StationPair) -> str:
    """Uncertainty of the second station against the first, about the middle of both."""
    found = alignment(pair, (pair.first + pair.second) / 2)
    return json_text({name: value.tolist() for name, value in found.arguments.items()}) + "\n"
