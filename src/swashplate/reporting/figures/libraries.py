"""The drawing libraries, loaded when something is drawn; where one is missing, the command that installs it."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from swashplate.errors import SwashError


def library(module: str) -> Any:
    """The module of this name.

    Raises:
        SwashError: where it is not installed, with the command.
    """
    name = module.partition(".")[0]
    try:
        return import_module(module)
    except ImportError:
        raise SwashError(
            f"drawing this needs the library {name}, which is not installed here.",
            hint=f"Install it with: pip install {name}",
        ) from None
