"""The command export: a result for offices, or a network for another program to check this one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

import typer

from tribrach.errors import InputError
from tribrach.io.delivery.names import (
    FORMATS,
    TEMPLATE,
    DeliveryFormat,
    DeliveryOptions,
    refuse_missing,
)
from tribrach.io.outputs import write_bytes, write_texts
from tribrach.io.survey.exported import export as exported
from tribrach.io.survey.formats import read_files
from tribrach.job.opened import open_job
from tribrach.network.network import Network
from tribrach.network.survey import observed_part
from tribrach.questions.adjust.command import project_of
from tribrach.sentences import capital
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown

if TYPE_CHECKING:
    from tribrach.io.delivery.content import Delivery

NetworkFormat = Literal["gkf", "dynaml", "jsonl", "starnet"]
#: suffixes of the files
_SUFFIX = {"gkf": ".gkf", "dynaml": ".xml", "jsonl": ".jsonl", "starnet": ".dat"}
_SUFFIX |= {name: suffix for name, (suffix, _, _) in FORMATS.items()}


def export(
    files: Annotated[
        list[Path],
        typer.Argument(help="Networks, as adjust takes them, a toml, or a result (JSON, folder)."),
    ],
    to: Annotated[
        Literal[NetworkFormat, DeliveryFormat],
        typer.Option(
            "--to",
            help="Networks: GNU Gama (gkf), DynAdjust (dynaml, jsonl), STAR*NET. Results: dxf, "
            "landxml, gpkg, geojson, kml, xlsx, csv, or a list after a template.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The file; beside the first input if not given."),
    ] = None,
    partial: Annotated[
        bool, typer.Option("--partial", help="Leave out what the format cannot hold.")
    ] = False,
    scale: Annotated[
        float | None,
        typer.Option(min=1, max=1e7, help="Of a drawing, 500 for 1:500; else what fits a sheet."),
    ] = None,
    template: Annotated[
        str, typer.Option(help="Line of a list, such as '{point:>8} {easting_m:12.4f}'.")
    ] = TEMPLATE,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write a result for an office, or a network for another program."""

    def deliver() -> None:
        # what draws and what adjusts takes its time, which networks should not spend
        from tribrach.io.delivery.formats import delivered, read_delivery

        refuse_missing(to)
        path = _beside(files[0], _SUFFIX[to]) if out is None else out
        claim(files, {f"--to {to}": path}, overwrite=overwrite)
        result = read_delivery(files[0]) if _is_result(files) else _adjusted(files, quiet)
        write_bytes(path, delivered(result, to, DeliveryOptions(scale, template)))
        if not quiet:
            count = len(result.positions)
            say(f"{path}: {count} position{'' if count == 1 else 's'}")

    def work() -> None:
        if to in get_args(DeliveryFormat):
            deliver()
            return
        path = _beside(files[0], _SUFFIX[to]) if out is None else out
        claim(files, {f"--to {to}": path}, overwrite=overwrite)
        result = exported(_network(files, quiet), to)
        claim(files, {f"--to {to}": result.files(path)}, overwrite=overwrite)
        if result.lost and not partial:
            raise InputError(
                f"{to} cannot hold all of this network: {'; '.join(result.lost)}",
                cure="give --partial to write the rest, which is another network",
            )
        written = write_texts(result.files(path))
        if quiet:
            return
        one = result.written == 1
        names = ", ".join(map(str, written))
        say(f"{names}: {result.written} observation{'' if one else 's'}")
        for sentence in (*result.lost, *result.notes):
            say(f"! {capital(sentence)}.")

    guarded(work)


def _is_result(files: list[Path]) -> bool:
    """True for one folder of results or one JSON file."""
    return len(files) == 1 and (files[0].is_dir() or files[0].suffix.lower() == ".json")


def _adjusted(files: list[Path], quiet: bool) -> Delivery:
    """Content to deliver from files or a project, adjusted as ``adjust`` does."""
    from tribrach.io.delivery.content import delivered_network
    from tribrach.questions.adjust.adjusted import adjust_job
    from tribrach.report.json_result import network
    from tribrach.solution import AdjustmentSettings, adjust_network

    project = project_of(files)
    if project is None:
        read = observed_part(read_files(files)).network()
        return delivered_network(network(adjust_network(read, AdjustmentSettings())))
    with shown(quiet) as progress:
        return delivered_network(network(adjust_job(open_job(project, progress))))


def _network(files: list[Path], quiet: bool) -> Network:
    """The network of the files, or of a project, as adjust has it."""
    project = project_of(files)
    if project is None:
        return observed_part(read_files(files)).network()
    with shown(quiet) as progress:
        return open_job(project, progress).network()


def _beside(path: Path, suffix: str) -> Path:
    """A name beside an input that is not its own."""
    path = path / "result.json" if path.is_dir() else path
    other = path.with_suffix(suffix)
    return other if other != path else path.with_name(f"{path.stem}-export{suffix}")
