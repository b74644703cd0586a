"""The process in which others' libraries read others' files: its limits, and what it answers.

Lines in are JSON (`job`, `path`, `asked`, `limits`, `scratch`); each is answered by frames: the length of a JSON text
as eight bytes, the text, and as many bytes as its entry `bytes` says. A job is a module with `frames(path, **asked)`.
"""

from __future__ import annotations

import errno
import json
import os
import signal
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from swashplate.errors import FlightError
from swashplate.systems import resource

Frame = tuple[dict[str, Any], bytes]

JOBS = {
    "hdf5": "swashplate.flights.hdf5_frames",
    "rosbag": "swashplate.flights.readers.rosbag_frames",
}

_SQLITE_WROTE = {("apsw", "IOError"), ("apsw", "FullError")}
"""Of a file that is only read: what it sorts or keeps meanwhile does not fit into the limit."""


class UnpackedError(Exception):
    """Packed files that unpack to more than the disk may get."""


def limit_met(error: BaseException | None) -> str:
    """Which limit an error comes from: "memory", "disk" or ""; libraries put errors of their own around it."""
    visited: set[int] = set()
    while error is not None and id(error) not in visited:
        visited.add(id(error))
        if isinstance(error, MemoryError):
            return "memory"
        if isinstance(error, UnpackedError) or (isinstance(error, OSError) and error.errno == errno.EFBIG):
            return "disk"
        if (type(error).__module__, type(error).__name__) in _SQLITE_WROTE:
            return "disk"
        error = error.__cause__ or error.__context__
    return ""


def answered(job: str, path: Path, asked: Mapping[str, Any]) -> Iterator[Frame]:
    """A job's frames, with what is raised as a last frame: what was refused, which limit was met, or the words."""
    try:
        yield from import_module(JOBS[job]).frames(path, **asked)
    except FlightError as error:
        yield {"refused": (error.problem, error.channel, error.hint)}, b""
    except Exception as error:
        met = limit_met(error)
        yield {"limit": met} if met else {"failed": str(error) or type(error).__name__}, b""


def _limit(may: Mapping[str, Any]) -> None:
    """The limits for the next file: what this process has taken before does not count."""
    if resource is None:
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    had = 0
    with suppress(OSError, ValueError, IndexError), open("/proc/self/statm", "rb") as pages:
        had = int(pages.read().split()[5]) * resource.getpagesize()
    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + 1 + may["processor"]),
        (resource.RLIMIT_DATA, had + may["memory"]),
        (resource.RLIMIT_FSIZE, may["disk"]),
    ):
        with suppress(OSError, ValueError):  # a lower limit of the system stays
            resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))


def main() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started it ends it
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a library prints is no answer
    for line in sys.stdin.buffer:
        question = json.loads(line)
        tempfile.tempdir = question["scratch"]
        _limit(question["limits"])
        for head, content in answered(question["job"], Path(question["path"]), question["asked"]):
            text = json.dumps(head).encode()
            out.write(len(text).to_bytes(8, "little") + text)
            out.write(content)
        out.flush()


if __name__ == "__main__":
    main()
