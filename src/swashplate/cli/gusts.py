"""Turbulence on the command line: `--gusts`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.wind import Gusts


def turbulence(gusts: str) -> Gusts | None:
    """What --gusts asks for: none, indoor, or a mean wind [m/s]."""
    from swashplate.cli.options import numbers
    from swashplate.simulation.wind import INDOOR, outdoor

    if gusts == "none":
        return None
    if gusts == "indoor":
        return INDOOR
    try:
        return outdoor(numbers(gusts, option="--gusts", count=1)[0])
    except SwashError as error:
        raise SwashError(
            f"is '{gusts}', expected none, indoor, or a mean wind in m/s ({error.problem}).", channel="--gusts"
        ) from None
