"""C of this package as a loaded library: compiled once on this machine, kept in the user's cache folder."""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import platformdirs

from swashplate.atomic import scratch_folder
from swashplate.compiler import LIMIT, compiler, ran, shared_library
from swashplate.errors import WriteError

NATIVE = "-march=native"


def can_compile() -> bool:
    """Whether this machine has CasADi and a C compiler."""
    return compiler() is not None and find_spec("casadi") is not None


def loaded(source: str, *, options: Sequence[str]) -> ctypes.CDLL:
    """The library of a source: from the cache, compiled where it is missing or does not load.

    It lies under the digest of source, compiler and options, and of this processor where it is compiled for it alone.

    Raises:
        ExportError: without a compiler, or where it refuses the source.
    """
    told = "\0".join((source, compiler() or "", *options, _processor(compiler()) if NATIVE in options else ""))
    folder = Path(platformdirs.user_cache_dir("swashplate")) / "c"
    library = folder / f"{hashlib.sha256(told.encode()).hexdigest()[:32]}.so"
    if library.is_file():
        try:
            return ctypes.CDLL(str(library))
        except OSError:  # damaged: made anew
            library.unlink(missing_ok=True)
    with ExitStack() as keeping:
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            made = keeping.enter_context(scratch_folder(folder))
        except (OSError, WriteError):  # nothing can be kept
            made = keeping.enter_context(scratch_folder())
        text, place = made / "body.c", made / "body.so"
        text.write_text(source, encoding="utf-8")
        shared_library([text], place, options=options)
        if made.parent == folder:
            os.replace(place, library)
            place = library
        return ctypes.CDLL(str(place))  # what is loaded stays when its file goes


@lru_cache(maxsize=4)
def _processor(program: str | None) -> str:
    """What the compiler takes this processor for: a cache may be shared with one that knows fewer instructions."""
    if program is None:
        return ""
    asked = [program, NATIVE, "-dM", "-E", "-x", "c", os.devnull]
    return ran(asked, where="the processor's instructions", seconds=LIMIT / 10.0)[1]
