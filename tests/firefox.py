"""Firefox without windows, driven by its own protocol (Marionette): a page, and what its scripts answer."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

PROGRAMS = ("firefox-esr", "firefox")
_PREFERENCES = {
    "marionette.port": 0,
    "webgl.force-enabled": True,
    "app.update.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.proxy.type": 1,  # nothing is reached but files: no proxy answers there
    "network.proxy.http": "127.0.0.1",
    "network.proxy.http_port": 9,
    "network.proxy.ssl": "127.0.0.1",
    "network.proxy.ssl_port": 9,
}


class Driven:
    """A running Firefox."""

    def __init__(self, port: int) -> None:
        self._line = socket.create_connection(("127.0.0.1", port), timeout=90.0)
        self._number = 0
        self._heard()
        self.ask("WebDriver:NewSession")

    def _heard(self) -> Any:
        size = b""
        while (one := self._line.recv(1)) != b":":
            assert one, "Firefox has gone"
            size += one
        told = b""
        while len(told) < int(size):
            told += self._line.recv(int(size) - len(told))
        return json.loads(told)

    def ask(self, command: str, **parameters: Any) -> Any:
        self._number += 1
        text = json.dumps([0, self._number, command, parameters]).encode()
        self._line.sendall(b"%d:%s" % (len(text), text))
        _, _, error, answer = self._heard()
        assert error is None, error
        return answer

    def of(self, script: str, *arguments: Any) -> Any:
        """What a function body returns in the page; `swash` is the page's own."""
        body = f"const swash = window.swash; {script}"
        return self.ask("WebDriver:ExecuteScript", script=body, args=list(arguments))["value"]

    def until(self, expression: str) -> None:
        end = time.monotonic() + 120.0
        while not self.of(f"return Boolean({expression});"):
            assert time.monotonic() < end, expression
            time.sleep(0.2)

    def close(self) -> None:
        self._line.close()


@contextmanager
def running_firefox(folder: Path) -> Iterator[Driven]:
    """Firefox with a profile of its own; skips where it is not installed."""
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"Firefox is not installed (Debian: apt-get install {PROGRAMS[0]})")
    profile = folder / "profile"
    profile.mkdir()
    lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in _PREFERENCES.items())
    (profile / "user.js").write_text("\n".join(lines))
    command = [program, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder) as process:
        driven = None
        try:
            port, end = profile / "MarionetteActivePort", time.monotonic() + 120.0
            while not (port.is_file() and port.read_text().strip()):
                assert process.poll() is None, "Firefox ended at once"
                assert time.monotonic() < end, "Firefox never listened"
                time.sleep(0.1)
            driven = Driven(int(port.read_text()))
            yield driven
        finally:
            if driven is not None:
                driven.close()
            process.terminate()
            try:
                process.wait(timeout=20.0)
            except subprocess.TimeoutExpired:
                process.kill()
