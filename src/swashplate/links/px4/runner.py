"""The TCP server around a session: PX4 connects, gets sensors, and is waited for."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress

from swashplate.links.notices import Notices
from swashplate.links.px4.session import RATE, Px4Session

PORT = 4560
SILENT = 3.0
"""s of silence after which another connection takes the link over."""
_LOOK_UP = 0.2
"""s between looks at whether to go on."""
_PATIENCE = 1.0
"""s that controls of a PX4 in lockstep are waited for before the next sensors are sent all the same."""

Client = tuple[socket.socket, str]


class Door:
    """Who has the link and who waits for it: a link belongs to its connection until that closes or has been silent.

    Args:
        listening: from `listen_tcp`.
        notices: where to say what happens.
    """

    def __init__(self, listening: socket.socket, notices: Notices) -> None:
        self._listening, self._notices = listening, notices
        listening.setblocking(False)
        self._waiting: Client | None = None
        self.heard = time.monotonic()

    def next(self, wait: float) -> Client | None:
        """The connection that waits, or one that comes within `wait` [s]; None for none. The link is its own now."""
        if self._waiting is None:
            select.select([self._listening], [], [], wait)
            self.look()
        client, self._waiting = self._waiting, None
        self.heard = time.monotonic()
        return client

    def look(self, owner: str = "") -> bool:
        """Let newcomers in, one of whom may wait; whether it is its turn because the owner has been silent."""
        while True:
            try:
                connection, (host, port, *_) = self._listening.accept()
            except (BlockingIOError, ConnectionError):
                break
            if self._waiting is not None and not _gone(self._waiting[0]):
                connection.close()
                self._notices.tell("stray", f"connections beside {owner or 'PX4'} and one that waits are closed.")
                continue
            self.close()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._waiting = connection, f"{host}:{port}"
            if owner:
                self._notices.tell(
                    "stray",
                    f"another connection, {host}:{port}, waits and is counted: the link belongs to {owner} until that "
                    f"one has gone or has been silent for {SILENT:g} s.",
                )
        if self._waiting is not None and _gone(self._waiting[0]):
            self.close()
        return self._waiting is not None and time.monotonic() - self.heard >= SILENT

    def close(self) -> None:
        """Close the connection that waits."""
        if self._waiting is not None:
            self._waiting[0].close()
        self._waiting = None


def _gone(connection: socket.socket) -> bool:
    """Whether the other side has closed a connection of which nothing was read."""
    try:
        return connection.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def serve(
    listening: socket.socket,
    session: Px4Session,
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
    door = Door(listening, notices)
    waited = time.monotonic()
    try:
        while go_on():
            if idle_exit is not None and time.monotonic() - waited >= idle_exit:
                return
            client = door.next(_LOOK_UP)
            if client is None:
                continue
            connection, who = client
            silent = False
            with connection:
                notices.always(f"PX4 is here ({who}): the vehicle stands on the ground.")
                with suppress(ConnectionError):  # told below
                    silent = _fly(connection, session, notices, go_on, who, door)
                session.restarts += 1
                if silent:
                    notices.always(f"{who} has been silent for {SILENT:g} s; another PX4 takes the link over.")
                else:
                    notices.always(f"PX4 has gone after {session.plant.time:.1f} s; waiting for the next one.")
            waited = time.monotonic()
    finally:
        door.close()


def _fly(
    connection: socket.socket, session: Px4Session, notices: Notices, go_on: Callable[[], bool], who: str, door: Door
) -> bool:
    """Fly until the connection is gone or told to stop (False), or somebody else's turn has come (True)."""
    connection.sendall(session.connected())
    sent = looked = time.monotonic()
    while True:
        wait = _PATIENCE if session.lockstep else max(0.0, sent + 1.0 / RATE - time.monotonic())
        heard, open_still = _hear(connection, session, wait)
        if not open_still:
            return False
        if heard:
            door.heard = time.monotonic()
        if session.lockstep and not heard:
            notices.tell("slow", f"PX4 sent no controls for {_PATIENCE:g} s; sensors go on without them.")
        if session.lockstep or time.monotonic() - sent >= 1.0 / RATE:
            connection.sendall(session.step())
            sent = time.monotonic()
        if time.monotonic() - looked >= _LOOK_UP:
            looked = time.monotonic()
            if door.look(who):
                return True
            if not go_on():
                return False


def _hear(connection: socket.socket, session: Px4Session, wait: float) -> tuple[bool, bool]:
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
