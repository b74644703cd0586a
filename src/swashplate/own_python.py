"""Python processes of this package: they import from where this one imports, and never from the folder they work in."""

from __future__ import annotations

import os
import sys
from typing import Final

SAFE_PATH: Final = {"PYTHONSAFEPATH": "1"}
"""Environment of a Python process whose command line somebody else writes (`multiprocessing`): as the option `-P`."""


def own_python(module: str, *arguments: str) -> list[str]:
    """Command that runs the function `main` of a module of this package in a Python process of its own.

    Python puts the folder that a process works in first on its path (for `-c`, and for `-m`). There lie the logs of
    strangers, and a `typing.py` among them would be run. The option `-P` leaves that folder out, and the path is that
    of this process, without the empty entry that a Python session has for the folder that it works in.

    Args:
        module: such as "swashplate.__main__".
        arguments: what `sys.argv` has after its first entry.
    """
    path = [os.path.abspath(entry) for entry in sys.path if entry]
    code = f"import sys; sys.path[:] = {path!r}; from {module} import main; main()"
    return [sys.executable, "-P", "-c", code, *arguments]
