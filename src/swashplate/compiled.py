"""C of this package as a loaded library: compiled once on this machine, kept in the user's cache folder."""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache
from importlib.util import find_spec

from swashplate.atomic import scratch_folder
from swashplate.compiler import NATIVE, answer, compiler, shared_library
from swashplate.errors import ExportError, WriteError
from swashplate.kept import cache_folder
from swashplate.visible import visible


def can_compile() -> bool:
    """Whether this machine has CasADi and a C compiler; of none that can be used standard error is told, once."""
    return find_spec("casadi") is not None and _is_useful(compiler())


@lru_cache(maxsize=4)
def _is_useful(program: tuple[str, ...] | None) -> bool:
    useless = _NONE if program is None else answer(program)[1]
    if useless:
        print(visible(f"No C is compiled: {useless} This takes some ten times as long without."), file=sys.stderr)
    return not useless


_NONE = "there is no C compiler here. pip install 'swashplate[compiler]' brings one."


def loaded(source: str, *, options: Sequence[str]) -> ctypes.CDLL:
    """The library of a source: from the cache, compiled where it is missing or does not load.

    It lies under the digest of source, compiler and options, and of this processor where it is compiled for it alone.

    Raises:
        ExportError: without a compiler, where it refuses the source, or where what it made does not load.
    """
    program = compiler() or ()
    told = "\0".join((source, *program, *options, answer(program)[0] if program and NATIVE in options else ""))
    folder, name = cache_folder("c"), f"{hashlib.sha256(told.encode()).hexdigest()[:32]}.so"
    library = None if folder is None else folder / name
    if library is not None and library.is_file():
        try:
            return ctypes.CDLL(str(library))
        except OSError:  # damaged: made anew
            library.unlink(missing_ok=True)
    with ExitStack() as keeping:
        try:
            made = keeping.enter_context(scratch_folder(folder))
        except WriteError:  # nothing can be kept
            made = keeping.enter_context(scratch_folder())
        text, place = made / "body.c", made / "body.so"
        text.write_text(source, encoding="utf-8")
        shared_library([text], place, options=options)
        try:
            made_now = ctypes.CDLL(str(place))  # what is loaded stays when its file goes
        except OSError as error:
            raise ExportError(f"what {' '.join(program)} made does not load: {error}.", where=place.name) from None
        if library is not None and made.parent == folder:
            os.replace(place, library)
        return made_now
