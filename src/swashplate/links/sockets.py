"""Sockets that listen on this machine only, unless told otherwise."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
import struct

from swashplate.errors import LinkError


def is_loopback(address: str) -> bool:
    """Whether only this machine can reach an address.

    Raises:
        LinkError: where it is no IPv4 address.
    """
    try:
        return ipaddress.IPv4Address(address).is_loopback
    except ValueError:
        raise LinkError(
            f"'{address}' is no IPv4 address.", channel="listen", hint="For example 127.0.0.1, or 0.0.0.0 for all."
        ) from None


def listen_udp(address: str, port: int) -> socket.socket:
    """A UDP socket bound to an address.

    Raises:
        LinkError: where the address is no address, or the port is taken or not allowed.
    """
    return _bound(socket.SOCK_DGRAM, address, port)


def listen_tcp(address: str, port: int) -> socket.socket:
    """A TCP socket bound to an address that listens for one client.

    Raises:
        LinkError: as `listen_udp`.
    """
    bound = _bound(socket.SOCK_STREAM, address, port)
    bound.listen(1)
    return bound


def wait_at_most(bound: socket.socket, seconds: float) -> None:
    """Let a socket wait for data for so long, by the system where it can: C that reads it waits as long then.

    What is over is a TimeoutError or a BlockingIOError.
    """
    if os.name == "posix":
        seconds_of_it, parts = divmod(round(1e6 * seconds), 1_000_000)
        bound.settimeout(None)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", seconds_of_it, parts))
    else:
        bound.settimeout(seconds)


def _bound(kind: socket.SocketKind, address: str, port: int) -> socket.socket:
    is_loopback(address)
    bound = socket.socket(socket.AF_INET, kind)
    if kind is socket.SOCK_STREAM:  # a connection that was just closed must not keep its port
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((address, port))
    except OSError as error:
        bound.close()
        raise LinkError(_why(error, address, port), channel="--port", hint=_hint(error)) from None
    return bound


def _why(error: OSError, address: str, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port {port} on {address} is in use by another program."
    return f"port {port} on {address} cannot be opened: {error.strerror}."


def _hint(error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return "Stop the other program (another simulator?) or give another --port."
    return "Give another --port."
