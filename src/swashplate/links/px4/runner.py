"""The TCP server around a session: PX4 connects, gets sensors, and is waited for."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress

from swashplate.links.notices import Notices
from swashplate.links.px4.session import RATE, Session

PORT = 4560
_LOOK_UP = 0.2
"""s between looks at whether to go on."""
_PATIENCE = 1.0
"""s that controls of a PX4 in lockstep are waited for before the next sensors are sent all the same."""


def serve(
    listening: socket.socket,
    session: Session,
    notices: Notices,
    *,
    idle_exit: float | None = None,
    go_on: Callable[[], bool] = lambda: True,
) -> None:
    """One PX4 after the other, each from the ground.

    Until the first controls arrive, sensors are sent in real time: PX4 starts up on them. From then on every frame
    waits for its controls.

    Args:
        listening: from `listen_tcp`; it is not closed.
        session: what answers.
        notices: where to say what happens.
        idle_exit: end after so many seconds without a connection; None waits for ever.
        go_on: asked now and then whether to go on.
    """
    listening.settimeout(_LOOK_UP)
    waited = time.monotonic()
    while go_on():
        if idle_exit is not None and time.monotonic() - waited >= idle_exit:
            return
        try:
            connection, (host, port, *_) = listening.accept()
        except TimeoutError:
            continue
        with connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            notices.always(f"PX4 is here ({host}:{port}): the vehicle stands on the ground.")
            with suppress(ConnectionError):  # told below
                _fly(connection, session, notices, go_on)
            session.restarts += 1
            notices.always(f"PX4 has gone after {session.plant.time:.1f} s; waiting for the next one.")
        waited = time.monotonic()


def _fly(connection: socket.socket, session: Session, notices: Notices, go_on: Callable[[], bool]) -> None:
    connection.sendall(session.connected())
    sent = looked = time.monotonic()
    while True:
        wait = _PATIENCE if session.lockstep else max(0.0, sent + 1.0 / RATE - time.monotonic())
        heard, open_still = _hear(connection, session, wait)
        if not open_still:
            return
        if session.lockstep and not heard:
            notices.tell("slow", f"PX4 sent no controls for {_PATIENCE:g} s; sensors go on without them.")
        if session.lockstep or time.monotonic() - sent >= 1.0 / RATE:
            connection.sendall(session.step())
            sent = time.monotonic()
        if time.monotonic() - looked >= _LOOK_UP:
            looked = time.monotonic()
            if not go_on():
                return


def _hear(connection: socket.socket, session: Session, wait: float) -> tuple[bool, bool]:
    """Wait for controls at most so long [s]. Returns whether they came, and whether the connection still stands."""
    until = time.monotonic() + wait
    while True:
        ready, _, _ = select.select([connection], [], [], max(0.0, until - time.monotonic()))
        if not ready:
            return False, True
        data = connection.recv(65_536)
        if not data:
            return False, False
        if session.hear(data):
            return True, True
