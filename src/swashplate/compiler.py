"""The C compiler of this machine, where there is one, on sources that this package has written."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from swashplate.errors import ExportError

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror")


def compiler() -> str | None:
    """The path of `cc`, `gcc` or `clang`, or None."""
    return next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)


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
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ExportError(
            f"{program} refused the exported sources: {done.stderr.strip()[:300]}",
            where=out.name,
            hint="Please report this with the model.",
        )
    return out
