"""A ground station's side of a MAVLink connection: bytes out, messages of one autopilot in (needs the extra `link`)."""

from __future__ import annotations

import re
import socket
import time
from typing import Any

from swashplate.errors import LinkError
from swashplate.extras import library
from swashplate.links.sockets import listen_udp

AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1: messages of cameras, gimbals and ground stations are passed over."""
_ADDRESS = re.compile(r"(tcp|udp):([^:]+):(\d{1,5})")
_CHANNEL = "--mavlink"


class Connection:
    """A connection to whoever speaks MAVLink at an address.

    Args:
        address: "tcp:HOST:PORT" connects; "udp:HOST:PORT" listens, and keeps to the autopilot that is found there.
        timeout: of the connecting [s].

    Attributes:
        dialect: pymavlink's module of messages: the common ones and ArduPilot's own.
        system: number of the autopilot that is spoken to; None until it is known.

    Raises:
        LinkError: where the address is none, is taken, or nobody listens there.
        MissingLibraryError: where pymavlink is not installed.
    """

    def __init__(self, address: str, *, timeout: float) -> None:
        self.dialect: Any = library("pymavlink.dialects.v20.ardupilotmega", what="a check over MAVLink")
        self.address = address
        self.system: int | None = None
        self._writer: Any = self.dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        self._reader: Any = self.dialect.MAVLink(None)
        self._reader.robust_parsing = True
        self._peer: tuple[str, int] | None = None
        self._socket, self._stream = _opened(address, timeout)

    def __enter__(self) -> Connection:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, name: str, *values: object) -> None:
        """Send a message by its lower-case name; nothing is sent before an address to send to is known."""
        data = getattr(self._writer, f"{name}_encode")(*values).pack(self._writer)
        try:
            if self._stream:
                self._socket.sendall(data)
            elif self._peer is not None:
                self._socket.sendto(data, self._peer)
        except OSError as error:
            raise self._gone(error) from None

    def receive(self, wait: float) -> list[tuple[float, Any]]:
        """Messages of the autopilot that come within `wait` [s], each with the wall clock [s]; none after silence."""
        self._socket.settimeout(max(wait, 1e-3))
        try:
            data = self._received()
        except TimeoutError:
            return []
        except OSError as error:
            raise self._gone(error) from None
        now = time.monotonic()
        messages = self._reader.parse_buffer(data) or ()
        return [(now, m) for m in messages if m.get_type() != "BAD_DATA" and self._is_ours(m)]

    def _received(self) -> bytes:
        if self._stream:
            data = self._socket.recv(65_536)
            if not data:
                raise ConnectionResetError("the other side has closed it")
            return data
        data, sender = self._socket.recvfrom(65_536)
        if self.system is None:  # nobody has been found to be an autopilot: whoever speaks is answered
            self._peer = sender
        return data if sender == self._peer else b""

    def _is_ours(self, message: Any) -> bool:
        if message.get_srcComponent() != AUTOPILOT:
            return False
        return self.system is None or message.get_srcSystem() == self.system

    def _gone(self, error: OSError) -> LinkError:
        return LinkError(
            f"the connection broke: {error.strerror or error}.",
            where=self.address,
            channel=_CHANNEL,
            hint="The autopilot has ended, or another program holds this port (SITL serves one client on each).",
        )


def _opened(address: str, timeout: float) -> tuple[socket.socket, bool]:
    match = _ADDRESS.fullmatch(address)
    if match is None or int(match[3]) > 65_535:
        raise LinkError(f"'{address}' is no address, expected tcp:HOST:PORT or udp:HOST:PORT.", channel=_CHANNEL)
    kind, host, port = match[1], match[2], int(match[3])
    if kind == "udp":
        try:
            return listen_udp(host, port), False
        except LinkError as error:
            hint = "A ground station has it? Close it, or let it forward to another port and give that one."
            raise LinkError(error.problem, channel=_CHANNEL, hint=hint) from None
    try:
        return socket.create_connection((host, port), timeout), True
    except OSError as error:
        raise LinkError(
            f"nobody answers: {error.strerror or error}.",
            where=address,
            channel=_CHANNEL,
            hint="Is the autopilot running? ArduPilot's SITL opens 5762 once somebody has connected to 5760.",
        ) from None
