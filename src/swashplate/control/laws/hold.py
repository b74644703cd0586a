"""A minimal hold of height and heading on the two motors, with a weak hold of attitude and place on the servos.

Enough to keep a CoaX in the room during a sweep; it is not meant to be a good controller.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import Step, StepController
from swashplate.simulation.trim import Trim

_BODY = len(RigidBody._fields)


class HoldGains(NamedTuple):
    """Numbers of the hold.

    Height: acceleration wanted per height error, per climb rate and per integral of the error [1/s^2, 1/s, 1/s^3].
    Yaw: angular acceleration wanted per heading error and per yaw rate, and per integral [1/s^2, 1/s, 1/s^3].
    Place: lean wanted per speed and per distance [rad s/m, rad/m], at most `lean_limit` [rad]; servo command per lean
    error and per rate [1/rad, s/rad].
    """

    height: float = 2.0
    climb: float = 2.5
    height_integral: float = 0.5
    yaw: float = 3.0
    yaw_rate: float = 2.5
    yaw_integral: float = 0.3
    speed: float = 0.1
    place: float = 0.03
    lean_limit: float = 0.15
    lean: float = 1.0
    lean_rate: float = 0.1


@dataclass(frozen=True)
class Hold(StepController):
    """A controller for `simulate_closed_loop`: see `hover_hold`."""

    rate: float
    memory: NDArray[np.float64]
    gains: NDArray[np.float64]
    step: Step
    at_once: ClassVar[bool] = True


def hover_hold(
    vehicle: Vehicle, trim: Trim, *, rate: float = 50.0, gains: HoldGains | None = None, servos: bool = True
) -> Hold:
    """The hold of a coaxial helicopter about a hover.

    Args:
        vehicle: one with two rotors as the CoaX has (inputs motor_lower, motor_upper, servo_roll, servo_pitch).
        trim: the hover that it adds its corrections to.
        rate: how often it runs [Hz].
        gains: its numbers.
        servos: False leaves the servos at their trim: only height and heading are held.
    """
    wanted = ("motor_lower", "motor_upper", "servo_roll", "servo_pitch")
    if vehicle.input_names != wanted:
        raise SwashError(f"the hover hold is for inputs {', '.join(wanted)}.", where=vehicle.name)
    chosen = gains or HoldGains()
    if not servos:
        chosen = chosen._replace(lean=0.0, lean_rate=0.0)
    card, state = vehicle.card.values(), trim.states()
    lower, upper = state["omega_lower"], state["omega_upper"]
    # Half of a wanted yaw acceleration comes from each rotor: Izz rdot = d(k Omega^2).
    share = card["inertia_zz"] / 4.0
    plant = [
        float(trim.environment.gravity),
        lower / card["k_drive_lower"],
        upper / card["k_drive_upper"],
        share / (card["k_torque_lower"] * lower) / card["k_drive_lower"],
        share / (card["k_torque_upper"] * upper) / card["k_drive_upper"],
    ]
    row = np.array([*chosen, *plant, *trim.inputs], dtype=np.float64)
    return Hold(rate, np.array([0.0, 0.0, 1.0 / rate]), row, hold_step)


def hold_step(
    memory: Symbols, measured: Symbols, reference: Symbols, gains: Symbols, xp: ArrayFunctions
) -> tuple[Operand, Operand]:
    """One step: integrals of height and heading error and the sample time in, the same and four inputs out."""
    g = HoldGains._make(gains[i] for i in range(len(HoldGains._fields)))
    gravity, lower_gain, upper_gain, lower_yaw, upper_yaw = gains[len(g) : len(g) + 5]
    trim_inputs = gains[len(g) + 5 :]
    body = RigidBody(*(measured[i] for i in range(_BODY)))
    height_sum, heading_sum, dt = memory

    # Height: the wanted acceleration upwards, and 1/(cos cos) for what the lean takes away from the thrust.
    too_low = body.z - reference[2]
    c_phi, c_theta = xp.cos(body.phi), xp.cos(body.theta)
    upwards = xp.sin(body.theta) * body.u - c_theta * (xp.sin(body.phi) * body.v + c_phi * body.w)
    wanted = g.height * too_low - g.climb * upwards + g.height_integral * height_sum
    load = xp.clip((1.0 + wanted / gravity) / xp.maximum(c_phi * c_theta, 0.5), 0.5, 1.5)
    speed_up = xp.sqrt(load) - 1.0

    # Heading: the shorter way round; the two rotors share the torque and their thrusts about cancel.
    turn = reference[3] - body.psi
    turn = xp.arctan2(xp.sin(turn), xp.cos(turn))
    yaw = xp.clip(g.yaw * turn - g.yaw_rate * body.r + g.yaw_integral * heading_sum, -6.0, 6.0)

    # Place: lean against speed and distance, in body axes; the servos lean it.
    c_psi, s_psi = xp.cos(body.psi), xp.sin(body.psi)
    north, east = reference[0] - body.x, reference[1] - body.y
    ahead, right = c_psi * north + s_psi * east, -s_psi * north + c_psi * east
    phi = xp.clip(g.place * right - g.speed * body.v, -g.lean_limit, g.lean_limit)
    theta = xp.clip(-g.place * ahead + g.speed * body.u, -g.lean_limit, g.lean_limit)
    servo_roll = g.lean * (phi - body.phi) - g.lean_rate * body.p
    servo_pitch = -g.lean * (theta - body.theta) + g.lean_rate * body.q

    correction = xp.stack(
        [
            lower_gain * speed_up - lower_yaw * yaw,
            upper_gain * speed_up + upper_yaw * yaw,
            servo_roll,
            servo_pitch,
        ]
    )
    sums = xp.stack([xp.clip(height_sum + dt * too_low, -2.0, 2.0), xp.clip(heading_sum + dt * turn, -2.0, 2.0), dt])
    return sums, trim_inputs + correction
