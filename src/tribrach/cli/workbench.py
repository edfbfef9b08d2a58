"""The command workbench: a project in a page of this machine, where it can be worked on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.io.keeping import keeping
from tribrach.shell.flow import (
    NoBrowser,
    PagePort,
    ShownClouds,
    ShownEpochs,
    guarded,
    say,
    shown,
)


def workbench(
    project: Annotated[Path, typer.Argument(help="The project file (TOML).")],
    clouds: ShownClouds = None,
    epochs: ShownEpochs = None,
    port: PagePort = 0,
    no_browser: NoBrowser = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the address alone.")] = False,
) -> None:
    """Work on a project in the browser: switch observations off, see at once what moves."""

    def work() -> None:
        from tribrach.workbench.opening import open_in_browser
        from tribrach.workbench.service import Service
        from tribrach.workbench.session import Session

        # what is read to open the project may be replaced later: decisions, results of a run
        with shown(quiet) as progress, keeping():
            session = Session.open(project, progress)
        folder = session.project.results
        open_in_browser(
            lambda scratch: Service(folder, session, scratch, clouds or (), epochs),
            folder,
            port,
            no_browser,
            say,
        )

    guarded(work)
