"""A process that has loaded the program once and forks for every command, with tests/siege/injected.c preloaded.

Lines in and out are JSON: `{"arguments", "folder", "mode", "stop", "error", "log", "seconds", "cwd"}`, and
`{"code", "calls", "hang"}`, the code as of `os.waitstatus_to_exitcode`. Arguments are the modules to load; all of them
where there are none.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import os
import pkgutil
import signal
import sys
import time
import warnings
from typing import Any

import swashplate


def _run(asked: dict[str, Any], told: int) -> None:
    """In the child: the command, and how many calls it made."""
    log = os.open(asked["log"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    null = os.open(os.devnull, os.O_RDONLY)
    for descriptor, to in ((0, null), (1, log), (2, log)):
        os.dup2(descriptor if to < 0 else to, descriptor)
    os.chdir(asked["cwd"])
    siege = ctypes.CDLL(None)
    siege.siege_calls.restype = ctypes.c_long
    siege.siege_arm(asked["folder"].encode(), asked["mode"], ctypes.c_long(asked["stop"]), asked["error"])
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
    os.write(told, str(calls).encode())
    os._exit(code if isinstance(code, int) else 0 if code is None else 1)


def _watched(asked: dict[str, Any]) -> dict[str, Any]:
    hear, told = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # JAX warns of forks; it has no threads before it computes
        child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        os.close(hear)
        try:
            _run(asked, told)
        finally:
            os._exit(99)
    os.close(told)
    until, hang = time.monotonic() + asked["seconds"], False
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > until:
            hang = True
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.01)
    with contextlib.suppress(ProcessLookupError):  # compilers that it started
        os.killpg(child, signal.SIGKILL)
    calls = os.read(hear, 64).decode()
    os.close(hear)
    return {"code": os.waitstatus_to_exitcode(status), "calls": int(calls or -1), "hang": hang}


def main() -> None:
    usual = ("h5netcdf", "jax", "jax.numpy", "matplotlib.pyplot", "matplotlib.backends.backend_svg", "control")
    for name in sys.argv[1:] or usual:
        importlib.import_module(name)
    for found in pkgutil.walk_packages(swashplate.__path__, "swashplate.") if not sys.argv[1:] else ():
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
    answers = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        print(json.dumps(_watched(json.loads(line))), file=answers, flush=True)


if __name__ == "__main__":
    main()
