"""The web server of the live page and of the replay: our own files, one WebSocket, and nobody else's requests.

A page of another site must not steer: requests whose `Host` is not this server (DNS rebinding) or whose `Origin` is not
this page are refused, and a page may only load what lies here.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import ipaddress
import json
import logging
import socket
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from swashplate.errors import SwashError
from swashplate.links.live.connections import OneLine, Punctual
from swashplate.links.live.identifying import REPORT
from swashplate.links.live.messages import LONGEST, MessageError, parse
from swashplate.links.live.priority import come_first
from swashplate.links.live.session import LiveSession

UPDATES = 30.0
"""Updates of the page per second [Hz]."""
MOST_PAGES = 8
"""Connections at a time."""
MOST_BAD = 20
"""Messages of one connection that the schema refuses, before it is closed."""
PAGE = Path(__file__).parent / "page"
LIBRARIES: Mapping[str, str] = json.loads((Path(__file__).parent / "libraries.json").read_text(encoding="utf-8"))
"""SHA-256 of what `scripts/vendor_page.py` brings, by name."""
_LOG = logging.getLogger("swashplate.live")
_POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"
_HEADERS = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


def check_page() -> None:
    """That the page's libraries are here and are those that were pinned: they run in the pilot's browser.

    Raises:
        SwashError: saying how to get them.
    """
    files = {name: PAGE / "vendor" / name for name in LIBRARIES}
    missing = [name for name, path in files.items() if not path.is_file()]
    if missing:
        raise SwashError(
            f"lacks {', '.join(missing)}: this is a source checkout without the page's libraries.",
            where=PAGE / "vendor",
            hint="Run `python scripts/vendor_page.py` there (it needs Node's npm), or install a wheel.",
        )
    changed = [n for n, path in files.items() if hashlib.sha256(path.read_bytes()).hexdigest() != LIBRARIES[n]]
    if changed:
        raise SwashError(
            f"{', '.join(changed)}: not the library that was pinned (SHA-256 differs); the page is not served.",
            where=PAGE / "vendor",
            hint="Somebody or something changed it. Run `python scripts/vendor_page.py`, or install the wheel again.",
        )


def listen(host: str, port: int, *, allow_remote: bool) -> socket.socket:
    """A bound socket.

    Raises:
        SwashError: for an address beyond this machine without `allow_remote`, an unknown host, or a port in use.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise SwashError(f"'{host}' is no address of this machine.", channel="--host") from None
    address = ipaddress.ip_address(found[4][0])
    if not address.is_loopback and not allow_remote:
        raise SwashError(
            f"{address} can be reached from other machines.",
            channel="--host",
            hint="Whoever reaches the page can fly and record; if that is meant, add --allow-remote.",
        )
    made = socket.socket(found[0], socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(found[4])
        made.listen(64)
    except OSError as error:
        made.close()
        raise SwashError(
            f"port {port} of {host} cannot be had: {error.strerror or error}.",
            channel="--port",
            hint="Is another `swash live` running? --port 0 takes any free port.",
        ) from None
    return made


def address_of(listening: socket.socket) -> str:
    """The page's address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    if ipaddress.ip_address(host).is_unspecified:
        host = "127.0.0.1" if listening.family == socket.AF_INET else "::1"
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


class Guard:
    """Refuses requests that were meant for another host or come from another page (ASGI).

    Args:
        app: what is guarded.
        remote: whether other machines may ask; then addresses as numbers and this machine's name are hosts too. A name
            that an attacker's DNS made up is neither.
    """

    def __init__(self, app: ASGIApp, *, remote: bool) -> None:
        self._app, self._remote = app, remote

    def _ours(self, host: str) -> bool:
        name = urlsplit(f"//{host}").hostname or ""
        if name == "localhost":
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return self._remote and name == socket.gethostname().lower()
        return self._remote or address.is_loopback

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        host, origin = headers.get("host", ""), headers.get("origin")
        try:
            trusted = self._ours(host)
            if origin is not None or scope["type"] == "websocket":
                trusted = trusted and urlsplit(origin or "").netloc == host and (origin or "").startswith("http")
        except ValueError:
            trusted = False
        if trusted:

            async def with_headers(message: Message) -> None:
                if message["type"] == "http.response.start":
                    extra = [(name.encode(), value.encode()) for name, value in _HEADERS.items()]
                    message = {**message, "headers": [*message["headers"], *extra]}
                await send(message)

            await self._app(scope, receive, with_headers)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse("This server answers its own page only.\n", status_code=403)(scope, receive, send)


def _page(name: str) -> Callable[[Request], Response]:
    def answer(_: Request) -> Response:
        return FileResponse(PAGE / name, headers={"content-security-policy": _POLICY})

    return answer


def live_app(session: LiveSession, *, remote: bool = False) -> ASGIApp:
    """The live page, its socket, and the reports of its recordings."""
    pages: set[WebSocket] = set()
    steering: list[WebSocket] = []
    refused: set[str] = set()

    async def talk(socket_: WebSocket) -> None:
        if len(pages) >= MOST_PAGES:
            await socket_.close(code=1013, reason="too many pages")
            return
        await socket_.accept()
        pages.add(socket_)
        session.watched(len(pages))
        sending = asyncio.create_task(_tell(socket_, session))
        try:
            await hear(socket_)
        except WebSocketDisconnect:
            pass  # a page that is closed or lost is the ordinary end
        finally:
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await sending
            pages.discard(socket_)
            if steering == [socket_]:
                session.let_go()
            session.watched(len(pages))

    async def hear(socket_: WebSocket) -> None:
        bad = 0
        while True:
            try:
                message = parse(await socket_.receive_text())
                if message["type"] == "stick":
                    steering[:] = [socket_]
                await session.obey(message)
            except MessageError as error:
                bad += 1
                if error.problem not in refused:
                    refused.add(error.problem)
                    _LOG.warning("A page's message was refused: %s.", error.problem)
                if bad > MOST_BAD:
                    await socket_.close(code=1008, reason="messages that the schema refuses")
                    return
            except KeyError:  # bytes instead of text
                await socket_.close(code=1003, reason="text only")
                return
            except (SwashError, OSError) as error:
                session.notice = str(error)

    def report(request: Request) -> Response:
        path = session.identifying.out(request.path_params["number"]) / REPORT
        return FileResponse(path) if path.is_file() else PlainTextResponse("No such report.\n", status_code=404)

    routes = [
        Route("/", _page("live.html")),
        Route("/report/{number:int}", report),
        WebSocketRoute("/socket", talk),
        Mount("/page", StaticFiles(directory=PAGE)),
    ]
    return Guard(Starlette(routes=routes), remote=remote)


async def _tell(socket_: WebSocket, session: LiveSession) -> None:
    """Updates at their rate; a page that does not keep up gets fewer, and never a heap of old ones."""
    version, due = 0, time.monotonic()
    while True:
        if session.version != version:
            version = session.version
            await socket_.send_text(json.dumps(session.hello()))
        await socket_.send_text(json.dumps(session.moment(), separators=(",", ":")))
        due = max(due + 1.0 / UPDATES, time.monotonic() - 0.5 / UPDATES)
        await asyncio.sleep(max(0.0, due - time.monotonic()))


def replay_app(flight: dict[str, Any], *, remote: bool = False) -> ASGIApp:
    """The replay page of one flight."""
    routes = [
        Route("/", _page("replay.html")),
        Route("/flight", lambda _: JSONResponse(flight)),
        Mount("/page", StaticFiles(directory=PAGE)),
    ]
    return Guard(Starlette(routes=routes), remote=remote)


def configured(app: ASGIApp) -> uvicorn.Config:
    """How an app is served: what does not ask in time, or not in text, is let go."""
    made = uvicorn.Config(
        app,
        http=Punctual,
        log_level="warning",
        access_log=False,
        server_header=False,
        lifespan="off",
        ws="websockets-sansio",
        ws_max_size=4 * LONGEST,
        timeout_graceful_shutdown=2,
    )
    logging.getLogger("uvicorn.error").addFilter(OneLine())
    return made


def serve(app: ASGIApp, listening: socket.socket) -> None:
    """Serve until interrupted; an interrupt is the ordinary end."""
    config = configured(app)
    come_first()  # the interpreter's lock must not be held by a thread that waits for a processor
    with contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[listening])
