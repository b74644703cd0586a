"""The vehicle of a campaign, read once."""

from __future__ import annotations

from functools import lru_cache

from swashplate.models.catalogue import vehicle as find_vehicle
from swashplate.models.vehicle import Vehicle


@lru_cache(maxsize=4)
def vehicle_of(name_or_file: str) -> Vehicle:
    """A vehicle, read once in a worker's life."""
    return find_vehicle(name_or_file)
