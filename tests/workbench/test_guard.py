"""Who is let in: every probe here is one that local servers were bitten by."""

import asyncio
from collections.abc import Iterator

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Route
from starlette.testclient import TestClient

from tribrach.workbench.guard import LARGEST_BODY, Guard

PORT = 8770
HERE = f"http://127.0.0.1:{PORT}"


async def _echo(request: Request) -> JSONResponse:
    return JSONResponse({"path": request.url.path, "size": len(await request.body())})


@pytest.fixture
def guard() -> Guard:
    routes = [Route("/{path:path}", _echo, methods=["GET", "POST"])]
    return Guard(Starlette(routes=routes), PORT)


@pytest.fixture
def stranger(guard: Guard) -> Iterator[TestClient]:
    with TestClient(guard, base_url=HERE, follow_redirects=False) as client:
        yield client


@pytest.fixture
def person(guard: Guard, stranger: TestClient) -> TestClient:
    answer = stranger.get(guard.address)
    assert answer.status_code == 303
    return stranger


def test_nobody_without_the_cookie(stranger: TestClient, guard: Guard) -> None:
    for path in ("/", "/scene.json", "/clouds/S1.copc.laz", "/?token=wrong", "/?token="):
        assert stranger.get(path).status_code == 403
    assert stranger.post("/api/edits", json={}).status_code == 403
    # the token is none of the cookie, and belongs to the first page alone
    cookie = {"cookie": f"{guard.cookie}={guard.token}"}
    assert stranger.get("/", headers=cookie).status_code == 403
    assert stranger.get(f"/scene.json?token={guard.token}").status_code == 403


def test_the_printed_address_gives_a_cookie_that_nobody_reads(
    stranger: TestClient, guard: Guard
) -> None:
    answer = stranger.get(guard.address)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/"
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith(f"tribrach-{PORT}=")
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(cookie.split("; "))
    assert guard.token not in cookie
    assert stranger.get("/scene.json").json()["path"] == "/scene.json"


def test_another_server_of_the_machine_has_another_cookie(person: TestClient) -> None:
    other = Guard(Starlette(), PORT + 1)
    with TestClient(other, base_url=f"http://127.0.0.1:{PORT + 1}") as client:
        client.cookies = person.cookies
        assert client.get("/").status_code == 403


@pytest.mark.parametrize(
    "host",
    ["evil.example:8770", "127.0.0.1", "127.0.0.1:8771", "127.0.0.1.evil.example:8770",
     "localhost.evil:8770", "[::1]:8770", "", "127.0.0.1:8770@evil.example"],
)  # fmt: skip
def test_another_host_is_another_server(person: TestClient, host: str) -> None:
    """A name that somebody points at 127.0.0.1 (DNS rebinding)."""
    assert person.get("/", headers={"host": host}).status_code == 421


@pytest.mark.parametrize(
    "origin",
    ["https://evil.example", "null", f"{HERE}.evil.example", f"https://127.0.0.1:{PORT}",
     "http://127.0.0.1:8771", f"http://localhost:{PORT}", f"{HERE}/"],
)  # fmt: skip
def test_pages_of_other_origins_are_refused(person: TestClient, origin: str) -> None:
    """The last but one is ours, under a name that was not asked for."""
    for ask in (person.get, lambda p, **k: person.post(p, json={}, **k)):
        assert ask("/api/edits", headers={"origin": origin}).status_code == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_requests_that_another_site_began_are_refused(person: TestClient, site: str) -> None:
    assert person.get("/", headers={"sec-fetch-site": site}).status_code == 403
    own = {"sec-fetch-site": "same-origin", "origin": HERE}
    assert person.post("/api/edits", json={}, headers=own).status_code == 200


def test_forms_and_strange_methods_are_refused(person: TestClient) -> None:
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
        answer = person.post("/api/edits", content=b"{}", headers={"content-type": kind})
        assert answer.status_code == 415
    assert person.post("/api/edits", content=b"{}").status_code == 415
    kind = {"content-type": "application/json; charset=utf-8"}
    assert person.post("/api/edits", content=b"{}", headers=kind).json()["size"] == 2
    for method in ("PUT", "DELETE", "OPTIONS", "PATCH", "TRACE"):
        assert person.request(method, "/").status_code == 405


def test_bodies_are_bounded_whatever_they_say(person: TestClient) -> None:
    kind = {"content-type": "application/json"}
    whole = b" " * LARGEST_BODY
    assert person.post("/x", content=whole, headers=kind).json()["size"] == LARGEST_BODY
    assert person.post("/x", content=whole + b" ", headers=kind).status_code == 413

    def pieces() -> Iterator[bytes]:
        for _ in range(20):
            yield b" " * (LARGEST_BODY // 10)

    assert person.post("/x", content=pieces(), headers=kind).status_code == 413
    lying = {**kind, "content-length": "x"}
    assert person.post("/x", content=b"{}", headers=lying).status_code == 413


def test_every_answer_is_armoured(person: TestClient, stranger: TestClient) -> None:
    answers = [
        person.get("/scene.json"),
        person.get("/", headers={"host": "evil.example"}),
        person.post("/", content=b""),
    ]
    for answer in answers:
        policy = answer.headers["content-security-policy"]
        assert "default-src 'self'" in policy
        assert "script-src 'self' 'wasm-unsafe-eval'" in policy
        assert "unsafe-inline" not in policy
        assert "'unsafe-eval'" not in policy.replace("'wasm-unsafe-eval'", "")
        assert "frame-ancestors 'none'" in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "no-referrer"
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"
        assert answer.headers["cross-origin-embedder-policy"] == "require-corp"
        assert not any(name.startswith("access-control") for name in answer.headers)


def test_doubled_headers_are_refused(guard: Guard, person: TestClient) -> None:
    """Two hosts or origins: servers and browsers may take different ones."""
    cookie = "; ".join(f"{k}={v}" for k, v in person.cookies.items()).encode()
    host = (b"host", f"127.0.0.1:{PORT}".encode())
    evil = (b"host", b"evil.example"), (b"origin", b"http://evil.example")
    ours = (b"origin", HERE.encode())
    for headers in ([host, evil[0]], [host, ours, evil[1]], [host, evil[1], ours]):
        sent = []
        scope = {
            "type": "http", "method": "GET", "path": "/", "query_string": b"",
            "headers": [*headers, (b"cookie", cookie)],
        }  # fmt: skip

        async def send(message: dict, sent: list = sent) -> None:
            sent.append(message)

        asyncio.run(guard(scope, None, send))
        assert sent[0]["status"] in (403, 421)


def test_web_sockets_are_not_spoken(guard: Guard) -> None:
    async def nothing(message: dict) -> None:
        raise AssertionError("nothing is answered")

    asyncio.run(guard({"type": "websocket", "path": "/", "headers": []}, None, nothing))
