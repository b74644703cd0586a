"""Libraries that come only with `pip install swashplate[logs]`, loaded when a log needs them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from swashplate.errors import FlightError


def needed(module: str, *, where: str, kind: str) -> Any:
    """The module of this name.

    Args:
        module: its full name.
        where: the log that needs it, and its kind in words, for the error.

    Raises:
        FlightError: where it is not installed, saying how to get it.
    """
    try:
        return import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise FlightError(
            f"is a {kind}, which needs the library {library}.",
            where=where,
            hint="Install it with: pip install swashplate[logs]",
        ) from None
