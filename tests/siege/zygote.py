"""A process that has loaded the program once and forks for every command, with tests/siege/injected.c preloaded.

Lines in and out are JSON: `{"arguments", "folder", "mode", "stop", "error", "log", "seconds", "cwd", "stopped",
"unprivileged"}`, and `{"code", "calls", "hang", "seconds"}`, the code as of `os.waitstatus_to_exitcode`, the seconds of
the processor. Arguments are the modules to load; all of them where there are none.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import os
import pkgutil
import signal
import socket
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import swashplate
from swashplate import atomic

Checkpoint = Callable[[], tuple[dict[str, Any], int]]


def _speak(asked: dict[str, Any]) -> None:
    log = os.open(asked["log"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for descriptor in (1, 2):
        os.dup2(log, descriptor)


def _give_up_rights() -> None:
    """The capabilities by which a superuser reads and writes what its permissions forbid."""
    header = (ctypes.c_uint32 * 2)(0x20080522, 0)
    ctypes.CDLL(None).capset(header, (ctypes.c_uint32 * 6)())


def _arm(asked: dict[str, Any]) -> Any:
    siege = ctypes.CDLL(None)
    siege.siege_calls.restype = ctypes.c_long
    siege.siege_arm(asked["folder"].encode(), asked["mode"], ctypes.c_long(asked["stop"]), asked["error"])
    return siege


def _run(asked: dict[str, Any], told: int, checkpoint: Checkpoint | None = None) -> None:
    """In the child: the command, and how many calls it made. With a checkpoint it stops where it first wants to write,
    and goes on from there in forks of its own."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    _speak(asked)
    os.chdir(asked["cwd"])
    if asked.get("unprivileged"):
        _give_up_rights()
    where, siege = [told], ctypes.CDLL(None)
    siege.siege_calls.restype = ctypes.c_long
    if checkpoint is None:
        _arm(asked)
    else:
        sweep = atomic.sweep

        def stopping(*given: Any, **named: Any) -> Any:
            if atomic.sweep is stopping:
                atomic.sweep = sweep
                now, where[0] = checkpoint()
                _speak(now)
                _arm(now)
            return sweep(*given, **named)

        atomic.sweep = stopping
    sys.argv = ["swash", *asked["arguments"]]
    code: Any = 0
    try:
        from swashplate.cli.app import main

        main()
    except SystemExit as ended:
        code = ended.code
    with contextlib.suppress(Exception):
        sys.stdout.flush()
        sys.stderr.flush()
    calls = siege.siege_calls()
    siege.siege_arm(b"", 0, ctypes.c_long(0), 0)
    os.write(where[0], str(calls).encode())
    os._exit(code if isinstance(code, int) else 0 if code is None else 1)


def _watched(asked: dict[str, Any], run: Callable[[int], None]) -> dict[str, Any]:
    """Forks, and waits for how that ends; `run` is what the child does, and it may return to go on as the child."""
    hear, told = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # JAX warns of forks; it has no threads before it computes
        child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        os.close(hear)
        run(told)
        return {"child": told}
    os.close(told)
    until, hang = time.monotonic() + asked["seconds"], False
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > until:
            hang = True
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.002)
    with contextlib.suppress(ProcessLookupError):  # compilers that it started
        os.killpg(child, signal.SIGKILL)
    calls = os.read(hear, 64).decode()
    os.close(hear)
    told = {"code": os.waitstatus_to_exitcode(status), "calls": int(calls or -1), "hang": hang}
    return told | {"seconds": used.ru_utime + used.ru_stime}


class _Stopped:
    """A command that has done its work and waits where it first wants to write; each strike is a fork of it."""

    def __init__(self, asked: dict[str, Any]) -> None:
        here, there = socket.socketpair()
        self._process = os.fork()
        if self._process == 0:
            here.close()
            lines = there.makefile("rw")

            def checkpoint() -> tuple[dict[str, Any], int]:
                for line in lines:
                    now = json.loads(line)
                    found = _watched(now, lambda told: None)
                    if "child" in found:
                        return now, found["child"]
                    print(json.dumps(found), file=lines, flush=True)
                os._exit(0)

            try:
                _run(asked, os.open(os.devnull, os.O_WRONLY), checkpoint)
            finally:
                os._exit(99)
        there.close()
        self._lines = here.makefile("rw")

    def struck(self, asked: dict[str, Any]) -> dict[str, Any]:
        print(json.dumps(asked), file=self._lines, flush=True)
        found: dict[str, Any] = json.loads(self._lines.readline() or '{"code": 99, "calls": -1, "hang": true}')
        return found


def _ended(asked: dict[str, Any], told: int) -> None:
    try:
        _run(asked, told)
    finally:
        os._exit(99)


def main() -> None:
    usual = ("h5netcdf", "casadi", "matplotlib.pyplot", "matplotlib.backends.backend_svg", "control")
    for name in sys.argv[1:] or usual:
        importlib.import_module(name)
    for found in pkgutil.walk_packages(swashplate.__path__, "swashplate.") if not sys.argv[1:] else ():
        if not found.name.endswith(("__main__", ".nuts")):  # BlackJAX starts JAX's threads, which no fork survives
            importlib.import_module(found.name)
    if len(os.listdir("/proc/self/task")) > 1:
        sys.exit("A module of swashplate starts threads when it is imported: commands would hang after a fork.")
    answers, stopped = os.fdopen(os.dup(1), "w"), {}
    for line in sys.stdin:
        asked = json.loads(line)
        if asked.get("stopped"):
            words = tuple(asked["arguments"])
            if words not in stopped:
                stopped[words] = _Stopped(asked)
            found = stopped[words].struck(asked)
        else:
            found = _watched(asked, partial(_ended, asked))
        print(json.dumps(found), file=answers, flush=True)


if __name__ == "__main__":
    main()
