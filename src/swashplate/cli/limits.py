"""`--limit`: beyond what a flight is lost."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.control.draws.spread import Limits


def limits(texts: list[str] | None) -> Limits:
    """`lean=30deg` and so on as what is judged by; those that are not given keep their defaults."""
    from swashplate.control.draws.spread import SHOWN, Limits

    chosen = Limits()
    for name, text in options.assignments(texts, option="--limit").items():
        if name not in SHOWN:
            raise SwashError(f"'{name}' is no limit; expected {', '.join(SHOWN)}.", channel="--limit")
        unit, factor = SHOWN[name]
        if text.strip() == "none":
            chosen = replace(chosen, **{name: math.inf})
            continue
        plain = text.strip().removesuffix(unit).strip()
        value = options.numbers(plain, option="--limit", count=1)[0]
        if not value > 0.0:
            raise SwashError(f"{name} is {text}, expected more than 0 {unit}.", channel="--limit")
        chosen = replace(chosen, **{name: value / factor})
    return chosen
