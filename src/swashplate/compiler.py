"""The C compiler of this machine, where there is one, on sources that this package has written."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from swashplate.errors import ExportError

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror")


LIMIT = 300.0
"""s that the compiler may take; a filter of a Raptor 50 takes it one second of processor time."""


def compiler() -> str | None:
    """The absolute path of `cc`, `gcc` or `clang`, or None. What lies in the folder one works in is none of them."""
    found = (shutil.which(name) for name in ("cc", "gcc", "clang"))
    return next((path for path in found if path is not None and os.path.isabs(path)), None)


def ran(command: Sequence[str], *, where: str, seconds: float = LIMIT) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of the compiler; what is no UTF-8 in them is replaced.

    Raises:
        ExportError: where it cannot be started, or has not ended after `seconds`; it and what it started are ended.
    """
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
        )
    except OSError as error:
        raise ExportError(f"the C compiler {command[0]} cannot be started: {error.strerror}.", where=where) from None
    with process:
        try:
            out, err = process.communicate(timeout=seconds)
        except BaseException as error:
            _end(process)
            if not isinstance(error, subprocess.TimeoutExpired):
                raise
            raise ExportError(
                f"the C compiler {command[0]} has not ended after {seconds:g} s.",
                where=where,
                hint="Try it by hand (`cc --version`), or take it off the PATH: then nothing is compiled.",
            ) from None
    return process.returncode, out.decode("utf-8", "replace"), err.decode("utf-8", "replace")


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and those of its session: a compiler starts others, which would hold the pipes open."""
    if hasattr(os, "killpg"):
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def shared_library(sources: Sequence[Path], out: Path, *, options: Sequence[str] = ()) -> Path:
    """Compile C files into a shared library.

    Args:
        sources: .c files, compiled from their own folder.
        out: the library.
        options: beside `STRICT`, such as "-fvisibility=hidden".

    Raises:
        ExportError: where there is no compiler, or it refuses the sources.
    """
    program = compiler()
    if program is None:
        raise ExportError("there is no C compiler here (cc, gcc or clang).", where=out.name)
    command = [program, *STRICT, "-fPIC", "-shared", *options, "-o", str(out), *(str(file) for file in sources), "-lm"]
    code, _, said = ran(command, where=out.name)
    if code != 0:
        raise ExportError(
            f"{program} refused the exported sources: {said.strip()[:300]}",
            where=out.name,
            hint="Please report this with the model.",
        )
    return out
