"""What some systems have and others lack, asked for in this one place: limits, locks, flags of files, signals.

Windows has neither `fcntl` nor `resource`, and not all signals. Nothing else in the package asks for them, so that it
runs there (a test hides them all).
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any, Final


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, fcntl, msvcrt = _module("resource"), _module("fcntl"), _module("msvcrt")

NOT_WAITING: Final[int] = getattr(os, "O_NONBLOCK", 0)
"""Flag of `os.open`: a pipe is not waited for."""
NO_LINK: Final[int] = getattr(os, "O_NOFOLLOW", 0)
BYTES: Final[int] = getattr(os, "O_BINARY", 0)
"""Flag of `os.open`: line ends stay as they are."""
READ_AT: Final[Callable[[int, int, int], bytes] | None] = getattr(os, "pread", None)
"""Reads of an open file so many bytes from a place on."""
HANGUP: Final[signal.Signals | None] = getattr(signal, "SIGHUP", None)
"""The terminal is closed."""
OUT_OF_TIME: Final[signal.Signals | None] = getattr(signal, "SIGXCPU", None)
"""A process has had its time of the processor."""
HOLDS: Final = fcntl is not None
"""Whether a folder, or a file that is about to be renamed, can be locked."""
_FAR = 0x7FFFFFFE  # a byte that no lock file has: what Windows locks, nobody else can read


def lock(descriptor: int, *, wait: bool = False, shared: bool = False) -> None:
    """Lock an open file; the system drops the lock when the file is closed or the process ends, however it ends.

    Args:
        descriptor: of the file.
        wait: for another process that has it.
        shared: with others that share it, too; Windows shares with nobody.

    Raises:
        OSError: where another process has it, or the file system has no locks.
    """
    if fcntl is not None:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))
    elif msvcrt is not None:
        place = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(descriptor, place, os.SEEK_SET)


def end_with_children(process: subprocess.Popen[bytes], *, at_once: bool) -> None:
    """End a process that was started in a session of its own, and what it has started, where the system can.

    Args:
        process: started with `start_new_session`.
        at_once: without a chance to clean up.
    """
    with suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL if at_once else signal.SIGTERM)
        elif at_once:
            process.kill()
        else:
            process.terminate()


def step_back(process: int) -> None:
    """Let a process run after ordinary ones, where the system can."""
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process, 10)


def free_memory() -> None:
    """Hand memory that nothing uses back to the system, where the C library keeps it for later (glibc)."""
    if sys.platform == "linux":
        import ctypes  # not before it is needed

        with suppress(OSError, AttributeError):  # musl has none
            ctypes.CDLL(None).malloc_trim(0)
