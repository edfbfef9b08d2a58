"""The server of the workbench: routes, events, and the loop that answers until it is stopped.

It serves one person at one machine, see :mod:`tribrach.workbench.guard`. What is computed is
computed in threads, so that a page is answered while something is adjusted.
"""

from __future__ import annotations

import asyncio
import json
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import uvicorn
from anyio.to_thread import run_sync
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from tribrach.errors import NO_TEXT, InputError, TribrachError
from tribrach.io.json_text import json_text
from tribrach.io.keeping import looking
from tribrach.workbench.guard import LOOPBACK, Guard
from tribrach.workbench.service import Declined, Service
from tribrach.workbench.static_files import PAGE, page_files
from tribrach.workbench.tables import TABLES, table_csv, table_json, table_of

T = TypeVar("T")
#: seconds after which a line is sent to who listens, so that a connection that broke is noticed
_PULSE = 15.0
#: events that wait for a listener who does not read; older ones are dropped
_WAITING = 1000
#: kinds of files that the system may have no name for
_KINDS = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".json": "application/json",
    ".txt": "text/plain; charset=utf-8",
    ".wasm": "application/wasm",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".webp": "image/webp",
    ".laz": "application/octet-stream",
}


def application(service: Service) -> Starlette:
    """Make the routes of a service; who serves them puts a guard before them."""
    pages = page_files()

    async def page(request: Request) -> Response:
        return _file(pages.get(PAGE))

    async def app_file(request: Request) -> Response:
        name = request.path_params["name"]
        return _file(pages.get(name) if name != PAGE else None)

    async def scene(request: Request) -> Response:
        text = await _looked(lambda: service.scene_text)
        return Response(text, media_type="application/json")

    async def cloud(request: Request) -> Response:
        return _file(await run_sync(service.cloud, request.path_params["name"]))

    async def picture(request: Request) -> Response:
        return _file(await run_sync(service.picture, request.path_params["name"]))

    async def table(request: Request) -> Response:
        name, kind = request.path_params["name"], request.path_params["kind"]
        if name not in TABLES or kind not in ("json", "csv"):
            return _missing()
        return await _looked(partial(_table, service, name, kind))

    async def events(request: Request) -> Response:
        return StreamingResponse(_events(service), media_type="text/event-stream")

    routes = [
        Route("/", page),
        Route("/app/{name}", app_file),
        Route("/scene.json", scene),
        Route("/clouds/{name}", cloud),
        Route("/pictures/{name}", picture),
        Route("/tables/{name}.{kind}", table),
        Route("/api/events", events),
        Route("/api/session", _answering(service.state)),
        Route("/api/what-if", _answering(service.what_if, "observation")),
        Route("/api/relative", _answering(service.relative, "a", "b")),
        Route("/api/point", _answering(service.point, "cloud", "x", "y", "z")),
        Route("/api/compare", _answering(service.compare, "a", "b")),
        Route("/api/views", _answering(service.views)),
        *(
            Route(f"/api/{name}", _taking(work), methods=["POST"])
            for name, work in {
                "edits": service.edit,
                "undo": service.undo,
                "redo": service.redo,
                "save": service.save,
                "run": service.run,
                "cancel": service.cancel,
                "views": service.keep_view,
            }.items()
        ),
    ]

    @asynccontextmanager
    async def living(app: Starlette) -> AsyncIterator[None]:
        service.start()
        try:
            yield
        finally:
            service.stop()

    return Starlette(routes=routes, lifespan=living)


def _file(path: Path | None) -> Response:
    """A file with its ranges, or that there is none."""
    if path is None or not path.is_file():
        return _missing()
    kind = _KINDS.get(path.suffix.lower(), "application/octet-stream")
    # what was built or converted is asked for again by its date: the same file is not sent twice
    return FileResponse(path, media_type=kind, headers={"cache-control": "no-cache"})


def _missing() -> Response:
    return JSONResponse({"sentence": "There is no such thing here."}, status_code=404)


def _json(content: Any, status: int = 200) -> Response:
    """Content as strict JSON; NaN and infinity become null."""
    return Response(json_text(content), status_code=status, media_type="application/json")


def _table(service: Service, name: str, kind: str) -> Response:
    columns = table_of(service.scene, name)
    if kind == "json":
        return Response(table_json(columns), media_type="application/json")
    named = {"content-disposition": f'attachment; filename="{name}.csv"'}
    return Response(table_csv(columns), media_type="text/csv; charset=utf-8", headers=named)


def _answering(work: Callable[..., Any], *names: str) -> Callable[[Request], Any]:
    """A route that asks for something by values of its query."""

    async def answer(request: Request) -> Response:
        values = [request.query_params.get(name) for name in names]
        lacking = [name for name, value in zip(names, values, strict=True) if value is None]
        if lacking:
            return _json({"sentence": f"Say {' and '.join(lacking)}."}, 422)
        return await _done(partial(work, *values))

    return answer


def _taking(work: Callable[[Mapping[str, Any]], Any]) -> Callable[[Request], Any]:
    """A route that is given an object of JSON."""

    async def answer(request: Request) -> Response:
        try:
            given = json.loads(await request.body() or b"{}")
        except (ValueError, RecursionError):
            return _json({"sentence": "This is no JSON."}, 422)
        if not isinstance(given, dict):
            return _json({"sentence": "Send an object."}, 422)
        if (bad := _unwritable(given)) is not None:
            return _json({"sentence": f"A text holds {bad}, which no file can hold."}, 422)
        return await _done(partial(work, given))

    return answer


def _unwritable(value: Any) -> str | None:
    """A character among texts that no text holds; None if there is none."""
    left = [value]
    while left:
        one = left.pop()
        if isinstance(one, dict):
            left += [*one, *one.values()]
        elif isinstance(one, list):
            left += one
        elif isinstance(one, str) and (found := NO_TEXT.search(one)):
            return ascii(found.group())
    return None


async def _done(work: Callable[[], Any]) -> Response:
    """What some work gives, in a thread; what it refuses, in its words."""
    try:
        return _json(await _looked(work))
    except Declined as refused:
        return _json(refused.content, refused.status)
    except (InputError, TribrachError) as error:
        return _json({"sentence": str(error)}, 422)


async def _looked(work: Callable[[], T]) -> T:
    """What some work gives, in a thread; what it reads may be replaced by a run."""

    def look() -> T:
        with looking():
            return work()

    return await run_sync(look)


async def _events(service: Service) -> AsyncIterator[str]:
    """Events as they come, each an event of the page."""
    loop = asyncio.get_running_loop()
    waiting: asyncio.Queue[str] = asyncio.Queue(_WAITING)

    def put(line: str) -> None:
        if waiting.full():
            waiting.get_nowait()
        waiting.put_nowait(line)

    def listener(event: str, content: Mapping[str, Any]) -> None:
        line = f"event: {event}\ndata: {json_text(content)}\n\n"
        if not loop.is_closed():
            loop.call_soon_threadsafe(put, line)

    leave = service.listen(listener)
    try:
        yield ": here\n\n"
        while not service.stopped:
            try:
                yield await asyncio.wait_for(waiting.get(), _PULSE)
            except TimeoutError:
                yield ": still here\n\n"
    finally:
        leave()


def bound_socket(port: int) -> socket.socket:
    """A socket on the loopback."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        listening.close()
        raise InputError(
            f"port {port} of this machine cannot be listened on ({error})",
            cure="take another one with --port, or leave it out",
        ) from error
    return listening


def serve(service: Service, listening: socket.socket, ready: Callable[[str], None]) -> None:
    """Answer until somebody presses Ctrl+C."""
    guard = Guard(application(service), listening.getsockname()[1])

    class _Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready(guard.address)

        @contextmanager
        def capture_signals(self) -> Iterator[None]:
            # these are the ways to end it: what called it goes on afterwards
            asked = (signal.SIGINT, signal.SIGTERM)
            before = {number: signal.signal(number, self.handle_exit) for number in asked}
            try:
                yield
            finally:
                for number, handler in before.items():
                    signal.signal(number, handler)

        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            # who listens to events would keep the server waiting
            service.stop()
            await super().shutdown(sockets)

    # no log of requests: the first of them shows the token
    config = uvicorn.Config(
        guard,
        log_level="error",
        access_log=False,
        server_header=False,
        date_header=False,
        lifespan="on",
        ws="none",
        timeout_graceful_shutdown=1,
    )
    try:
        _Server(config).run(sockets=[listening])
    finally:
        service.stop()
