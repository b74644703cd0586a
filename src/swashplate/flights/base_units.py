"""Units as powers of the base units: what a product of units is, and whether it is one at all."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from swashplate.flights.units import is_known

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
    "mm": (1e-3, {"m": 1}),
    "cm": (1e-2, {"m": 1}),
    "in": (0.0254, {"m": 1}),
    "ft": (0.3048, {"m": 1}),
    "us": (1e-6, {"s": 1}),
    "Hz": (1.0, {"s": -1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "J": (1.0, {"kg": 1, "m": 2, "s": -2}),
    "W": (1.0, {"kg": 1, "m": 2, "s": -3}),
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "%": (1e-2, {}),
    "1": (1.0, {}),
}
_TOKEN = re.compile(r"\s*([A-Za-z]+|%|1|\^-?\d|/|\(|\)|\*)\s*")

_LONGEST = 100  # characters of a unit


def base_units(unit: str) -> tuple[float, dict[str, int]] | None:
    """Factor to SI and powers of the base units of e.g. "N s^2/rad^2" or "rad/(m s)"; None where it is not known.

    A slash divides by what comes next, a single unit or a pair of brackets.
    """
    tokens = _TOKEN.findall(unit) if len(unit) <= _LONGEST else []
    if not tokens or "".join(tokens) != re.sub(r"\s", "", unit):
        return None
    rest = iter([*tokens, ")"])
    try:
        factor, powers = _product(rest)
    except (KeyError, StopIteration):
        return None
    if next(rest, None) is not None or not math.isfinite(factor):  # a bracket that closes nothing
        return None
    return factor, {name: power for name, power in powers.items() if power}


def is_unit(unit: str) -> bool:
    """Whether a unit is one that logs use, or a product of units such as "rad/(m s)"."""
    return is_known(unit) or base_units(unit) is not None


def gain_unit(output: str, input: str, seconds: int) -> str:
    """The unit of output / input / s^seconds, for example "rad/s^3"; "" where a part is not known.

    Args:
        output, input: SI units or radians. seconds: power of the second below the line.
    """
    above, below = base_units(output), base_units(input)
    if above is None or below is None:
        return ""
    powers = {**above[1], "s": above[1].get("s", 0) - seconds}
    for name, power in below[1].items():
        powers[name] = powers.get(name, 0) - power
    top, bottom = (
        " ".join(
            name if abs(power) == 1 else f"{name}^{abs(power)}" for name, power in powers.items() if sign * power > 0
        )
        for sign in (1, -1)
    )
    closed = f"({bottom})" if " " in bottom else bottom
    return (top or "1") + (f"/{closed}" if bottom else "")


def _product(tokens: Iterator[str]) -> tuple[float, dict[str, int]]:
    """What stands up to the closing bracket."""
    total, powers = 1.0, dict[str, int]()
    last: tuple[float, dict[str, int]] | None = None
    turned = sign = 1

    def take(part: tuple[float, dict[str, int]], power: int) -> None:
        nonlocal total
        total *= part[0] ** power
        for name, exponent in part[1].items():
            powers[name] = powers.get(name, 0) + exponent * power

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
