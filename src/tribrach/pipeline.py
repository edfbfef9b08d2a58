"""From a project to signed figures: the page to read first; every verb is a module."""

from __future__ import annotations

from pathlib import Path

from tribrach._types import Progress
from tribrach.io.keeping import keeping
from tribrach.io.logo import read_logo
from tribrach.job.opened import open_job
from tribrach.job.steps import Standing, compare, find, georeference, name_and_tie
from tribrach.progress import watched
from tribrach.project import Project
from tribrach.questions.adjust.adjusted import left_by, solved
from tribrach.questions.run.folder import leaving, refuse_reports, renew_findings, write
from tribrach.report.content import Report
from tribrach.report.summary import sigma_origin
from tribrach.solution import AdjustmentSettings, report
from tribrach.tasks.engine import HERE, Engine


def run(
    project: Project | str | Path,
    folder: str | Path | None = None,
    progress: Progress | None = None,
    *,
    overwrite: bool = False,
    engine: Engine = HERE,
) -> Report:
    """Run a project and leave its results in a folder.

    Parameters
    ----------
    project : Project or path
        What is measured and what is wanted of it.
    folder : path, optional
        Of the results, the project's own if not given; only what an earlier run wrote is replaced.
    progress : callable, optional
        Told of long steps: ``progress(what, done, total)``, the total None where nobody knows it.
    overwrite : bool
        Files of other programs with the name of a result are replaced; those that are read never.
    engine : Engine
        Who works on the scans, this process if not given; see :mod:`tribrach.tasks.cluster`.

    Returns
    -------
    Report
        The report; ``report.adjustment`` is what was adjusted.

    Raises
    ------
    InputError
        What the project or a file says wrong; a result that would take the place of another file.
    AdjustmentError
        The network cannot be adjusted.
    """
    project = project if isinstance(project, Project) else Project.load(project)
    folder = project.results if folder is None else Path(folder)
    kept = keeping(
        project.inputs(), folder, overwrite=overwrite, command="run", kind=project.file_name
    )
    with kept, watched(progress) as told:
        refuse_reports(folder, project.output)
        settings, logo = AdjustmentSettings.of(project), read_logo(project.logo)
        job = open_job(project, told)
        found = find(job, folder, told, engine, writes=True) if project.scans else None
        with leaving(job, found, folder):
            tied = None if found is None else name_and_tie(job, found, told)
            survey, solution = solved(job, settings, tied)
        results = left_by(job, survey, solution, settings, logo)
        if tied is not None:
            origin = sigma_origin(solution.adjustment, settings.posterior, solution.components)
            standing = Standing.of(job, tied, solution.adjustment)
            placed = georeference(job, standing, folder, origin, told)
            results = results.of_scans(tied.registered, placed, compare(standing, told))
        content = report(solution, settings, project.facts, results)
        write(content, folder)
        renew_findings(found, folder)
    return content
