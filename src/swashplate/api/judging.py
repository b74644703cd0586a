"""What no value of a question's field may be, however it was given: each judge returns the value, or refuses it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from swashplate.errors import SwashError

SHORTEST_DELAY = 0.5
"""ms: a number below it was meant in seconds."""


def judge_number(value: Any, called: str) -> float:
    """A finite number, and no truth value."""
    try:
        number = math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise SwashError(f"is {value!r}, expected a number.", channel=called)
    return number


def judge_whole(value: Any, called: str) -> int:
    number = judge_number(value, called)
    if number != int(number):
        raise SwashError(f"is {value!r}, expected a whole number.", channel=called)
    return int(number)


def judge_flag(value: Any, called: str) -> bool:
    if getattr(value, "ndim", 0) or value not in (True, False):
        raise SwashError(f"is {value!r}, expected true or false.", channel=called)
    return bool(value)


def judge_mapping(value: Any, called: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise SwashError(f"is {value!r}, expected values by name.", channel=called)
    return value


def judge_numbers(value: Any, called: str) -> Mapping[str, float]:
    return {name: judge_number(one, f"{called} {name}") for name, one in judge_mapping(value, called).items()}


def judge_start(value: Any, called: str) -> Any:
    """A trim, or states by name."""
    from swashplate.simulation.trim import Trim

    return value if isinstance(value, Trim) else judge_numbers(value, called)


def judge_noise(value: Any, called: str) -> Any:
    """A noise, or numbers of it by name."""
    from swashplate.filtering.disturbances import Noise

    return value if isinstance(value, Noise) else judge_numbers(value, called)


def judge_speeds(value: Any, called: str) -> Any:
    """One speed, or several."""
    several = isinstance(value, Sequence) or getattr(value, "ndim", 0)
    return tuple(judge_number(one, called) for one in value) if several else judge_number(value, called)


def judge_wind(value: Any, called: str) -> Any:
    """A wind towards north, east and down, each a finite number or a series of them."""
    import numpy as np

    count = len(value) if isinstance(value, Sequence) or getattr(value, "ndim", 0) else 0
    if count != 3:
        given = f"has {count} parts" if count else f"is {value}"
        raise SwashError(f"{given}, expected three: towards north, east and down [m/s].", channel=called)
    for part, name in zip(value, ("north", "east", "down"), strict=True):
        if not np.all(np.isfinite(np.asarray(part, dtype=float))):
            raise SwashError(f"towards {name} is not finite.", channel=called)
    return value


def judge_delays(value: Mapping[str, float] | float, called: str) -> Mapping[str, float] | float:
    """Delays in ms; what can only be seconds is refused."""
    for name, given in (value if isinstance(value, Mapping) else {"": value}).items():
        one = judge_number(given, f"{called} {name}".rstrip())
        shown = f"{name}={one:g}" if name else f"{one:g}"
        if not 0.0 <= one <= 1000.0:
            raise SwashError(f"is {shown} ms, expected 0 to 1000.", channel=called)
        if 0.0 < one < SHORTEST_DELAY:
            hint = f"{1e3 * one:g} for {one:g} s."
            raise SwashError(f"is {shown} ms, expected 0, or {SHORTEST_DELAY:g} or more.", channel=called, hint=hint)
    return value


def judge_environment(value: Any, called: str) -> Any:
    """An environment of its numbers by name; one as it is."""
    from swashplate.physics.environment import Environment

    for name in value if isinstance(value, Mapping) else ():
        if name not in Environment._fields:
            raise SwashError(f"'{name}' is unknown, expected one of {', '.join(Environment._fields)}.", channel=called)
    if isinstance(value, Environment):
        return value
    return Environment(**judge_numbers(value, called))


def judge_names(value: Any, called: str) -> Any:
    """Texts; a mapping or an object of its own is the verb's business."""
    if isinstance(value, Sequence) and all(isinstance(one, str) for one in value):
        return value
    raise SwashError(f"is {value!r}, expected names.", channel=called)


def judge_object(value: Any, called: str) -> Any:
    """A name, a file or an object, or several; no number."""
    for one in value if isinstance(value, list | tuple) else (value,):
        if isinstance(one, bool | int | float) or (isinstance(one, Mapping) and not one):
            raise SwashError(f"is {one!r}, expected a name, a file or an object.", channel=called)
    return value


def judge_bands(value: Any, called: str) -> Any:
    """One band [Hz], or several by name."""
    for name, one in value.items() if isinstance(value, Mapping) else [("", value)]:
        edges = [judge_number(edge, called) for edge in one] if isinstance(one, Sequence) else []
        if len(edges) != 2 or not 0.0 < edges[0] < edges[1]:
            shown = f"{name}={one!r}" if name else repr(one)
            raise SwashError(f"is {shown}, expected two rising numbers above zero [Hz].", channel=called)
    return value
