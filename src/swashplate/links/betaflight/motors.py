"""A multirotor's motors behind Betaflight's outputs: pulses in, and its own mixer's lines (`mmix`) from the card."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import LinkError
from swashplate.links.servo import Servo
from swashplate.models.vehicle import Vehicle

_MOST = 8
"""Motors that Betaflight has (MAX_SUPPORTED_MOTORS)."""


class MotorMapping:
    """Motors in the card's order on outputs from 1. Attributes as of `HelicopterMapping`.

    Args:
        vehicle: a multirotor, on the ground or not.

    Raises:
        LinkError: for a vehicle without motors, or with more than Betaflight has.
    """

    engine = None

    def __init__(self, vehicle: Vehicle) -> None:
        numbers = vehicle.card.values()
        count = sum(name.startswith("motor_") for name in vehicle.input_names)
        if count != len(vehicle.input_names) or "rotor_1_x" not in numbers or count < 3:
            raise LinkError(
                "is no multirotor; Betaflight's SITL flies those.",
                where=vehicle.card.where,
                channel="--vehicle",
                hint="For example crazyflie or x8.",
            )
        if count > _MOST:
            raise LinkError(f"has {count} motors, Betaflight {_MOST} at most.", where=vehicle.card.where)
        self._motors = tuple(Servo(i) for i in range(1, count + 1))
        self._stopped = max(0.0, -numbers["o_drive"] / numbers["k_drive"])
        self.channels = tuple(motor.channel for motor in self._motors)
        self.shares, self.motors = self.channels, count
        senses = vehicle.card.options["senses"]
        assert isinstance(senses, list | tuple)
        places = [(numbers[f"rotor_{i}_x"], numbers[f"rotor_{i}_y"]) for i in self.channels]
        reach = max(max(abs(x), abs(y)) for x, y in places)
        self.mixer = tuple((-y / reach, -x / reach, float(sense)) for (x, y), sense in zip(places, senses, strict=True))
        """Of each motor its share of roll (right), pitch (nose down) and yaw, as `mmix` has them."""

    def commands(self, motors: Array) -> Array:
        """The mixer's roll, pitch and yaw commands behind shares of the motors' travel, (m, n); shape (3, n)."""
        mixed = np.column_stack([np.ones(self.motors), np.array(self.mixer)])
        return np.asarray((np.linalg.pinv(mixed) @ motors)[1:], dtype=np.float64)

    def restart(self) -> None:
        """Nothing is carried over."""

    def inputs(self, pulses: Sequence[float], duration: float) -> list[float]:
        """Commands, 0 to 1, for pulses [us] by output; an output at its low end holds its rotor still."""
        return [max(self._stopped, motor.share(pulses[motor.channel - 1])) for motor in self._motors]
