"""The C compiler of this machine, where there is one, on sources that this package has written."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from swashplate.errors import ExportError
from swashplate.systems import end_with_children

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror")


NATIVE = "-march=native"
PATIENCE = 5.0
"""s until it must have said what it is, which takes it 0.02 s."""
_BY_HAND = "Try it by hand (`cc --version`), or take it off the PATH: then it is done without."
LIMIT = 300.0
"""s that the compiler may take; a filter of a Raptor 50 takes it one second of processor time."""


def compiler() -> tuple[str, ...] | None:
    """The words that start a C compiler: `cc`, `gcc` or `clang` by its absolute path, else that of the package ziglang
    (extra `compiler`); None where there is none. What lies in the folder one works in is none of them."""
    paths = (shutil.which(name) for name in ("cc", "gcc", "clang"))
    if path := next((path for path in paths if path is not None and os.path.isabs(path)), None):
        return (path,)
    return ziglang()


def ziglang() -> tuple[str, ...] | None:
    """The words that start the C compiler of the package ziglang, for other systems too; None without."""
    return (sys.executable, "-I", "-m", "ziglang", "cc") if find_spec("ziglang") is not None else None


def web_compiler() -> tuple[str, ...] | None:
    """The words that start a C compiler which makes WebAssembly: ziglang, or clang beside wasm-ld; None without."""
    clang, linker = (shutil.which(name) for name in ("clang", "wasm-ld"))
    beside = clang is not None and linker is not None and os.path.isabs(clang) and os.path.isabs(linker)
    return ziglang() or ((clang,) if clang is not None and beside else None)


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
            end_with_children(process, at_once=True)  # a compiler starts others, which would hold the pipes open
            if not isinstance(error, subprocess.TimeoutExpired):
                raise
            raise ExportError(
                f"the C compiler {command[0]} has not ended after {seconds:g} s.",
                where=where,
                hint=_BY_HAND,
            ) from None
    return process.returncode, out.decode("utf-8", "replace"), err.decode("utf-8", "replace")


@lru_cache(maxsize=4)
def answer(program: tuple[str, ...]) -> tuple[str, str]:
    """What a compiler takes this processor for, and why it cannot be used, "" where it can; asked once a process."""
    asked = [*program, NATIVE, "-dM", "-E", "-x", "c", os.devnull]
    try:
        return ran(asked, where="the processor's instructions", seconds=PATIENCE)[1], ""
    except ExportError as error:
        return "", f"{error.problem} {error.hint or ''}".strip()


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
        raise ExportError("there is no C compiler here (cc, gcc or clang, or the extra 'compiler').", where=out.name)
    if useless := answer(program)[1]:
        raise ExportError(useless, where=out.name)
    known = [
        option for option in options if option != NATIVE or answer(program)[0]
    ]  # some refuse it on some processors
    command = [*program, *STRICT, "-fPIC", "-shared", *known, "-o", str(out), *(str(file) for file in sources), "-lm"]
    named = " ".join(program)
    code, _, said = ran(command, where=out.name)
    if code != 0:
        raise ExportError(
            f"{named} refused the exported sources: {said.strip()[:300]}",
            where=out.name,
            hint="Please report this with the model.",
        )
    if not out.is_file():
        raise ExportError(
            f"{' '.join(program)} says that all is well, and wrote nothing.", where=out.name, hint=_BY_HAND
        )
    return out
