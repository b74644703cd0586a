"""What differs from aircraft to aircraft besides what an identification leaves open: tolerances, payload, delay."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle


def tolerances_of(vehicle: Vehicle) -> dict[str, float]:
    """Standard deviations of a card's numbers, those that have one.

    Raises:
        ControllerError: where none has.
    """
    sigmas = {name: float(p.sigma) for name, p in vehicle.card.parameters.items() if p.sigma}
    if not sigmas:
        raise ControllerError(
            "no number of the card has a sigma.",
            where=vehicle.card.path or vehicle.name,
            hint="Take a card from `swash bench` or `swash identify`, or say what varies: --vary mass=5%, "
            'in a campaign\'s file numbers = {mass = "5%"} without tolerances.',
        )
    return sigmas


def draw_numbers(
    vehicle: Vehicle,
    sigmas: Mapping[str, float],
    *,
    count: int,
    seed: int,
    about: Mapping[str, Array] | None = None,
) -> dict[str, Array]:
    """Numbers of `count` aircraft, independent and normal, cut at the bounds of physics, shape (count,) each.

    Args:
        vehicle: whose card gives centre and bounds.
        sigmas: standard deviations by name [the parameter's unit].
        count, seed: of the draws.
        about: models that are already drawn, kept for every name that is not in `sigmas` and the centre of those that
            are.

    Raises:
        ControllerError: for a name that the card does not have, or a negative sigma.
    """
    random = np.random.default_rng(seed)
    numbers = dict(about or {})
    for name, sigma in sigmas.items():
        if name not in vehicle.card.parameters or name not in vehicle.parameter_names:
            raise ControllerError("is not a number of the card.", where=vehicle.name, channel=name)
        if not sigma >= 0.0:
            raise ControllerError(f"varies by {sigma:g}, expected zero or more.", where=vehicle.name, channel=name)
        p = vehicle.card.parameters[name]
        drawn = numbers.get(name, p.value) + sigma * random.standard_normal(count)
        low = -np.inf if p.lower is None else p.lower
        numbers[name] = np.clip(drawn, low, np.inf if p.upper is None else p.upper)
    return numbers


def load_them(vehicle: Vehicle, drawn: Mapping[str, Array], *, most: float, count: int, seed: int) -> dict[str, Array]:
    """The same aircraft with a payload of up to `most` kg each at the centre of gravity, evenly spread.

    Raises:
        ControllerError: for a negative payload.
    """
    if not most >= 0.0:
        raise ControllerError(f"is {most:g} kg, expected zero or more.", channel="payload")
    payload = most * np.random.default_rng(seed).random(count)
    return {**drawn, "mass": drawn.get("mass", vehicle.card.values()["mass"]) + payload}


def draw_delays(*, most: float, count: int, seed: int) -> Array:
    """Delays of up to `most` seconds, evenly spread, shape (count,).

    Raises:
        ControllerError: for a negative delay.
    """
    if not most >= 0.0:
        raise ControllerError(f"is {most:g} s, expected zero or more.", channel="delay")
    return most * np.random.default_rng(seed).random(count)
