"""What a page may say: every message is checked against this table before anything looks at it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

from swashplate.errors import SwashError
from swashplate.links.live.identifying import HOWS

LONGEST = 2048
"""Characters of a message."""

Check = Callable[[Any], bool]


def _integer(low: int, high: int) -> Check:
    return lambda value: isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def _one_of(*allowed: Any) -> Check:
    return lambda value: isinstance(value, str) and value in allowed


def _switch(value: Any) -> bool:
    return isinstance(value, bool)


SCHEMA: Mapping[str, Mapping[str, Check]] = {
    "bar": {"value": _switch},
    "record": {"value": _switch},
    "identify": {"recording": _integer(1, 10_000), "how": _one_of(*HOWS)},
    "stop_identifying": {},
    "learn": {},
}
"""Fields and their checks by type; a message has exactly these and its `type`."""


class MessageError(SwashError):
    """A message that the schema does not allow."""


def parse(text: str) -> dict[str, Any]:
    """A message as its fields, `type` among them.

    Raises:
        MessageError: saying in a word what is wrong; never anything else, whatever the text.
    """
    if len(text) > LONGEST:
        raise MessageError("too long")
    try:
        message = json.loads(text, parse_constant=_refuse, parse_float=_finite)
    except (ValueError, RecursionError):
        raise MessageError("no JSON") from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise MessageError("no type")
    schema = SCHEMA.get(message["type"])
    if schema is None:
        raise MessageError("unknown type")
    if message.keys() != {"type", *schema}:
        raise MessageError("missing or unknown fields")
    for name, check in schema.items():
        if not check(message[name]):
            raise MessageError(f"{message['type']}: bad {name}")
    return message


def _refuse(word: str) -> float:
    raise ValueError(word)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value
