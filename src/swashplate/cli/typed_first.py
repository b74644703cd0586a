"""What was typed is judged before what was not: a wrong name comes ahead of a missing option."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from swashplate.errors import SwashError


def refuse_wrong_names(command: Any, given: Mapping[str, Any]) -> None:
    """Look at the files and vehicles that a line names, where an option is missing.

    Args:
        command: of click. given: the values that were read so far, by parameter.

    Raises:
        SwashError: for the first that is not there, as its verb would say it.
    """
    for parameter in command.params:
        values = given.get(parameter.name)
        look = _LOOKS.get(parameter.name)
        if look is None or values is None or parameter.opts[0] == "--out":
            continue
        for value in values if isinstance(values, list | tuple) else (values,):
            look(str(value))


def _log(text: str) -> None:
    from swashplate.flights.datasets import locate
    from swashplate.flights.readers.options import split_log, split_window

    _place(locate(split_log(split_window(text)[0])[0]))


def _vehicle(text: str) -> None:
    from swashplate.models.catalogue import vehicle

    if not Path(text).exists():  # what is wrong in a file is the verb's to say
        vehicle(text)


def _place(path: str | Path) -> None:
    if not Path(path).exists():
        raise SwashError("there is no such file or folder.", where=path, hint="Check the path.")


_LOOKS: Mapping[str, Callable[[str], None]] = {
    **dict.fromkeys(("log", "logs", "flight", "hold_out", "replay"), _log),
    **dict.fromkeys(("vehicle", "model"), _vehicle),
    **dict.fromkeys(("responses", "file", "folder", "points", "binary", "mapping", "controller"), _place),
}
"""How a name is looked at, by the parameter that holds it."""
