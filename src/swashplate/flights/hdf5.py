"""HDF5 files, read in a process of their own (`hdf5_process`), so that no damaged file ends or stops this one."""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import threading
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import FlightError
from swashplate.own_python import own_python
from swashplate.threads import ONE_THREAD

_LAST = {"foreign", "failed", "refused"}


@dataclass(frozen=True)
class StoredVariable:
    """A data set.

    Attributes:
        values: its numbers or texts, in its own type and shape.
        attributes: its numbers and texts; lists where there are several.
    """

    values: NDArray[Any]
    attributes: Mapping[str, Any]


@dataclass(frozen=True)
class Group:
    """A group's attributes and data sets; the groups in it are told by their own names."""

    attributes: Mapping[str, Any]
    variables: dict[str, StoredVariable] = field(default_factory=dict)


def read(path: Path, *, wanted: str) -> dict[str, Group] | None:
    """All of a file: its groups by name, "" the root.

    Args:
        path: the file.
        wanted: an attribute of the root.

    Returns:
        None where it has no such attribute: it is no file of ours, and nothing more of it is read.

    Raises:
        FlightError: where the file points outside of itself, needs a plugin, claims more than it can hold, or where the
            library ends its process or comes to no end.
        ValueError: for damaged bytes, in the library's words.
    """
    groups: dict[str, Group] = {}
    for told, content in _process().ask(path, wanted):
        if "foreign" in told:
            return None
        if "failed" in told:
            raise ValueError(told["failed"])
        if "refused" in told:
            problem, channel, hint = told["refused"]
            raise FlightError(problem, where=path, channel=channel, hint=hint)
        if "group" in told:
            at = groups.setdefault(told["group"], Group(told["attributes"]))
        elif told:
            kind = np.dtype(object) if "texts" in told else np.dtype(told["dtype"])
            flat = np.array(told["texts"], kind) if "texts" in told else np.frombuffer(content, kind)
            at.variables[told["variable"]] = StoredVariable(flat.reshape(told["shape"]), told["attributes"])
    return groups


class _Process:
    """The other process, started when it is first asked, and again after it was ended."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self._running: subprocess.Popen[bytes] | None = None
        self._one = threading.Lock()
        atexit.register(self._close)

    def ask(self, path: Path, wanted: str) -> Iterator[tuple[dict[str, Any], bytearray]]:
        """The frames that answer a question; the last one is empty, or says what was wrong."""
        question = json.dumps({"path": os.path.abspath(path), "wanted": wanted}).encode() + b"\n"
        with self._one:
            process = self._started(path)
            whole = False
            try:
                process.stdin.write(question)  # pyrefly: ignore[missing-attribute]
                process.stdin.flush()  # pyrefly: ignore[missing-attribute]
                while not whole:
                    text = self._bytes(process, int.from_bytes(self._bytes(process, 8), "little"))
                    told = json.loads(text)
                    content = self._bytes(process, told.get("bytes", 0))
                    whole = not told or bool(_LAST & told.keys())
                    yield told, content
            except (EOFError, BrokenPipeError):
                raise FlightError(
                    f"the HDF5 library {self._end(process)} over it: it is damaged or forged.",
                    where=path,
                    hint="Copy it again.",
                ) from None
            finally:
                if not whole:  # what is left of the answer belongs to nobody
                    self._close()

    def _started(self, path: Path) -> subprocess.Popen[bytes]:
        if self._running is None or self._running.poll() is not None:
            self._close()
            environment = {**os.environ, **ONE_THREAD}
            try:
                self._running = subprocess.Popen(
                    own_python("swashplate.flights.hdf5_process"),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env=environment,
                )
            except OSError as error:
                raise FlightError(f"a process to read it cannot be started: {error.strerror}.", where=path) from error
        return self._running

    @staticmethod
    def _bytes(process: subprocess.Popen[bytes], count: int) -> bytearray:
        content = bytearray(count)
        view, at = memoryview(content), 0
        while at < count:
            got = process.stdout.readinto(view[at:])  # pyrefly: ignore[missing-attribute]
            if not got:
                raise EOFError
            at += got
        return content

    @staticmethod
    def _end(process: subprocess.Popen[bytes]) -> str:
        code = process.wait()
        if code == -signal.SIGXCPU:
            return "came to no end"
        return f"ended its process ({signal.Signals(-code).name if code < 0 else code})"

    def _close(self) -> None:
        running, self._running = self._running, None
        if running is None:
            return
        own = self.owner == os.getpid()  # a fork has its parent's process
        if own:
            running.kill()
        with suppress(OSError):
            running.stdin.close()  # pyrefly: ignore[missing-attribute]
        running.stdout.close()  # pyrefly: ignore[missing-attribute]
        if own:
            running.wait()


_processes: list[_Process] = []


def _process() -> _Process:
    if not _processes or _processes[-1].owner != os.getpid():
        _processes[:] = [_Process()]
    return _processes[-1]
