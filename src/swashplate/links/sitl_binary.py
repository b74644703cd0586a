"""A firmware's SITL binary as a process of ours: whether it can run, how it ended, and its end."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from swashplate.errors import LinkError
from swashplate.systems import end_with_children

PATIENCE = 3.0
"""s that it has to end by itself."""


class SitlBinary(ABC):
    """A binary in a folder of its own; used as a context, it is ended whatever happens.

    Args:
        binary: the file. folder: where it runs. of: whose binary is expected, for messages.

    Attributes:
        taken: where a port is taken: the option that is named, and what helps.
        repeats: how lines begin that say nothing; "" for none.

    Raises:
        LinkError: where the binary is missing or is no program.
    """

    taken: ClassVar[tuple[str, str]]
    repeats: ClassVar[str] = ""

    def __init__(self, binary: str | Path, folder: Path, *, of: str) -> None:
        path = Path(binary).expanduser().absolute()
        if not path.exists():
            raise LinkError("there is no such file.", where=binary, channel="BINARY")
        if not path.is_file():
            raise LinkError(f"is no file, expected {of} SITL binary.", where=binary, channel="BINARY")
        if not os.access(path, os.X_OK):
            raise LinkError("is not executable.", where=binary, channel="BINARY", hint=f"chmod +x {binary}")
        self.binary, self.folder = path, folder
        self._process: subprocess.Popen[bytes] | None = None

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End it and everything that it started."""
        if self._process is None:
            return
        for at_once in (False, True):
            end_with_children(self._process, at_once=at_once)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(None if at_once else PATIENCE)

    def ended(self, *, patience: float = 0.0) -> str:
        """How it ended, with its last words; empty where it still runs after `patience` [s]."""
        if self._process is None:
            return ""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(patience)
        code = self._process.poll()
        if code is None:
            return ""
        how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        text = self.last_words()
        ending = f"; its last words: {text.rstrip('.')}" if text else "; it said nothing"
        return f"the binary ended {how}{ending}."

    @abstractmethod
    def text(self) -> str:
        """What it printed."""

    def last_words(self, lines: int = 4) -> str:
        """The end of what it printed, in one line."""
        said = "".join(letter if letter.isprintable() else "\n" for letter in self.text()[-4000:])
        kept = [line.strip() for line in said.splitlines() if line.strip()]
        kept = [line for line in kept if not (self.repeats and line.startswith(self.repeats))]
        return " / ".join(kept[-lines:])[-400:]

    def check_free(self, kind: socket.SocketKind, port: int) -> None:
        """Refuse a port that another program holds.

        Raises:
            LinkError: naming it.
        """
        with socket.socket(socket.AF_INET, kind) as probe:
            if kind is socket.SOCK_STREAM:  # a connection that was just closed does not hold it
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("0.0.0.0", port))
            except OSError:
                name, (channel, hint) = "TCP" if kind is socket.SOCK_STREAM else "UDP", self.taken
                problem = f"{name} port {port} is in use by another program."
                raise LinkError(problem, channel=channel, hint=hint) from None
