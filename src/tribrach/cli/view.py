"""The command view: the results of a run in a page of this machine, or as a folder for a server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.shell.flow import (
    NoBrowser,
    Overwrite,
    PagePort,
    ShownClouds,
    ShownEpochs,
    guarded,
    say,
    shown,
)


def view(
    folder: Annotated[Path, typer.Argument(help="The folder of results of a run.")],
    export: Annotated[
        Path | None,
        typer.Option(
            "--export", help="Write the page and its data into this folder for any web server."
        ),
    ] = None,
    clouds: ShownClouds = None,
    epochs: ShownEpochs = None,
    port: PagePort = 0,
    no_browser: NoBrowser = False,
    overwrite: Overwrite = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the address alone.")] = False,
) -> None:
    """Look at results: clouds with their sigmas, the network, its tests, in the browser."""

    def work() -> None:
        further = clouds or ()
        if export is not None:
            # only who exports needs what converts clouds before anything is shown
            from tribrach.workbench.export import export_page

            with shown(quiet) as progress:
                written = export_page(
                    folder, export, progress, overwrite=overwrite, further=further, epochs=epochs
                )
            if not quiet:
                say(f"{export}: {written} files; serve it with python -m http.server -d {export}")
            return
        from tribrach.workbench.opening import open_in_browser
        from tribrach.workbench.service import Service

        open_in_browser(
            lambda scratch: Service(folder, scratch=scratch, further=further, epochs=epochs),
            folder,
            port,
            no_browser,
            say,
        )

    guarded(work)
