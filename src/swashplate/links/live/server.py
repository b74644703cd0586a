"""The live page's and the replay's addresses: our own files, and one WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from swashplate.errors import SwashError
from swashplate.links.live.identifying import REPORT
from swashplate.links.live.messages import LONGEST, MessageError, parse
from swashplate.links.live.session import LiveSession
from swashplate.links.web.guard import Guard
from swashplate.links.web.libraries import PAGE
from swashplate.links.web.serving import page

UPDATES = 30.0
"""Updates of the page per second [Hz]."""
MOST_PAGES = 8
"""Connections at a time."""
MOST_BAD = 20
"""Messages of one connection that the schema refuses, before it is closed."""
FRAME = 4 * LONGEST
"""Bytes of a frame of the WebSocket."""
_LOG = logging.getLogger("swashplate.live")


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
                heard = await socket_.receive_text()
            except RuntimeError:  # an update could not be sent while this was busy: the page is gone
                return
            except KeyError:  # bytes instead of text
                await socket_.close(code=1003, reason="text only")
                return
            try:
                message = parse(heard)
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
            except (SwashError, OSError) as error:
                session.notice = str(error)

    def report(request: Request) -> Response:
        path = session.identifying.out(request.path_params["number"]) / REPORT
        return FileResponse(path) if path.is_file() else PlainTextResponse("No such report.\n", status_code=404)

    routes = [
        Route("/", page(PAGE / "live.html")),
        Route("/report/{number:number}", report),
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
        Route("/", page(PAGE / "replay.html")),
        Route("/flight", lambda _: JSONResponse(flight)),
        Mount("/page", StaticFiles(directory=PAGE)),
    ]
    return Guard(Starlette(routes=routes), remote=remote)
