"""What a model looks like and how its moving parts stand: as its traits say, or a plain shape."""

from __future__ import annotations

from typing import Any

from swashplate.links.live.plain_picture import plain_picture, plain_pose
from swashplate.models.traits import Pose as Pose
from swashplate.models.vehicle import Vehicle


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Shapes in body axes (forward, right, down) [m]: rotors, bar, tail, fin and skids; size [m] and weight [N].

    What a card does not say (the fuselage's outline) is a plain shape of the rotor's size. `ground` is whether there is
    one, `rpm` whether rotor speeds are known.
    """
    return (vehicle.traits.picture or plain_picture)(vehicle)


def inputs_of(vehicle: Vehicle) -> list[dict[str, Any]]:
    """Name, unit and limits of each input: as the model has them."""
    return [
        {"name": name, "unit": unit, "low": low, "high": high}
        for name, unit, (low, high) in zip(vehicle.input_names, vehicle.input_units, vehicle.input_limits, strict=True)
    ]


def pose_of(vehicle: Vehicle) -> Pose:
    """A function from state row, input row and surroundings to how the moving parts stand.

    It returns per rotor [alpha, beta, omega, fx, fy, fz] (tilt right and aft [rad], speed [rad/s], force [N] in body
    axes), the bar's tilt [alpha, beta] (None without) and the tail rotor's [omega, force to the right].
    """
    return (vehicle.traits.pose or plain_pose)(vehicle)
