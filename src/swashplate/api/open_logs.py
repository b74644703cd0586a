"""One local page for any log: `sp.open_logs`, `swash open`."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from swashplate.api.saying import announce
from swashplate.errors import FlightError, SwashError
from swashplate.flights import datasets

USUAL = 8019
"""The port of the page, where it is free."""


def _silent(_: str) -> None:
    """Says nothing."""


def _listening(host: str, port: int | None, *, allow_remote: bool) -> socket.socket:
    """A bound socket; where nobody names a port, one that is free."""
    from swashplate.links.web import serving

    try:
        return serving.listen(host, USUAL if port is None else port, allow_remote=allow_remote)
    except SwashError as error:
        if port is not None or error.channel != "--port":
            raise
        return serving.listen(host, 0, allow_remote=allow_remote)


def open_logs(
    logs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    *,
    units: Mapping[str, str] | None = None,
    mapping: str | os.PathLike[str] | None = None,
    bad_stamps: str = "error",
    host: str = "127.0.0.1",
    port: int | None = None,
    allow_remote: bool = False,
    open_page: bool = False,
    say: Callable[[str], None] = _silent,
    ready: Callable[[str], None] = print,
) -> None:
    """Look at logs in the browser until it is interrupted: plots, findings, spectra, track, and sweeps to gains.

    More logs may be dropped onto the page. Nothing leaves this machine.

    Args:
        logs: files, files of public data sets, or "examples/NAME"; none for a page with examples, to drop logs onto.
        units, mapping, bad_stamps: as of `sp.read`, for every log given.
        host, port: where the page is; port 0 takes any free one, None 8019 or, where that is taken, any free one.
        allow_remote: let other machines open the page.
        open_page: open it in the browser.
        say: told what is being done.
        ready: told the page's address when it can be opened.

    Raises:
        SwashError: where a file is not there, or the address is taken.
    """
    from swashplate.links.logs.app import logs_app
    from swashplate.links.logs.code_lines import Read
    from swashplate.links.logs.desk import Desk
    from swashplate.links.logs.remedies import Remedy
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    options = Remedy(dict(units or {}), bad_stamps == "drop")
    given = []
    for name in (logs,) if isinstance(logs, str | os.PathLike) else tuple(logs):
        path = Path(datasets.locate(os.fspath(name)))
        if not path.exists():
            raise FlightError("there is no such file.", where=path, hint="Check the name, or drop it onto the page.")
        given.append((path, Read(os.fspath(name), options, "" if mapping is None else os.fspath(mapping))))
    check_page()
    with _listening(host, port, allow_remote=allow_remote) as listening:
        desk = Desk(given)
        threading.Thread(target=desk.read_given, daemon=True).start()
        try:
            with suppress(KeyboardInterrupt):  # from when the address is told, an interrupt is the ordinary end
                announce(serving.address_of(listening), open_page=open_page, ready=ready, say=say)
                serving.serve(logs_app(desk, remote=allow_remote), listening)
        finally:
            desk.close()
