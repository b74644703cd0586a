"""What a worker's process is: which versions compute."""

from __future__ import annotations

import hashlib
import os
import platform
import threading
from collections.abc import Mapping
from functools import cache
from importlib import metadata, resources
from pathlib import Path

from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.errors import CampaignError, SwashError
from swashplate.extras import version_of

_LIBRARIES = ("swashplate", "casadi", "numpy", "scipy")


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


def end_with_parent() -> None:
    """Let this process end when the one that started it does, killed or not: nobody would take its results."""
    from multiprocessing import parent_process

    parent = parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True, name="parent").start()
