"""From ArduPilot's commands (roll, pitch, yaw, throttle) to a vehicle's inputs, as its motor classes mix and cut them.

Facts from its sources: a single rotor's collective is linear between its ends and its cyclic is cut on a circle
(AP_MotorsHeli_Single, _Swash); a coaxial's flaps are divided by the thrust, motors get the thrust and half of the yaw
each way through the thrust curve (AP_MotorsCoax, Thrust_Linearization).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.physics.backend import Scalar

_FULL_STICK = 4500.0
_LEAST_ACTUATOR, _HALF = 0.5, 0.5


class Mixed(NamedTuple):
    """Inputs of the vehicle, and which of roll, pitch and yaw are cut (1) or not (0)."""

    inputs: Operand
    cut: Operand


class SwashplateMixer(NamedTuple):
    """A swashplate and a tail: blade pitch at both ends of the collective, at full cyclic, and of the tail's servo.

    Attributes:
        least, most: collective at throttle 0 and 1 [rad].
        side, ahead: lateral and longitudinal cyclic at a full roll and pitch command [rad].
        tail, turn: tail pitch in the middle of its travel, and what a full yaw command to the right adds [rad].
        engine: the throttle's input, which the governor has; it is an input only of vehicles with an engine.
    """

    least: float
    most: float
    side: float
    ahead: float
    tail: float
    turn: float
    engine: float

    def mix(self, wanted: Symbols, k: Mapping[str, Operand], xp: ArrayFunctions) -> Mixed:
        """Of roll, pitch, yaw (-1 to 1) and throttle (0 to 1), shape (4,), under parameters by ArduPilot's names."""
        size = xp.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + 1e-12)
        room = k["H_CYC_MAX"] / _FULL_STICK
        share = xp.where(size > room, room / size, 1.0)
        yaw, throttle = xp.clip(wanted[2], -1.0, 1.0), xp.clip(wanted[3], 0.0, 1.0)
        inputs = [
            self.least + throttle * (self.most - self.least),
            -self.ahead * share * wanted[1],
            self.side * share * wanted[0],
            self.tail + self.turn * yaw,
            self.engine,
        ]
        cut = xp.where(share < 1.0, 1.0, 0.0)
        beyond = xp.where(xp.abs(wanted[2]) > 1.0, 1.0, 0.0)
        return Mixed(xp.stack([v + 0.0 * wanted[0] for v in inputs]), xp.stack([cut, cut, beyond]))

    def unmixed(self, inputs: Sequence[float] | Array, k: Mapping[str, float]) -> Array:
        """Roll, pitch, yaw and throttle that give these inputs, shape (4,)."""
        theta0, b1, a1, tail = inputs[:4]
        roll, pitch = a1 / self.side, -b1 / self.ahead
        return np.array([roll, pitch, (tail - self.tail) / self.turn, (theta0 - self.least) / (self.most - self.least)])


class TwinSwashplateMixer(SwashplateMixer):
    """Two swashplates that tilt alike; `tail` and `turn` are half of their difference in collective [rad]."""


class CoaxialMixer(NamedTuple):
    """Two motors, lower and upper (counter-clockwise from above), and flaps or cyclic servos.

    Attributes:
        roll, pitch: the vehicle's inputs at a full output, signs included.
        lower, upper: the motors' commands below which nothing is asked (a rotor that stands still).
        yaw: of a full yaw command, what one motor gets and the other loses.
        divided: 1 where the flaps are divided by the thrust that blows on them, 0 where they are not.
    """

    roll: float
    pitch: float
    lower: float
    upper: float
    yaw: float = 0.5
    divided: float = 1.0

    def mix(self, wanted: Symbols, k: Mapping[str, Operand], xp: ArrayFunctions) -> Mixed:
        """As `SwashplateMixer.mix`."""
        largest = xp.maximum(xp.abs(wanted[0]), xp.abs(wanted[1]))
        kept = xp.minimum(xp.abs(wanted[2]), _HALF * k["MOT_YAW_HEADROOM"] / 1000.0)
        share = xp.clip((1.0 - kept) / xp.maximum(largest, 1e-9), 0.0, 1.0)
        allowed = 2.0 * (1.0 - share * largest)
        yaw = xp.clip(wanted[2], -allowed, allowed)
        asked = xp.clip(wanted[3], 0.0, 1.0)
        least = xp.maximum(share * largest, xp.abs(yaw))  # raised for roll, pitch and yaw, half way to the hover's
        thrust = xp.maximum(asked, xp.minimum(least, _HALF * (asked + k["MOT_THST_HOVER"])))
        yaw = xp.clip(yaw, -thrust, thrust)
        divisor = xp.clip(xp.maximum(_HALF * k["MOT_THST_HOVER"], thrust), _LEAST_ACTUATOR, 1.0)
        flaps = wanted[:2] / xp.where(self.divided > 0.5, divisor, 1.0)
        lower, upper = (_actuator(thrust + side * yaw, k, xp) for side in (-self.yaw, self.yaw))
        inputs = xp.stack(
            [
                xp.maximum(self.lower, lower),
                xp.maximum(self.upper, upper),
                self.roll * xp.clip(flaps[0], -1.0, 1.0),
                self.pitch * xp.clip(flaps[1], -1.0, 1.0),
            ]
        )
        scaled, turned = xp.greater(1.0, share), xp.greater(xp.abs(yaw - wanted[2]), 0.0)
        cut = [scaled | xp.greater(xp.abs(flap), 1.0) for flap in flaps] + [turned]
        return Mixed(inputs, xp.stack([xp.where(each, 1.0, 0.0) for each in cut]))

    def unmixed(self, inputs: Sequence[float] | Array, k: Mapping[str, float]) -> Array:
        """As `SwashplateMixer.unmixed`."""
        lower, upper = (_thrust(command, k) for command in inputs[:2])
        thrust = _HALF * (lower + upper)
        divisor = min(1.0, max(_LEAST_ACTUATOR, _HALF * k["MOT_THST_HOVER"], thrust)) if self.divided > 0.5 else 1.0
        roll, pitch = divisor * inputs[2] / self.roll, divisor * inputs[3] / self.pitch
        return np.array([roll, pitch, _HALF * (upper - lower) / self.yaw, thrust])


Mixer = SwashplateMixer | CoaxialMixer
FRAMES: Mapping[str, type[SwashplateMixer] | type[CoaxialMixer]] = {
    "swashplate": SwashplateMixer,
    "two swashplates": TwinSwashplateMixer,
    "two motors": CoaxialMixer,
}
"""By `Traits.servo_layout`."""


def _actuator(thrust: Scalar, k: Mapping[str, Operand], xp: ArrayFunctions) -> Operand:
    """A motor's output, 0 to 1, for a thrust of 0 to 1; the battery is not compensated for (MOT_BAT_VOLT_MAX 0)."""
    expo = xp.maximum(k["MOT_THST_EXPO"], 1e-6)
    inside = xp.maximum((1.0 - expo) ** 2 + 4.0 * expo * xp.clip(thrust, 0.0, 1.0), 0.0)
    curved = ((expo - 1.0) + xp.sqrt(inside)) / (2.0 * expo)
    return k["MOT_SPIN_MIN"] + (k["MOT_SPIN_MAX"] - k["MOT_SPIN_MIN"]) * xp.clip(curved, 0.0, 1.0)


def _thrust(command: float, k: Mapping[str, float]) -> float:
    share = (command - k["MOT_SPIN_MIN"]) / (k["MOT_SPIN_MAX"] - k["MOT_SPIN_MIN"])
    return (1.0 - k["MOT_THST_EXPO"]) * share + k["MOT_THST_EXPO"] * share**2
