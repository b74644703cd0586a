"""Connections that never ask for anything, and frames that are no text: both end without a word that frightens."""

from __future__ import annotations

import asyncio
import logging
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
    """Of frames that are no UTF-8 the server's log has one line, instead of a traceback for each."""

    def __init__(self) -> None:
        super().__init__()
        self._told = False

    def filter(self, record: logging.LogRecord) -> bool:
        if not record.exc_info or not isinstance(record.exc_info[1], UnicodeDecodeError):
            return True
        told, self._told = self._told, True
        record.exc_info, record.msg, record.args = None, "A page's message was refused: it is no UTF-8.", ()
        return not told
