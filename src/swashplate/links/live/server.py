"""The live page's and the replay's addresses: our own files, and one WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
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
from swashplate.links.live.messages import MessageError, parse
from swashplate.links.live.session import LiveSession
from swashplate.links.web.guard import Guard
from swashplate.links.web.libraries import PAGE
from swashplate.links.web.serving import page

UPDATES = 10.0
"""Looks per second at whether a page has to be told anything [Hz]."""
MOST_PAGES = 8
"""Connections at a time."""
MOST_BAD = 20
"""Messages of one connection that the schema refuses, before it is closed."""
FRAME = 1 << 18
"""Bytes of a frame of the WebSocket."""
ELSEWHERE = "Another page flies here: recordings and estimates are of its flight."
_LOG = logging.getLogger("swashplate.live")


def live_app(session: LiveSession, *, remote: bool = False) -> ASGIApp:
    """The live page, its socket, and the reports of its recordings."""
    pages: set[WebSocket] = set()
    flying: list[WebSocket] = []
    refused: set[str] = set()

    async def talk(socket_: WebSocket) -> None:
        if len(pages) >= MOST_PAGES:
            await socket_.close(code=1013, reason="too many pages")
            return
        await socket_.accept()
        pages.add(socket_)
        sending = asyncio.create_task(_tell(socket_, session, flying))
        try:
            await hear(socket_)
        except WebSocketDisconnect:
            pass  # a page that is closed or lost is the ordinary end
        finally:
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await sending
            pages.discard(socket_)
            if flying == [socket_]:
                flying.clear()
                session.let_go()

    async def hear(socket_: WebSocket) -> None:
        bad = 0
        while True:
            try:
                heard = await socket_.receive()
            except RuntimeError:  # an update could not be sent while this was busy: the page is gone
                return
            if heard["type"] == "websocket.disconnect":
                return
            if not flying:
                flying.append(socket_)
            try:
                if heard.get("text") is not None:
                    await session.obey(parse(heard["text"]))
                elif flying == [socket_]:
                    session.fly(heard.get("bytes") or b"")
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
        Route("/", page(PAGE / "live.html", code=True)),
        Route("/report/{number:number}", report),
        WebSocketRoute("/socket", talk),
        Mount("/page", StaticFiles(directory=PAGE)),
    ]
    return Guard(Starlette(routes=routes), remote=remote)


async def _tell(socket_: WebSocket, session: LiveSession, flying: list[WebSocket]) -> None:
    """What flies, when it is another version, and what is told of it, when that is new."""
    version, last = None, ""
    while True:
        if session.version != version:
            version, last = session.version, ""
            await socket_.send_text(json.dumps(session.hello()))
        report = session.report()
        if flying and flying != [socket_]:
            report |= {"recording": None, "estimates": [[None] * 3 for _ in report["estimates"]], "doubts": ELSEWHERE}
        if (text := json.dumps(report, separators=(",", ":"))) != last:
            last = text
            await socket_.send_text(text)
        await asyncio.sleep(1.0 / UPDATES)


def replay_app(flight: dict[str, Any], *, remote: bool = False) -> ASGIApp:
    """The replay page of one flight."""
    routes = [
        Route("/", page(PAGE / "replay.html")),
        Route("/flight", lambda _: JSONResponse(flight)),
        Mount("/page", StaticFiles(directory=PAGE)),
    ]
    return Guard(Starlette(routes=routes), remote=remote)
