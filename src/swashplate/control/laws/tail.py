"""Which way a helicopter's tail turns it."""

from __future__ import annotations

from swashplate.models.vehicle import Vehicle
from swashplate.simulation.discretisation import zero_order_hold
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

_LATER = 0.5
"""s: when the nose is asked: servos and delays stand between."""


def turn_by_tail(vehicle: Vehicle, hover: Trim) -> float:
    """Rate of the nose to the right [rad/s] half a second after a step of the tail's blades by one rad."""
    model = linearize(vehicle, hover)
    _, stepped = zero_order_hold(model.A, model.B, _LATER)
    return float(stepped[model.states.index("r"), model.inputs.index("theta0T")])
