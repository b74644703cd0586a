"""Nobody else's requests: a page of another site must not steer or read.

Requests whose `Host` is not this server (DNS rebinding) or whose `Origin` is not this page are refused. What changes
something (all but GET and HEAD, and WebSockets) needs the `Origin` of this page.
"""

from __future__ import annotations

import ipaddress
import socket
from urllib.parse import urlsplit

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_HEADERS = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


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
            if origin is not None or scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD"):
                trusted = trusted and origin == f"http://{host}"
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
