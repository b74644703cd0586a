"""A machine without what only POSIX has: Python processes in which `fcntl`, `resource` and signals are hidden."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

MODULES = ("fcntl", "resource", "termios", "pwd", "grp", "tty", "pty", "syslog")
SIGNALS = tuple(
    f"SIG{name}" for name in ("HUP", "XCPU", "XFSZ", "KILL", "ALRM", "CHLD", "USR1", "USR2", "PIPE", "QUIT")
)
OF_OS = tuple(
    """
    O_NONBLOCK O_NOFOLLOW O_CLOEXEC O_DIRECTORY O_SYNC killpg setpriority PRIO_PROCESS nice geteuid getegid getgid fork
    forkpty pwrite pread set_blocking mkfifo mknod statvfs chown fchown fchmod setsid getpgid setpgid sched_setaffinity
    sched_getaffinity sched_setscheduler wait3 wait4 getloadavg
    """.split()  # noqa: SIM905
)
HIDING = f"""
import asyncio, subprocess, tempfile, shutil, socket, multiprocessing.spawn, concurrent.futures, os, signal, sys
subprocess.Popen.kill = lambda process: process.poll() is None and os.kill(process.pid, 9)
for name in {MODULES!r}:
    sys.modules[name] = None
for name in {SIGNALS!r}:
    if hasattr(signal, name):
        delattr(signal, name)
for name in {OF_OS!r}:
    if hasattr(os, name):
        delattr(os, name)
"""
"""`sitecustomize` of every Python process: the standard library is there first, for on Windows it has its own ways."""


def hide_posix(folder: Path) -> dict[str, str]:
    """The environment of such processes; what hides the names lies in the folder."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(HIDING)
    return {**os.environ, "PYTHONPATH": str(folder)}


def started(environment: dict[str, str], here: Path, *words: str) -> str:
    """What a Python process says that ends well and prints no traceback."""
    done = subprocess.run(
        [sys.executable, *words], cwd=here, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout
