"""What the sensors of a vehicle at the far end of a link read."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swashplate.links.plant import Plant
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Vector, local_to_body
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.stepping import Motion

_FLOATS = FloatBackend()
FARTHEST = 100.0
"""m: what a rangefinder says that sees nothing."""


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

    def read(self, moved: Motion) -> Readings:
        """Readings of a motion at the plant's time."""
        plant, body = self._plant, moved.body
        wind = self._wind
        air = body.velocity
        if any(wind):
            air = air + local_to_body(wind, body.attitude, _FLOATS).scaled(-1.0)
        gyro, force = self._shaken(body.rates, moved.force)
        down = math.cos(body.phi) * math.cos(body.theta)
        seen = min(FARTHEST, max(0.0, -body.z) / down) if down > 0.1 else FARTHEST
        rotors = plant.rotor_speeds(moved)
        voltage, current = self._battery(rotors)
        return Readings(
            plant.time,
            gyro,
            force,
            Vector(body.x, body.y, body.z + plant.standing_depth),
            moved.velocity,
            (body.phi, body.theta, math.remainder(body.psi, 2.0 * math.pi)),
            seen,
            max(0.0, air.x),
            wind,
            (math.atan2(air.y, air.x), math.hypot(air.x, air.y)),
            (rotors[0] * 30.0 / math.pi, rotors[1] * 30.0 / math.pi),
            voltage,
            current,
        )

    def _shaken(self, rates: Vector, force: Vector) -> tuple[Vector, Vector]:
        unit = self._unit
        if unit is None:
            return rates, force
        n, b = self._random.standard_normal(6).tolist(), self._bias.tolist()
        gyro = Vector(*(r + unit.rate_noise * n[i] + unit.rate_bias * b[i] for i, r in enumerate(rates)))
        felt = Vector(*(f + unit.force_noise * n[i] + unit.force_bias * b[i] for i, f in enumerate(force, start=3)))
        return gyro, felt

    def _battery(self, rotors: tuple[float, float]) -> tuple[float | None, float | None]:
        """Voltage, and the current of the rotors' shaft power without losses; for electric vehicles only."""
        numbers = self._plant.numbers
        if "k_torque_lower" not in numbers:
            return None, None
        lower, upper = rotors
        power = numbers["k_torque_lower"] * lower**3 + numbers["k_torque_upper"] * upper**3
        voltage = self._plant.voltage
        return voltage, power / voltage if voltage > 0.0 else 0.0
