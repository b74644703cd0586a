"""One local page for any log."""

from __future__ import annotations

import os
import socket
import threading
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.saying import Say, announce, ready
from swashplate.errors import FlightError, SwashError
from swashplate.flights import datasets

if TYPE_CHECKING:
    from swashplate.api.verbs.look import Open

USUAL = 8019
"""The port of the page, where it is free."""


def _listening(host: str, port: int | None, *, allow_remote: bool) -> socket.socket:
    """A bound socket; where nobody names a port, one that is free."""
    from swashplate.links.web import serving

    try:
        return serving.listen(host, USUAL if port is None else port, allow_remote=allow_remote)
    except SwashError as error:
        if port is not None or error.channel != "--port":
            raise
        return serving.listen(host, 0, allow_remote=allow_remote)


def serve_logs(asked: Open, say: Say) -> None:
    """The page of logs until it is interrupted. Nothing leaves this machine."""
    from swashplate.links.logs.app import logs_app
    from swashplate.links.logs.code_lines import Read
    from swashplate.links.logs.desk import Desk
    from swashplate.links.logs.remedies import Remedy
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    options = Remedy(dict(asked.units or {}), asked.drop_bad_stamps)
    given = []
    for name in asked.logs or ():
        path = Path(datasets.locate(os.fspath(name)))
        if not path.exists():
            raise FlightError("there is no such file.", where=path, hint="Check the name, or drop it onto the page.")
        given.append((path, Read(os.fspath(name), options, "" if asked.mapping is None else os.fspath(asked.mapping))))
    check_page()
    with _listening(asked.host, asked.port, allow_remote=asked.allow_remote) as listening:
        desk = Desk(given)
        threading.Thread(target=desk.read_given, daemon=True).start()
        try:
            begun = partial(announce, open_page=asked.open_page, ready=ready, say=say)
            serving.serve(logs_app(desk, remote=asked.allow_remote), listening, begun=begun)
        finally:
            desk.close()
