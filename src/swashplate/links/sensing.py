"""What the sensors of a vehicle at the far end of a link read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import add
from typing import NamedTuple

import numpy as np

from swashplate.links.plant import Plant
from swashplate.links.servo import FLOATS
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector, local_to_body
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.stepping import Motion

FARTHEST = 100.0
"""m: what a rangefinder says that sees nothing."""
_LEAST_VOLTAGE = 1e-3
_LEAST_DOWN = 0.1
"""Of the body's z axis, pointing down, below which it sees nothing."""


class Readings(NamedTuple):
    """One instant.

    Attributes:
        time: since the vehicle was put on the ground [s].
        gyro, force: body axes [rad/s], [m/s^2].
        place, velocity: of the CG from where it stood at first, north-east-down [m], [m/s].
        attitude: roll, pitch, yaw [rad].
        range: from the CG along body z to the ground [m].
        airspeed: of a pitot tube ahead [m/s].
        wind: the air's velocity, north-east-down [m/s].
        vane: direction that the air comes from, clockwise from the nose [rad], and its speed [m/s].
        rotors: main and tail, or lower and upper [rpm].
        voltage, current: of the battery [V], [A]; None for a vehicle without one.
    """

    time: float
    gyro: Vector
    force: Vector
    place: Vector
    velocity: Vector
    attitude: tuple[float, float, float]
    range: float
    airspeed: float
    wind: Vector
    vane: tuple[float, float]
    rotors: tuple[float, float]
    voltage: float | None
    current: float | None


class Sensing:
    """Reads a plant.

    Args:
        plant: what is read.
        unit: noise and biases of gyros and accelerometers; None for none.
        seed: of the noise.
    """

    def __init__(self, plant: Plant, *, unit: InertialUnit | None = None, seed: int = 0) -> None:
        self._plant, self._unit, self._seed = plant, unit, seed
        around = plant.environment
        self._wind = Vector(*map(float, (around.wind_north, around.wind_east, around.wind_down)))
        self.restart()

    def restart(self) -> None:
        """The same noise and biases from the start."""
        self._random = np.random.default_rng(self._seed)
        self._bias = self._random.standard_normal(6)

    @property
    def noisy(self) -> bool:
        """Whether what it reads differs from what is."""
        return self._unit is not None

    def read(self, motion: Motion) -> Readings:
        """Readings of a motion at the plant's time."""
        return self.sensed(motion, self._plant.time, self._plant.voltage, self._drawn(), FLOATS)

    def sensed(
        self, motion: Motion, time: Scalar, voltage: Scalar, noise: Sequence[Scalar] | None, xp: Backend
    ) -> Readings:
        """Readings of a motion: a function of nothing else, so that it can be traced.

        Args:
            motion: the newest. time: [s]. voltage: of the battery [V].
            noise: added to gyros and accelerometers, 6 numbers; None for none.
            xp: the operations.
        """
        plant, body = self._plant, motion.body
        wind = self._wind
        air = body.velocity
        if any(wind):
            air = air + local_to_body(wind, body.attitude, xp).scaled(-1.0)
        gyro, force = body.rates, motion.force
        if noise is not None:
            gyro, force = (Vector(*map(add, v, n)) for v, n in ((gyro, noise[:3]), (force, noise[3:])))
        down = xp.cos(body.phi) * xp.cos(body.theta)
        height = xp.minimum(FARTHEST, xp.maximum(0.0, -body.z) / xp.maximum(down, _LEAST_DOWN))
        rotors = plant.rotor_speeds(motion, xp)
        voltage, current = self._battery(rotors, voltage, xp)
        return Readings(
            time,
            gyro,
            force,
            Vector(body.x, body.y, body.z + plant.standing_depth),
            motion.velocity,
            (_within_half_a_turn(body.phi, xp), body.theta, _within_half_a_turn(body.psi, xp)),
            xp.where(down > _LEAST_DOWN, height, FARTHEST),
            xp.maximum(0.0, air.x),
            wind,
            (xp.atan2(air.y, air.x), xp.sqrt(air.x * air.x + air.y * air.y)),
            (rotors[0] * 30.0 / math.pi, rotors[1] * 30.0 / math.pi),
            voltage,
            current,
        )

    def _drawn(self) -> list[float] | None:
        unit = self._unit
        if unit is None:
            return None
        noise, bias = np.repeat(((unit.rate_noise, unit.force_noise), (unit.rate_bias, unit.force_bias)), 3, axis=1)
        return list((noise * self._random.standard_normal(6) + bias * self._bias).tolist())

    def _battery(
        self, rotors: tuple[Scalar, Scalar], voltage: Scalar, xp: Backend
    ) -> tuple[Scalar | None, Scalar | None]:
        """Voltage, and the current of the rotors' shaft power without losses; for electric vehicles only."""
        numbers = self._plant.numbers
        if "k_torque_lower" not in numbers:
            return None, None
        lower, upper = rotors
        power = numbers["k_torque_lower"] * lower**3 + numbers["k_torque_upper"] * upper**3
        return voltage, xp.where(voltage > 0.0, power, 0.0) / xp.maximum(voltage, _LEAST_VOLTAGE)


def _within_half_a_turn(angle: Scalar, xp: Backend) -> Scalar:
    return xp.atan2(xp.sin(angle), xp.cos(angle))
