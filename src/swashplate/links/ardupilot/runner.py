"""The socket around a session: wait for a datagram, answer it, until told to stop."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from typing import Protocol

from swashplate.links.ardupilot.packets import LONGEST
from swashplate.links.sockets import wait_at_most

PORT = 9002
_LOOK_UP = 0.2
"""s between looks at whether to go on."""


class Answering(Protocol):
    """What answers datagrams: a session."""

    def handle(self, data: bytes, sender: tuple[str, int], now: float) -> bytes | None:
        """The answer, or None where there is none."""

    def carry_on(self, bound: socket.socket) -> tuple[tuple[bytes, tuple[str, int]] | None, bool]:
        """Answer what comes without further ado; returns what it leaves to `handle`, and its sender, and whether to
        carry on at once."""


def serve(
    bound: socket.socket,
    session: Answering,
    *,
    idle_exit: float | None = None,
    go_on: Callable[[], bool] = lambda: True,
) -> None:
    """Answer every servo packet to the address that it came from. Nothing is sent before the first one.

    Args:
        bound: a UDP socket from `listen_udp`; it is not closed.
        session: what answers.
        idle_exit: end after so many seconds without a datagram that was answered; None waits for ever.
        go_on: asked now and then whether to go on.
    """
    wait_at_most(bound, _LOOK_UP)
    heard = looked = time.monotonic()
    left: tuple[bytes, tuple[str, int]] | None = None
    more = False
    while True:
        if more:
            left, more = session.carry_on(bound)
            heard = now = time.monotonic()
        else:
            try:
                data, sender = left or bound.recvfrom(LONGEST + 1)
            except (TimeoutError, BlockingIOError):
                data, sender = b"", None
            except ConnectionError:
                continue  # an answer found nobody: the autopilot has gone, and will be back or not
            now, left = time.monotonic(), None
            answer = session.handle(data, sender, now) if sender else None
            if sender and answer is not None:
                _answer(bound, answer, sender)
                heard, more = now, True
        if now - looked >= _LOOK_UP:
            looked = now
            if not go_on() or (idle_exit is not None and now - heard >= idle_exit):
                return


def _answer(bound: socket.socket, answer: bytes, sender: tuple[str, int]) -> None:
    try:
        bound.sendto(answer, sender)
    except OSError:
        return  # whoever asked cannot be reached any more; it will ask again
