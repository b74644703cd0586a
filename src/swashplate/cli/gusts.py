"""Turbulence on the command line: `--gusts`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.simulation.wind import Gusts


def turbulence(gusts: str) -> Gusts | None:
    """What --gusts asks for: none, indoor, indoor=SIGMA, or a mean wind [m/s]."""
    from swashplate.cli.options import numbers
    from swashplate.simulation.wind import INDOOR, indoor, outdoor

    if gusts == "none":
        return None
    if gusts == "indoor":
        return INDOOR
    kind, told, sigma = gusts.partition("=")
    try:
        if told and kind.strip() == "indoor":
            return indoor(numbers(sigma, option="--gusts", count=1)[0])
        return outdoor(numbers(gusts, option="--gusts", count=1)[0])
    except SwashError as error:
        raise SwashError(
            f"is '{gusts}', expected none, indoor, indoor=0.3 (m/s), or a mean wind in m/s ({error.problem}).",
            channel="--gusts",
        ) from None
