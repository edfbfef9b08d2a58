"""Keeps everybody but the person at this machine away from the server.

It listens on the loopback only, which a web page that is open in the same browser can reach as
well, and so can every other user of the machine. Therefore each request has to show a cookie that
only the address printed by the command gives, its ``Host`` and ``Origin`` have to be this server
and nothing else (a name that somebody points at 127.0.0.1 is another host), and no answer allows
another origin to read it. Pages may load what this server has, and no more.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Iterable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: the only address that is listened on
LOOPBACK = "127.0.0.1"
#: bytes that a request may bring along
LARGEST_BODY = 1_000_000
#: name of the query that shows the token
_TOKEN = "token"
_POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self' 'wasm-unsafe-eval'",
        "style-src 'self'",
        "worker-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
_HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-embedder-policy": "require-corp",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), usb=(), serial=()",
}
#: what may be asked for without the body of a request
_READING = ("GET", "HEAD")
_NO_ENTRY = "Open the address that the command printed; it lets this browser in."


class Guard:
    """Lets requests through to an application that come from a page of this very server."""

    def __init__(self, app: ASGIApp, port: int) -> None:
        self._app = app
        #: the secret of the printed address
        self.token = secrets.token_urlsafe(32)
        #: cookies are shared by all ports of a host, so its name has the port
        self.cookie = f"tribrach-{port}"
        self._session = secrets.token_urlsafe(32)
        self._hosts = frozenset(f"{host}:{port}" for host in (LOOPBACK, "localhost"))
        self._origins = frozenset(f"http://{host}" for host in self._hosts)
        self._address = f"http://{LOOPBACK}:{port}/"

    @property
    def address(self) -> str:
        """The address that lets a browser in; it belongs into no file that others read."""
        return f"{self._address}?{_TOKEN}={self.token}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # nobody speaks web sockets here
        headers = _headers(scope)
        refused = self._refused(scope, headers)
        if refused is not None:
            await _answer(send, *refused)
            return
        entering = self._entering(scope)
        if entering is not None:
            await _answer(send, *entering)
            return
        if not self._known(headers):
            await _answer(send, 403, _NO_ENTRY)
            return
        if scope["method"] not in _READING:
            body = await _body(receive, headers)
            if body is None:
                await _answer(send, 413, f"A request has at most {LARGEST_BODY} bytes.")
                return
            receive = _replayed(body, receive)
        await self._app(scope, receive, _armoured(send))

    def _refused(self, scope: Scope, headers: Mapping[str, list[str]]) -> tuple[int, str] | None:
        """Status and sentence for a request that is none of this server's."""
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 421, "This server answers to its own address only."
        if any(origin not in self._origins for origin in origins) or len(origins) > 1:
            return 403, "Pages of other origins are not answered."
        if origins and origins[0] != f"http://{hosts[0]}":
            return 403, "Pages of other origins are not answered."
        site = headers.get("sec-fetch-site", ["none"])
        if site not in (["same-origin"], ["none"]) and self._shown(scope) is None:
            return 403, "Pages of other origins are not answered."
        if scope["method"] == "POST":
            kinds = headers.get("content-type", [])
            if len(kinds) != 1 or kinds[0].partition(";")[0].strip() != "application/json":
                return 415, "Send application/json."
        elif scope["method"] not in _READING:
            return 405, "Ask with GET, HEAD or POST."
        return None

    def _shown(self, scope: Scope) -> str | None:
        """The token that a request shows, None if it shows none."""
        if scope["path"] != "/" or scope["method"] not in _READING:
            return None
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get(_TOKEN)
        return None if not given or len(given) != 1 else given[0]

    def _entering(self, scope: Scope) -> tuple[int, str, dict[str, str]] | None:
        """The answer to whoever shows a token: the cookie, and an address without the token."""
        shown = self._shown(scope)
        if shown is None:
            return None
        if not hmac.compare_digest(shown.encode(), self.token.encode()):
            return 403, _NO_ENTRY, {}
        cookie = f"{self.cookie}={self._session}; Path=/; HttpOnly; SameSite=Strict"
        return 303, "", {"set-cookie": cookie, "location": "/"}

    def _known(self, headers: Mapping[str, list[str]]) -> bool:
        """Does a request show the cookie?"""
        for line in headers.get("cookie", []):
            jar = SimpleCookie()
            try:
                jar.load(line)
            except CookieError:
                continue
            crumb = jar.get(self.cookie)
            if crumb is not None and hmac.compare_digest(
                crumb.value.encode(), self._session.encode()
            ):
                return True
        return False


def _headers(scope: Scope) -> dict[str, list[str]]:
    """Values of the headers by their names in small letters."""
    out: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        out.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    return out


async def _body(receive: Receive, headers: Mapping[str, list[str]]) -> bytes | None:
    """The whole body of a request, None if it is too long."""
    told = headers.get("content-length", ["0"])[0]
    if not told.isdecimal() or int(told) > LARGEST_BODY:
        return None
    parts: list[bytes] = []
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return b""
        parts.append(message.get("body", b""))
        if sum(map(len, parts)) > LARGEST_BODY:
            return None
        if not message.get("more_body", False):
            return b"".join(parts)


def _replayed(body: bytes, receive: Receive) -> Receive:
    """What the application receives in the place of a body that was read already."""
    pending: list[MutableMapping[str, Any]] = [
        {"type": "http.request", "body": body, "more_body": False}
    ]

    async def replayed() -> Message:
        return pending.pop() if pending else await receive()

    return replayed


def _armoured(send: Send) -> Send:
    """Answers with the headers that keep browsers from doing more than they should."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = {name.decode("latin-1").lower() for name, _ in message.get("headers", [])}
            message = {**message, "headers": [*message.get("headers", []), *_armour(own)]}
        await send(message)

    return sent


def _armour(own: Iterable[str] = ()) -> list[tuple[bytes, bytes]]:
    """Those headers, but for the ones that an answer has already."""
    given = set(own)
    kept = {**_HEADERS, "cache-control": "no-store"}
    return [(k.encode(), v.encode()) for k, v in kept.items() if k not in given]


async def _answer(
    send: Send, status: int, text: str, headers: Mapping[str, str] | None = None
) -> None:
    """Send a short answer."""
    body = f"{text}\n".encode() if text else b""
    own = {"content-type": "text/plain; charset=utf-8", "content-length": str(len(body))}
    given = [(k.encode(), v.encode()) for k, v in {**own, **(headers or {})}.items()]
    await send({"type": "http.response.start", "status": status, "headers": given + _armour()})
    await send({"type": "http.response.body", "body": body})
