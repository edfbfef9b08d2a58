"""A browser, a page that is watched, and the program behind it."""

import contextlib
import functools
import http.server
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import uvicorn

from tribrach.workbench.guard import Guard
from tribrach.workbench.server import application, bound_socket
from tribrach.workbench.service import Service
from tribrach.workbench.session import Session

#: software drawing, so that it is the same everywhere; no sandbox for who is root in a container
FLAGS = [
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--no-sandbox",
    "--disable-dev-shm-usage",
]
#: seconds after which a page is said not to come; never waited for in vain
PATIENCE = 240.0
#: points that are drawn at most: software draws them
BUDGET = "budget=200000"


def executable() -> str:
    """The browser of the system; the test is skipped, or fails where one is demanded."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    if os.environ.get("TRIBRACH_NEEDS_BROWSER") == "1":
        pytest.fail("TRIBRACH_NEEDS_BROWSER=1, and no chromium is installed")
    pytest.skip("no chromium is installed")


def until(what: Callable[[], Any], words: str) -> Any:
    """The first true answer; waiting inside the page would need eval, which its policy forbids."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if answer := what():
            return answer
        time.sleep(0.1)
    raise AssertionError(f"waited {PATIENCE:.0f} s in vain: {words}")


class Watched:
    """A page, and everything that it should not do.

    Parameters
    ----------
    page
        Of playwright.
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self.errors: list[str] = []
        self.asked: list[str] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self._said)
        page.on("request", lambda request: self.asked.append(request.url))

    def _said(self, message: Any) -> None:
        # a static folder has no session and no views: the page asks, and that is how it knows
        if message.type == "error" and "404" not in message.text:
            self.errors.append(message.text)

    def open(self, url: str, settled: bool = True) -> "Watched":
        """Open an address and wait for the cloud."""
        self.host, token, rest = re.fullmatch(  # type: ignore[union-attr]
            r"(https?://[^/]+)/(?:\?token=([^&#]*)&?)?(.*)", url
        ).groups()
        if token:
            # who brings the token is sent on without it, and without what follows it
            assert self.page.context.request.get(f"{self.host}/?token={token}").ok
            rest = f"?{rest}" if rest and not rest.startswith("#") else rest
        self.page.goto(f"{self.host}/{rest}")
        until(lambda: self("!!(window.tribrach && tribrach.ready)"), "the page")
        if settled:
            self.settle()
        return self

    def settle(self) -> None:
        """Wait until nothing is being loaded and a frame has been drawn."""
        ready = (
            "(({points, loading, pending}) => points > 0 && !loading && !pending)(tribrach.counts)"
        )
        until(lambda: self(ready), "the cloud")
        frames = self("tribrach.counts.frames")
        self("tribrach.share()")
        until(lambda: self("tribrach.counts.frames") > frames, "a frame")

    def __call__(self, words: str) -> Any:
        """What an expression gives in the page."""
        return self.page.evaluate(words)

    def fine(self) -> None:
        """No error, and nothing asked of another host."""
        assert self.errors == []
        foreign = [url for url in self.asked if not url.startswith((self.host, "data:", "blob:"))]
        assert foreign == []


@contextlib.contextmanager
def program(*arguments: str | Path) -> Iterator[str]:
    """The address that a command of the program prints, for as long as it runs."""
    command = [sys.executable, "-m", "tribrach", *map(str, arguments), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            line = ""
            for line in process.stdout:
                if found := re.search(r"http://127\.0\.0\.1:\d+/\S*", line):
                    yield found[0]
                    break
            else:
                raise AssertionError(f"no address was printed; the last line: {line}")
        finally:
            process.send_signal(signal.SIGINT)
            process.stdout.read()
    assert process.returncode in (0, -signal.SIGINT)


@contextlib.contextmanager
def served(project: Path) -> Iterator[str]:
    """The address of a session in this process, whose parts a test may hold back."""
    session = Session.open(project, author="AB")
    service = Service(session.folder, session)
    with bound_socket(0) as listening:
        guard = Guard(application(service), listening.getsockname()[1])
        server = uvicorn.Server(
            uvicorn.Config(guard, log_level="error", ws="none", timeout_graceful_shutdown=1)
        )
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        try:
            until(lambda: server.started, "the server")
            yield guard.address
        finally:
            # who listens to events is told that it is over
            service.stop()
            server.should_exit = True
            thread.join(PATIENCE)


class _Plain(http.server.SimpleHTTPRequestHandler):
    """The server of Python's own: no ranges."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *words: Any) -> None:
        """Say nothing."""


class _Ranges(_Plain):
    """The same with ranges."""

    def do_GET(self) -> None:
        """Answer a range, or everything."""
        asked = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        path = Path(self.translate_path(self.path))
        if asked is None or not path.is_file():
            super().do_GET()
            return
        data = path.read_bytes()
        first, last = int(asked[1]), min(int(asked[2]), len(data) - 1)
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{last}/{len(data)}")
        self.send_header("Content-Length", str(last - first + 1))
        self.end_headers()
        self.wfile.write(data[first : last + 1])


@contextlib.contextmanager
def folder_server(folder: Path, ranges: bool) -> Iterator[str]:
    """A web server of a folder on this machine."""
    handler = functools.partial(_Ranges if ranges else _Plain, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()


def with_budget(address: str) -> str:
    """The address with few points."""
    return f"{address}{'&' if '?' in address else '?'}{BUDGET}"


def where(watched: Watched, xyz: str) -> tuple[float, float]:
    """Where a place of the work frame is in the window."""
    x, y, left, top = watched(
        f"(() => {{ const p = tribrach.onScreen({xyz});"
        " const r = document.querySelector('.picture').getBoundingClientRect();"
        " return [p[0], p[1], r.left, r.top]; })()"
    )
    return x + left, y + top


def decide(page: Watched, use: str) -> None:
    """Say what is done with the selected rows, with a reason."""
    page.page.click(f"dialog input[value={use}]")
    send = page.page.locator("dialog button[type=submit]")
    assert send.is_disabled()
    page.page.fill("dialog textarea", "field book, page 12")
    send.click()


def settled_tests(page: Watched, revision: int) -> None:
    """Wait for a state and its tests."""
    until(lambda: page(f"tribrach.session.revision >= {revision} && !tribrach.stale"), "the tests")
