"""A bound address, pages as files, and the server's loop: what the live page, the replay and `swash open` share."""

from __future__ import annotations

import contextlib
import ipaddress
import logging
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import uvicorn
from starlette.convertors import Convertor, register_url_convertor
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.types import ASGIApp

from swashplate.errors import SwashError
from swashplate.links.web.connections import OneLine, Punctual
from swashplate.systems import HANGUP

_POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"


def listen(host: str, port: int, *, allow_remote: bool) -> socket.socket:
    """A bound socket.

    Raises:
        SwashError: for an address beyond this machine without `allow_remote`, an unknown host, or a port in use.
    """
    try:
        resolved = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise SwashError(f"'{host}' is no address of this machine.", channel="host") from None
    address = ipaddress.ip_address(resolved[4][0])
    if not address.is_loopback and not allow_remote:
        raise SwashError(
            f"{address} can be reached from other machines.",
            channel="host",
            hint="Whoever reaches the page can do all that it does; if that is meant: --settings allow_remote=true.",
        )
    bound = socket.socket(resolved[0], socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(resolved[4])
        bound.listen(64)
    except OSError as error:
        bound.close()
        raise SwashError(
            f"port {port} of {host} cannot be had: {error.strerror or error}.",
            channel="--port",
            hint="Is another page of swash open there? --port 0 takes any free port.",
        ) from None
    return bound


def address_of(listening: socket.socket) -> str:
    """The page's address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    if ipaddress.ip_address(host).is_unspecified:
        host = "127.0.0.1" if listening.family == socket.AF_INET else "::1"
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


class _Number(Convertor[int]):
    """A whole number of an address. Starlette's own falls over one of more than 4,300 digits."""

    regex = "[0-9]{1,18}"

    def convert(self, value: str) -> int:
        return int(value)

    def to_string(self, value: int) -> str:
        return str(value)


register_url_convertor("number", _Number())


def page(path: Path, *, code: bool = False) -> Callable[[Request], Response]:
    """Answers with an HTML page that may load only what this server has; `code`: and compile WebAssembly of it."""
    policy = f"{_POLICY}; script-src 'self' 'wasm-unsafe-eval'" if code else _POLICY

    def answer(_: Request) -> Response:
        return FileResponse(path, headers={"content-security-policy": policy})

    return answer


def configured(app: ASGIApp, *, frame: int = 0) -> uvicorn.Config:
    """How an app is served: what does not ask in time, or not in text, is let go.

    Args:
        frame: longest frame of a WebSocket [bytes]; 0 where the app has none.
    """
    config = uvicorn.Config(
        app,
        http=Punctual,
        log_level="warning",
        access_log=False,
        server_header=False,
        lifespan="off",
        ws="websockets-sansio" if frame else "none",
        ws_max_size=frame,
        timeout_graceful_shutdown=2,
    )
    for log in ("uvicorn.error", "asyncio"):
        logging.getLogger(log).addFilter(OneLine())
    return config


class _Server(uvicorn.Server):
    """A server that a closed terminal ends as an interrupt does: with its pages closed, and without a traceback.

    Args:
        config: of uvicorn. begun: called when it answers.
    """

    def __init__(self, config: uvicorn.Config, begun: Callable[[], None]) -> None:
        super().__init__(config)
        self._begun = begun

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if not self.should_exit:
            self._begun()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        with super().capture_signals():
            in_main = threading.current_thread() is threading.main_thread()
            if HANGUP is None or not in_main or signal.getsignal(HANGUP) is signal.SIG_IGN:  # as `nohup` asks for
                yield
                return
            before = signal.signal(HANGUP, self.handle_exit)
            try:
                yield
            finally:
                signal.signal(HANGUP, before)


def serve(app: ASGIApp, listening: socket.socket, *, begun: Callable[[str], None], frame: int = 0) -> None:
    """Serve until interrupted; an interrupt is the ordinary end, from when the address is told.

    Args:
        app, frame: as of `configured`. begun: called with the page's address when it answers and an interrupt is heard:
            one that came before, while this server was made, could be lost.
    """
    config = configured(app, frame=frame)
    with contextlib.suppress(KeyboardInterrupt):
        _Server(config, lambda: begun(address_of(listening))).run(sockets=[listening])
