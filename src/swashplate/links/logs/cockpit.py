"""The live page in a process of its own, begun from the page of logs: a vehicle to fly, and where."""

from __future__ import annotations

import contextlib
import re
import subprocess
import threading
from importlib.util import find_spec

from swashplate.errors import SwashError
from swashplate.extras import missing
from swashplate.own_python import own_python
from swashplate.systems import end_with_children

VEHICLE = "raptor50"
_PATIENCE = 120.0
"""s: a first start compiles."""


class Cockpit:
    """At most one process of `swash live`; it ends with the page of logs."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._address = ""

    def begin(self) -> dict[str, str]:
        """The address of the live page, started where it does not run yet.

        Raises:
            SwashError: where a library for it is missing, or it does not start.
        """
        if find_spec("casadi") is None:
            raise missing("casadi", what="flying a vehicle")
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._start()
            return {"address": self._address}

    def _start(self) -> None:
        command = own_python("swashplate.__main__", "live", VEHICLE, "--port", "0")
        self._process = process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        watchdog = threading.Timer(_PATIENCE, process.kill)
        watchdog.start()
        try:
            assert process.stdout is not None
            address = next((m for line in process.stdout if (m := re.search(rb"http://\S+", line))), None)
        finally:
            watchdog.cancel()
        if address is None:
            raise SwashError(
                f"the live page of {VEHICLE} did not start.", hint=f"`swash live {VEHICLE}` in a terminal says why."
            )
        self._address = address[0].decode()

    def close(self) -> None:
        """End it, as an interrupt in its terminal would."""
        process = self._process
        if process is None or process.poll() is not None:
            return
        end_with_children(process, at_once=False)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=5.0)
            return
        end_with_children(process, at_once=True)
