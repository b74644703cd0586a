"""What a worker's process is: which versions compute, on which core, with which settings of the libraries."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import socket
import threading
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import metadata, resources
from pathlib import Path

from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.errors import CampaignError, SwashError
from swashplate.extras import version_of
from swashplate.threads import ONE_THREAD

_LIBRARIES = ("swashplate", "casadi", "numpy", "scipy")
_FIRST_PROCESSES = 0xEFFFFFFC
"""Number of the namespace of processes that Linux starts with (`PROC_PID_INIT_INO`); containers have others."""
_LOCK = "\0swashplate-core-"
"""What the names of locks begin with; the zero byte keeps them off the disk (abstract sockets of Linux)."""
_held: list[tuple[int, socket.socket | None]] = []
"""The core that this process has pinned itself to, and its lock."""


def program() -> dict[str, str]:
    """What a result depends on beside its task, by name: versions, our own source, and whether its equations are C."""
    return dict(_versions())


@cache
def _versions() -> tuple[tuple[str, str], ...]:
    versions = {"python": ".".join(platform.python_version_tuple()[:2])} | {
        name: version_of(name) for name in _LIBRARIES
    }
    versions["equations"] = "compiled C" if _c_runs() else "CasADi's virtual machine"
    every = metadata.entry_points()
    for group in (name for name in every.groups if name.startswith("swashplate.")):
        for point in every.select(group=group):  # packages that bring models, estimators or kinds of their own
            if point.dist is not None:
                versions[point.dist.name] = point.dist.version
    return tuple({**versions, "source": _source()}.items())


def _c_runs() -> bool:
    """Whether equations can be C here: with CasADi, and a compiler that has its headers."""
    if not can_compile():
        return False
    try:
        loaded("#include <math.h>\ndouble swash_root(double x) { return sqrt(x); }\n", options=(NATIVE,))
    except (SwashError, OSError):
        return False
    return True


def _source() -> str:
    """SHA-256 of the package's equations and cards, shortened: a changed file is another program."""
    home, digest = Path(str(resources.files("swashplate"))), hashlib.sha256()
    for place in sorted(path for path in home.rglob("*") if path.suffix in (".py", ".toml", ".c", ".h")):
        digest.update(str(place.relative_to(home)).encode() + b"\0" + place.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def differences(wanted: Mapping[str, str], actual: Mapping[str, str]) -> list[str]:
    """What differs between two programs, in words; empty where nothing does."""
    names = sorted({*wanted, *actual})
    pairs = [(name, actual.get(name, "nothing"), wanted.get(name, "nothing")) for name in names]
    return [f"{name} is {is_ or 'empty'}, expected {expected or 'empty'}" for name, is_, expected in pairs
            if is_ != expected]  # fmt: skip


def check_program(wanted: Mapping[str, str], *, where: str) -> None:
    """That this process is the program that a task was made for.

    Raises:
        CampaignError: with what differs; results of two programs must not share a table.
    """
    differing = differences(wanted, program())
    if differing:
        raise CampaignError(
            f"the worker has another program: {'; '.join(differing)}.",
            where=where,
            hint="Install the same versions there, and run `swash campaign resume`.",
        )


def prepare() -> int | None:
    """Make this process a worker: one thread, and one core of its own; returns the core. A second call does nothing.

    Cores are shared out by locks, one a core, among all workers of a machine whoever started them: the lock goes when
    the process ends, however it ends. Where all are taken, two workers share one. In a container no core is chosen:
    workers of two containers would all choose the first, so the machine shares its cores out itself.
    """
    if _held:
        return _held[0][0]
    os.environ |= ONE_THREAD
    if not hasattr(os, "sched_setaffinity") or _in_container():
        return None
    cores = sorted(os.sched_getaffinity(0))
    _held.append(next(_free(cores), (cores[os.getpid() % len(cores)], None)))
    core = _held[0][0]
    for thread in [int(name) for name in os.listdir("/proc/self/task")] if os.path.isdir("/proc/self/task") else [0]:
        with contextlib.suppress(OSError):
            os.sched_setaffinity(thread, {core})
    return core


def _in_container() -> bool:
    """Whether this process sees only a part of the machine's processes: what it locks, other containers do not see."""
    try:
        return os.stat("/proc/self/ns/pid").st_ino != _FIRST_PROCESSES
    except OSError:
        return True


def _free(cores: list[int]) -> Iterator[tuple[int, socket.socket]]:
    """A core that no other worker holds, with its lock: a socket's name that only one process of a machine can have."""
    for core in cores:
        lock = socket.socket(socket.AF_UNIX)
        try:
            lock.bind(f"{_LOCK}{core}")
        except OSError:
            lock.close()
            continue
        yield core, lock
        return


def end_with_parent() -> None:
    """Let this process end when the one that started it does, killed or not: nobody would take its results."""
    from multiprocessing import parent_process

    parent = parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True, name="parent").start()
