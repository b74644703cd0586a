"""Connections that never ask for anything, and requests that fail: both end without words that frighten."""

from __future__ import annotations

import asyncio
import logging
import os
from typing import ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

IN_TIME = 10.0
"""s that a request may take from the connection's begin, or its own first byte, to its last one."""
MOST_WAITING = 64
"""Connections at a time whose request is not complete; the oldest goes where one more comes."""


class Punctual(H11Protocol):
    """HTTP of which every request has to be complete in time; trickled bytes do not buy more of it."""

    _waiting: ClassVar[dict[Punctual, asyncio.TimerHandle]] = {}

    def connection_made(self, transport: asyncio.Transport) -> None:
        super().connection_made(transport)
        self._wait()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        upgraded = self.transport.get_protocol() is not self
        if not upgraded and self.conn.their_state in (h11.IDLE, h11.SEND_BODY):
            self._wait()
        else:
            self._arrived()

    def connection_lost(self, exc: Exception | None) -> None:
        self._arrived()
        super().connection_lost(exc)

    def _wait(self) -> None:
        if self in self._waiting:
            return
        if len(self._waiting) >= MOST_WAITING:
            next(iter(self._waiting))._end()
        self._waiting[self] = asyncio.get_running_loop().call_later(IN_TIME, self._end)

    def _arrived(self) -> None:
        timer = self._waiting.pop(self, None)
        if timer is not None:
            timer.cancel()

    def _end(self) -> None:
        self._arrived()
        self.transport.abort()


class OneLine(logging.Filter):
    """Of what goes wrong inside a request the server's log has one line, instead of a traceback; debugging has it all.

    Frames that are no UTF-8 are told once. Requests that the end of the server cuts off are what its user asked for.
    """

    def __init__(self) -> None:
        super().__init__()
        self._told = False

    def filter(self, record: logging.LogRecord) -> bool:
        if "timeout graceful shutdown exceeded" in str(record.msg):
            return False
        if not record.exc_info or os.environ.get("SWASHPLATE_DEBUG", "") not in ("", "0"):
            return True
        kind, error, _ = record.exc_info
        record.exc_info, record.args = None, None
        if isinstance(error, UnicodeDecodeError):
            before, self._told = self._told, True
            record.msg = "A page's message was refused: it is no UTF-8."
            return not before
        name = "error" if kind is None else kind.__name__
        text = f"A request failed inside swash ({name}: {error}). Please report it; SWASHPLATE_DEBUG=1 shows where."
        record.msg = text
        return True
