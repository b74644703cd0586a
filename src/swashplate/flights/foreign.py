"""Containers of others, read by others' libraries in a process with limits, so that no file ends or stops this one.

HDF5's and Arrow's libraries end their process over some damaged files and come to no end over others; a ROS bag of some
kilobytes unpacks to gigabytes, and an SQLite view in one has no last row. All of that runs in one process
(`foreign_process`), which has a limit of time, memory and disk by the size of the file, and can be ended.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

from swashplate.errors import FlightError
from swashplate.flights.readers.source import largest_content
from swashplate.own_python import own_python
from swashplate.systems import OUT_OF_TIME, resource
from swashplate.threads import ONE_THREAD

Job = Literal["hdf5", "rosbag"]
Told = dict[str, Any]

_LAST = {"foreign", "failed", "refused", "limit"}
_BASE, _MOST = 256 << 20, 6 << 30  # bytes of memory: of the libraries themselves, and of all


@dataclass(frozen=True)
class ProcessLimits:
    """What the process may take for one file.

    Attributes:
        processor: seconds of the processor.
        seconds: on the clock, whatever it waits for.
        memory: bytes.
        disk: bytes that packed files unpack to.
        handed: bytes that it hands over.
    """

    processor: int
    seconds: float
    memory: int
    disk: int
    handed: int

    def __str__(self) -> str:
        return (
            f"{self.processor} s of the processor, {self.memory >> 20:,} MB of memory, {self.disk >> 20:,} MB unpacked"
        )


BYTES_A_SECOND: Final[dict[Job, int]] = {"hdf5": 20 << 20, "rosbag": 512 << 10}
"""Of a file, that its library reads at least: a fifth of what it does on a slow processor."""


def limits(job: Job, size: int) -> ProcessLimits:
    """What a file of so many bytes may take.

    Systems without `resource` (Windows) limit neither processor nor memory; there the clock is the tighter one.
    The memory is three times the largest content that a file of this size can have: in the library, as an array, and
    on its way here.
    """
    processor, content = 3 + size // BYTES_A_SECOND[job], largest_content(size)
    clock = 10.0 + 4.0 * processor if resource is None else 60.0 + 20.0 * processor  # others may keep the machine busy
    return ProcessLimits(processor, clock, min(_BASE + 3 * content, _MOST), content, 2 * content)


def frames(
    job: Job, path: Path, *, size: int, scratch: Path | None = None, **asked: Any
) -> Iterator[tuple[Told, bytearray]]:
    """What a job tells of a file: see the job's own `frames`; the last frame is empty.

    Args:
        job: which library.
        path: the file or folder.
        size: its bytes.
        scratch: a folder for what is unpacked; with it the job is asked for `disk`, too, the bytes that may lie there.
        asked: of the job.

    Raises:
        FlightError: for what the job refuses, a limit that was met, or a library that ended its process.
        ValueError: for damaged bytes, in the library's words.
    """
    may = limits(job, size)
    question = {"job": job, "path": os.path.abspath(path), "asked": asked, "limits": asdict(may), "scratch": None}
    if scratch is not None:
        question |= {"scratch": os.path.abspath(scratch), "asked": {**asked, "disk": may.disk}}
    for head, content in _process().ask(path, question, may):
        if "failed" in head:
            raise ValueError(head["failed"])
        if "refused" in head:
            problem, channel, hint = head["refused"]
            raise FlightError(problem, where=path, channel=channel, hint=hint)
        if "limit" in head:
            raise _stopped(path, _MET[head["limit"]].format(may=may, memory=may.memory >> 20, disk=may.disk >> 20), may)
        yield head, content


_MET = {
    "memory": "needed more than {memory:,} MB of memory",
    "disk": "unpacked to more than {disk:,} MB",
}


def _stopped(path: Path, met: str, may: ProcessLimits) -> FlightError:
    return FlightError(
        f"was given up: reading it {met}. It is damaged or forged; a file of its size may take {may}.",
        where=path,
        hint="Copy it again; record a long flight in several files.",
    )


class _LimitError(Exception):
    """A limit that this side watches was met, in words."""


class _Process:
    """The other process, started when it is first asked, and again after it was ended."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self._running: subprocess.Popen[bytes] | None = None
        self._one = threading.Lock()
        atexit.register(self._close)

    def ask(self, path: Path, question: Told, may: ProcessLimits) -> Iterator[tuple[Told, bytearray]]:
        """The frames that answer a question; the last one is empty, or says what was wrong."""
        with self._one:
            process = self._started(path)
            ended, expired, left = False, threading.Event(), may.handed

            def end() -> None:
                expired.set()
                process.kill()

            watch = threading.Timer(may.seconds, end)
            watch.daemon = True
            watch.start()
            try:
                process.stdin.write(json.dumps(question).encode() + b"\n")  # pyrefly: ignore[missing-attribute]
                process.stdin.flush()  # pyrefly: ignore[missing-attribute]
                while not ended:
                    left, text = self._bytes(process, int.from_bytes(self._bytes(process, 8, 8)[1], "little"), left)
                    head = json.loads(text)
                    left, content = self._bytes(process, head.get("bytes", 0), left)
                    ended = not head or bool(_LAST & head.keys())
                    yield head, content
            except _LimitError as error:
                raise _stopped(path, f"gave more than {may.handed >> 20:,} MB ({error})", may) from None
            except (EOFError, BrokenPipeError):
                met = f"took more than {may.seconds:g} s" if expired.is_set() else self._end(process, may)
                raise _stopped(path, met, may) from None
            finally:
                watch.cancel()
                if not ended or expired.is_set():  # what is left of the answer belongs to nobody
                    self._close()

    def _started(self, path: Path) -> subprocess.Popen[bytes]:
        if self._running is None or self._running.poll() is not None:
            self._close()
            environment = {**os.environ, **ONE_THREAD}
            try:
                self._running = subprocess.Popen(
                    own_python("swashplate.flights.foreign_process"),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env=environment,
                )
            except OSError as error:
                raise FlightError(f"a process to read it cannot be started: {error.strerror}.", where=path) from error
        return self._running

    @staticmethod
    def _bytes(process: subprocess.Popen[bytes], count: int, left: int) -> tuple[int, bytearray]:
        """Bytes of the answer, and how many may still come after them."""
        if count > left:
            raise _LimitError(f"{count:,} bytes at once")
        content = bytearray(count)
        view, at = memoryview(content), 0
        while at < count:
            got = process.stdout.readinto(view[at:])  # pyrefly: ignore[missing-attribute]
            if not got:
                raise EOFError
            at += got
        return left - count, content

    @staticmethod
    def _end(process: subprocess.Popen[bytes], may: ProcessLimits) -> str:
        code = process.wait()
        if OUT_OF_TIME is not None and code == -OUT_OF_TIME:
            return f"took more than {may.processor} s of the processor"
        return f"ended its process ({signal.Signals(-code).name if code < 0 else code})"

    def _close(self) -> None:
        running, self._running = self._running, None
        if running is None:
            return
        ours = self.owner == os.getpid()  # a fork has its parent's process
        if ours:
            running.kill()
        with suppress(OSError):
            running.stdin.close()  # pyrefly: ignore[missing-attribute]
        running.stdout.close()  # pyrefly: ignore[missing-attribute]
        if ours:
            running.wait()


_processes: list[_Process] = []


def _process() -> _Process:
    if not _processes or _processes[-1].owner != os.getpid():
        _processes[:] = [_Process()]
    return _processes[-1]
