"""Units as powers of the base units, as FMI wants them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

_DEGREE = math.pi / 180.0
_KNOWN: dict[str, tuple[float, dict[str, int]]] = {
    "m": (1.0, {"m": 1}),
    "s": (1.0, {"s": 1}),
    "ms": (1e-3, {"s": 1}),
    "kg": (1.0, {"kg": 1}),
    "A": (1.0, {"A": 1}),
    "K": (1.0, {"K": 1}),
    "rad": (1.0, {"rad": 1}),
    "deg": (_DEGREE, {"rad": 1}),
    "ft": (0.3048, {"m": 1}),
    "Hz": (1.0, {"s": -1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "J": (1.0, {"kg": 1, "m": 2, "s": -2}),
    "W": (1.0, {"kg": 1, "m": 2, "s": -3}),
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "1": (1.0, {}),
}
_TOKEN = re.compile(r"\s*([A-Za-z]+|1|\^-?\d+|/|\(|\)|\*)\s*")


def base_units(unit: str) -> tuple[float, dict[str, int]] | None:
    """Factor to SI and powers of the base units of e.g. "N s^2/rad^2" or "rad/(m s)"; None where it is not known.

    A slash divides by what comes next, a single unit or a pair of brackets.
    """
    tokens = _TOKEN.findall(unit)
    if not tokens or "".join(tokens) != re.sub(r"\s", "", unit):
        return None
    rest = iter([*tokens, ")"])
    try:
        factor, powers = _product(rest)
    except (KeyError, StopIteration):
        return None
    if next(rest, None) is not None:  # a bracket that closes nothing
        return None
    return factor, {name: power for name, power in powers.items() if power}


def _product(tokens: Iterator[str]) -> tuple[float, dict[str, int]]:
    """What stands up to the closing bracket."""
    total, powers = 1.0, dict[str, int]()
    last: tuple[float, dict[str, int]] | None = None
    turned = sign = 1

    def take(part: tuple[float, dict[str, int]], power: int) -> None:
        nonlocal total
        total *= part[0] ** power
        for name, own in part[1].items():
            powers[name] = powers.get(name, 0) + own * power

    for token in tokens:
        if token == ")":
            return total, powers
        if token == "/":
            turned = -1
        elif token.startswith("^"):  # the unit itself has been taken once
            if last is None:
                raise KeyError(token)
            take(last, sign * (int(token[1:]) - 1))
        elif token != "*":
            last = _product(tokens) if token == "(" else _KNOWN[token]
            sign, turned = turned, 1
            take(last, sign)
    raise StopIteration
