"""The command adjust: files of networks, or a project without scans.

What only projects, pages and JSON need is loaded for them, since loading all of it takes several
times as long as adjusting a network of some points.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tribrach._types import Progress
from tribrach.io.survey.formats import read_files
from tribrach.network.survey import observed_part
from tribrach.report.network_answer import NetworkAnswer
from tribrach.shell.command import WRITTEN, command
from tribrach.shell.settings import Adjusting
from tribrach.solution import AdjustmentSettings, adjust_network

if TYPE_CHECKING:
    from tribrach.project import Project


@command(
    json="Write the result as JSON.", html="Write the HTML report.", text="Write the text report."
)
def adjust(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Raw files of total stations, tables, vectors, networks of GNU Gama, STAR*NET, "
            "DynAdjust, Comp3D or RiSCAN PRO; or a project."
        ),
    ],
    adjusting: Adjusting,
    epoch_file: Annotated[
        Path | None,
        typer.Option("--epoch", help="Write an epoch: coordinates, joint covariance."),
        WRITTEN,
    ] = None,
    *,
    progress: Progress,
) -> NetworkAnswer:
    """Adjust a network from files of any known format, or a project without scans.

    What a project says is done; an option that is given takes its place.
    """
    other = adjusting.other_datum
    project = project_of(files)
    if project is not None:
        from tribrach.job.opened import open_job
        from tribrach.questions.adjust.adjusted import adjust_job

        settings = replace(AdjustmentSettings.of(project), **adjusting.given)
        content = adjust_job(open_job(project, progress), settings, other)
    else:
        network = observed_part(read_files(files)).network()
        network = network if other is None else network.with_datum(other)
        content = adjust_network(network, AdjustmentSettings(**adjusting.given))
    if epoch_file is None:
        return NetworkAnswer.of(content)
    from tribrach.questions.epochs.from_files import epoch_text

    return NetworkAnswer.of(content, {epoch_file: epoch_text(content.adjustment, files[0].stem)})


def project_of(files: list[Path]) -> Project | None:
    """The project if its file is given and nothing else."""
    if len(files) != 1 or files[0].suffix.lower() != ".toml":
        return None
    from tribrach.project import Project
    from tribrach.questions.adjust.adjusted import refuse_scans

    project = Project.load(files[0])
    refuse_scans(project)
    return project
