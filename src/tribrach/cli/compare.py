"""The command compare: two clouds against each other, with the floor beside every figure."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from tribrach.comparison.peer_exports import alignment
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.io.json_text import json_text
from tribrach.io.outputs import write_texts
from tribrach.io.site_table import read_sites
from tribrach.job.cloud_file import one_run, open_cloud, station_pair
from tribrach.job.compare import LIMIT, Method, compare_clouds, offset_test
from tribrach.job.distance_cloud import DistanceCloud
from tribrach.job.motions import MotionCollector
from tribrach.report.characters import visible
from tribrach.report.comparison import (
    comparison_page,
    comparison_sentences,
    comparison_tables,
)
from tribrach.report.motions import motions_part, motions_sentences, motions_tables
from tribrach.report.names import told_apart
from tribrach.report.schema.base import document_text
from tribrach.report.schema.comparison import comparison_document
from tribrach.shell.flow import Overwrite, Quiet, Scheduler, Workers, claim, guarded, shown, working
from tribrach.shell.printing import printed

__all__ = ["compare"]

_UNKNOWN = "the stations of the clouds are not known with their covariance"
_GIVE = "give clouds as runs wrote them, each with its poses.json and poses_covariance.npy"
#: terminals with as many columns show all columns of the tables
_WIDE = 118


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="The compared cloud.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="The reference.")],
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
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with map and histogram.")
    ] = None,
    alignment_file: Annotated[
        Path | None,
        typer.Option(
            "--alignment",
            help="Write what A's station is uncertain by for py4dgeo's M3C2-EP.",
        ),
    ] = None,
    distances_file: Annotated[
        Path | None,
        typer.Option(
            "--distances",
            help="Write distances with sigma and level of detection as a cloud (.laz, .ply).",
        ),
    ] = None,
    what_moved: Annotated[
        bool,
        typer.Option(
            "--moved",
            help="Say what moved from B to A as rigid parts, what is stable, what cannot be told.",
        ),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Compare two clouds, on test sites or as a whole, with the sampling floor beside."""

    def work() -> None:
        inputs = [path for path in (a, b, sites_file, poses) if path is not None]
        outputs = (json_file, html_file, alignment_file, distances_file)
        claim(inputs, outputs, overwrite=overwrite)
        sites = [] if sites_file is None else read_sites(sites_file)
        one, two = open_cloud(a, poses), open_cloud(b, poses)
        pair = station_pair(two, one)
        with ExitStack() as stack:
            sink, moving = None, None
            if distances_file is not None:
                _predictable(pair, a, method)
                sink = stack.enter_context(DistanceCloud(distances_file, one, two))
            if what_moved:
                moving = MotionCollector(_predictable(pair, a, method))
            progress = stack.enter_context(shown(quiet))
            engine = stack.enter_context(working(workers, scheduler))
            result = compare_clouds(
                one,
                two,
                sites,
                method=method,
                limit=limit_m,
                stations=pair,
                distances=sink if moving is None else moving,
                engine=engine,
                progress=progress,
            )
            motions = None
            if moving is not None:
                one_result = one_run(one, two)
                motions = moving.motions(
                    two, result, sites, one_result=one_result, progress=progress
                )
                if sink is not None:
                    sink.with_parts(moving, motions)
        offsets = offset_test(result, pair)
        texts = {}
        if json_file is not None:
            part = None if motions is None else motions_part(motions)
            document = comparison_document(a.name, b.name, limit_m, result, offsets, part)
            texts[json_file] = document_text(document)
        if html_file is not None:
            names = told_apart(a, b)
            texts[html_file] = comparison_page(*names, limit_m, result, offsets, motions)
        if alignment_file is not None:
            texts[alignment_file] = _alignment(pair, a)
        write_texts(texts)
        if quiet:
            return
        console = Console()
        tables = comparison_tables(result, moved=motions is not None)
        if motions is not None:
            # the question that was asked comes first
            for sentence in motions_sentences(motions):
                console.print(visible(sentence), markup=False)
            tables = [*motions_tables(motions), *tables]
        for table in tables:
            fitting = table if console.width >= _WIDE else table.narrow()
            console.print(printed(fitting, console.width))
        beams = [f"{sentence}." for cloud in (one, two) for sentence in cloud.sentences]
        notes = comparison_sentences(result, offsets, moved=motions is not None)
        for sentence in (*beams, *notes):
            console.print(visible(f"! {sentence}"), markup=False)

    guarded(work)


def _predictable(pair: StationPair | None, a: Path, method: Method) -> StationPair:
    """The stations of both clouds, where distances along normals can have sigmas.

    Raises
    ------
    InputError
        The stations are not known with their covariance, or nearest points alone are wanted.
    """
    if method == "c2c":
        raise InputError(
            "distances with sigmas are those along normals", cure="leave --method c2c out"
        )
    if pair is None:
        raise InputError(_UNKNOWN, file=a, cure=_GIVE)
    return pair


def _alignment(pair: StationPair | None, a: Path) -> str:
    """Uncertainty of the second station against the first, about the middle of both, for py4dgeo.

    Raises
    ------
    InputError
        The stations are not known with their covariance.
    """
    if pair is None:
        raise InputError(_UNKNOWN, file=a, cure=_GIVE)
    found = alignment(pair, (pair.first + pair.second) / 2)
    return json_text({name: value.tolist() for name, value in found.arguments.items()}) + "\n"
