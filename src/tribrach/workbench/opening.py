"""Opens a page of the workbench: listens, prints the address, starts the browser."""

from __future__ import annotations

import os
import threading
import webbrowser
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from tribrach.errors import InputError
from tribrach.scratch import scratch_folder
from tribrach.workbench.server import bound_socket, serve
from tribrach.workbench.service import Service
from tribrach.workbench.static_files import PAGE, page_files


def open_in_browser(
    make: Callable[[Path | None], Service],
    folder: Path,
    port: int,
    no_browser: bool,
    say: Callable[[str], None],
) -> None:
    """Serve a page until somebody presses Ctrl+C."""
    if PAGE not in page_files():
        raise InputError(
            "the page of the workbench is not in this installation",
            cure="install the program again, from a wheel or a whole checkout",
        )
    with ExitStack() as stack:
        scratch = None
        if folder.is_dir() and not os.access(folder, os.W_OK):
            scratch = stack.enter_context(scratch_folder())
        service = make(scratch)
        listening = stack.enter_context(bound_socket(port))

        def ready(address: str) -> None:
            say(address)
            if not no_browser:
                # some browsers come back only when they are closed
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

        serve(service, listening, ready)
