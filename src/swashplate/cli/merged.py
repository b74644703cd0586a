"""Options that belong together as one argument of a verb."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any


def merged(group: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Replace a verb's last argument before its flags by the options that a function makes it from.

    Args:
        group: from options to the argument; the verb's argument has the function's name.
    """
    shared = inspect.signature(group, eval_str=True).parameters

    def decorate(verb: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(verb, eval_str=True).parameters
        place = group.__name__

        @functools.wraps(verb)
        def command(**given: Any) -> None:
            made = group(**{name: given.pop(name) for name in shared})
            verb(**given, **{place: made})

        entries: list[inspect.Parameter] = []
        for name, entry in own.items():
            entries += shared.values() if name == place else [entry]
        parameters = [entry.replace(kind=inspect.Parameter.KEYWORD_ONLY) for entry in entries]
        command.__signature__ = inspect.Signature(parameters)  # pyrefly: ignore[missing-attribute]
        command.__annotations__ = {entry.name: entry.annotation for entry in parameters}
        return command

    return decorate
