"""What several kinds of campaign read of their files: vehicles and gusts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from swashplate.errors import CampaignError
from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import Gusts, indoor, outdoor


@lru_cache(maxsize=4)
def vehicle_of(name_or_file: str) -> Vehicle:
    """A vehicle, read once in a worker's life."""
    return find_vehicle(name_or_file)


def gusts_of(given: Mapping[str, float]) -> Gusts | None:
    """Turbulence as a campaign's file asks for it: {indoor = SIGMA}, {outdoor = MEAN} [m/s], or none."""
    if not given:
        return None
    makers: Mapping[str, Any] = {"indoor": indoor, "outdoor": outdoor}
    if len(given) != 1 or next(iter(given)) not in makers:
        raise CampaignError(
            f"{', '.join(given)}: expected one of {{indoor = SIGMA}} and {{outdoor = MEAN}} in m/s.",
            channel="varies.gusts",
        )
    name, value = next(iter(given.items()))
    gusts: Gusts = makers[name](value)
    return gusts
