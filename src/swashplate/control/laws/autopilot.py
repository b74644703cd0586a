"""The CoaX's autopilot: height and heading on the motors, place, speed and lean on the servos through the decoupling.

Its modes differ in numbers only. "manual" is the paper's experiment: a pilot's cyclic commands, decoupled, with height
and heading held. "speed" holds a speed, "place" a place; a pilot's command is added in every mode. One step is a pure
function of scalars, for floats and CasADi alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.control.laws.decoupling import Decoupler, Lag, decouple, decoupler, fit_into_limits
from swashplate.control.laws.height_yaw import (
    CoaxialRotors,
    HeightYawGains,
    HeightYawMemory,
    coaxial_rotors,
    height_yaw_step,
)
from swashplate.engine.law import REFERENCES
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.errors import SwashError
from swashplate.models.coax import CoaxInputs
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend, Backend, Scalar
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import DesignedLaw, Step
from swashplate.simulation.trim import Trim

Mode = Literal["manual", "speed", "place"]
MODES: tuple[Mode, ...] = ("manual", "speed", "place")


class CyclicGains(NamedTuple):
    """Numbers of the loops on the servos.

    The defaults were found by a random search for the largest multi-loop disc margin on the published CoaX with every
    mode decaying. Stiffer loops lose it at the bar's mode (lean 1.5: a disc of 0.08 instead of 0.45).

    Attributes:
        place: wanted speed per distance [1/s], at most `greatest_speed` [m/s].
        speed, speed_integral: wanted lean per speed error [rad s/m] and its integral [rad/m], at most `greatest_lean`.
        lean, lean_rate: command per lean error [1/rad] and per body rate [s/rad].
        trim_roll, trim_pitch: servo commands of the trimmed hover.
    """

    place: float = 0.2
    greatest_speed: float = 1.0
    speed: float = 0.45
    speed_integral: float = 0.09
    greatest_lean: float = 0.4
    lean: float = 0.5
    lean_rate: float = 0.25
    trim_roll: float = 0.0
    trim_pitch: float = 0.0


_MODE_GAINS: Mapping[Mode, Mapping[str, float]] = {
    "manual": {"place": 0.0, "speed": 0.0, "speed_integral": 0.0, "lean": 0.0, "lean_rate": 0.0},
    "speed": {"place": 0.0},
    "place": {},
}


class Gains(NamedTuple):
    """Every number of the autopilot."""

    dt: float
    motors: HeightYawGains
    rotors: CoaxialRotors
    cyclic: CyclicGains
    law: Decoupler


class Memory(NamedTuple):
    """What it carries from step to step: the motors' integrals, and those of the speed error ahead and right [m]."""

    motors: HeightYawMemory
    ahead: Scalar
    right: Scalar


class Reference(NamedTuple):
    """What is asked for: `swashplate.simulation.closed_loop.REFERENCES`."""

    x: Scalar
    y: Scalar
    z: Scalar
    psi: Scalar
    ahead: Scalar
    right: Scalar
    roll: Scalar
    pitch: Scalar


assert Reference._fields == REFERENCES


def step(
    memory: Memory, body: RigidBody, voltage: Scalar, reference: Reference, gains: Gains, xp: Backend
) -> tuple[Memory, CoaxInputs]:
    """One step of the autopilot.

    Args:
        memory: from the last step.
        body: measured or estimated.
        voltage: the battery's [V].
        reference: what is asked for.
        gains: its numbers.
        xp: the operations.

    Returns:
        The new memory and the commands, within their limits.
    """
    g = gains.cyclic
    motors_memory, motors = height_yaw_step(
        memory.motors,
        body,
        voltage,
        z=reference.z,
        psi=reference.psi,
        gains=gains.motors,
        rotors=gains.rotors,
        dt=gains.dt,
        xp=xp,
    )

    # Place to speed, in the level plane of the heading
    c, s = xp.cos(body.psi), xp.sin(body.psi)
    north, east = reference.x - body.x, reference.y - body.y
    ahead = _limited(g.place * (c * north + s * east), g.greatest_speed, xp) + reference.ahead - body.u
    right = _limited(g.place * (-s * north + c * east), g.greatest_speed, xp) + reference.right - body.v

    # Speed to lean, lean to wanted cyclic (nose down is ahead)
    wanted_theta = -(g.speed * ahead + g.speed_integral * memory.ahead)
    wanted_phi = g.speed * right + g.speed_integral * memory.right
    theta, phi = _limited(wanted_theta, g.greatest_lean, xp), _limited(wanted_phi, g.greatest_lean, xp)
    roll = reference.roll + g.lean * (phi - body.phi) - g.lean_rate * body.p
    pitch = reference.pitch - g.lean * (theta - body.theta) + g.lean_rate * body.q

    # Cyclic to servos
    around: dict[str, Operand] = {"u": body.u, "v": body.v, "motor_lower": motors.lower, "voltage": voltage, "xp": xp}
    wanted = decouple(gains.law, roll, pitch, **around)
    cancelling = decouple(gains.law, 0.0, 0.0, **around)
    servos = fit_into_limits(
        (wanted[0] + g.trim_roll, wanted[1] + g.trim_pitch),
        (cancelling[0] + g.trim_roll, cancelling[1] + g.trim_pitch),
        lower=(-1.0, -1.0),
        upper=(1.0, 1.0),
        xp=xp,
    )

    # The integrals rest where lean or servos are at their limits, and before the rotors carry.
    free = xp.where(servos.kept < 1.0, 0.0, xp.where(motors_memory.spool < 1.0, 0.0, gains.dt))
    after = Memory(
        motors_memory,
        memory.ahead + xp.where(xp.abs(wanted_theta) > g.greatest_lean, 0.0, free) * ahead,
        memory.right + xp.where(xp.abs(wanted_phi) > g.greatest_lean, 0.0, free) * right,
    )
    return after, CoaxInputs(motors.lower, motors.upper, servos.roll, servos.pitch)


def _limited(value: Scalar, most: Scalar, xp: Backend) -> Scalar:
    return xp.minimum(xp.maximum(value, -most), most)


@dataclass(frozen=True)
class Autopilot(DesignedLaw):
    """A controller for `simulate_closed_loop`.

    Attributes:
        vehicle: the name of the equations that it is for.
        model: the title of the card that it was designed on.
        mode: one of `MODES`.
        numbers: its gains by name and group.
    """

    vehicle: str
    model: str
    mode: Mode
    numbers: Gains
    type: ClassVar[str] = "autopilot"

    @property
    def rate(self) -> float:
        """How often it runs [Hz]."""
        return 1.0 / self.numbers.dt

    @property
    def memory(self) -> NDArray[np.float64]:
        """Its memory at the start: rotors off with a soft start, in flight without."""
        off = self.numbers.motors.soft_start > 0.0
        return np.array([0.0, 0.0, 0.0 if off else 1.0, 0.0, 0.0])

    @property
    def gains(self) -> NDArray[np.float64]:
        """Its numbers as one row."""
        n = self.numbers
        return np.array([n.dt, *n.motors, *n.rotors, *n.cyclic, *n.law])

    @property
    def step(self) -> Step:
        return row_step

    def in_mode(self, mode: Mode) -> Autopilot:
        """The same in another mode; loops that its own mode leaves out get the default numbers."""
        if mode not in MODES:
            raise SwashError(f"is '{mode}', expected {', '.join(MODES)}.", channel="mode")
        usual = CyclicGains()
        restored = {name: getattr(usual, name) for name in _MODE_GAINS[self.mode]}
        cyclic = self.numbers.cyclic._replace(**{**restored, **_MODE_GAINS[mode]})
        return replace(self, mode=mode, numbers=self.numbers._replace(cyclic=cyclic))

    def with_gains(self, **changes: float) -> Autopilot:
        """Another with some numbers changed, by their names in `HeightYawGains`, `CyclicGains` and `Decoupler`."""
        numbers, left = self.numbers, dict(changes)
        for group in ("motors", "cyclic", "law"):
            part = getattr(numbers, group)
            mine = {name: left.pop(name) for name in list(left) if name in part._fields}
            numbers = numbers._replace(**{group: part._replace(**mine)})
        if left:
            raise SwashError(f"is not a gain of the autopilot: {', '.join(sorted(left))}.", channel="gains")
        return replace(self, numbers=numbers)


def autopilot(
    vehicle: Vehicle,
    trim: Trim,
    *,
    rate: float = 100.0,
    mode: Mode = "place",
    decoupled: bool = True,
    lag: Lag | float = "battery",
    speed_terms: bool = True,
    mixing: Literal["rotation", "as_printed"] | None = None,
    battery: bool = True,
    motors: HeightYawGains | None = None,
    cyclic: CyclicGains | None = None,
) -> Autopilot:
    """The autopilot of a coaxial helicopter, from its card and its hover.

    Args:
        vehicle: one with the CoaX's equations, published or identified.
        trim: its hover; servo trims and the constant phase lag come from it.
        rate: how often it runs [Hz].
        mode: what the servos hold: see the module.
        decoupled: False sends the cyclic commands to the servos as they are.
        lag, speed_terms, mixing: of the decoupling, see `decoupler`.
        battery: compensate the motors for the battery's voltage.
        motors, cyclic: gains other than the defaults.

    Raises:
        SwashError: for a vehicle with other inputs, an unknown mode, or a card that lacks a number.
    """
    if vehicle.input_names != CoaxInputs._fields:
        raise SwashError(
            f"the autopilot is for inputs {', '.join(CoaxInputs._fields)}.",
            where=vehicle.name,
            hint="`swash control decouple` takes any linear model, `swash control design` any vehicle.",
        )
    if mode not in MODES:
        raise SwashError(f"is '{mode}', expected {', '.join(MODES)}.", channel="mode")
    law = decoupler(vehicle, trim, lag=lag if decoupled else 0.0, speed=speed_terms and decoupled, mixing=mixing)
    commands = trim.commands()
    chosen = (cyclic or CyclicGains())._replace(
        trim_roll=commands["servo_roll"], trim_pitch=commands["servo_pitch"], **_MODE_GAINS[mode]
    )
    rotors = coaxial_rotors(vehicle, gravity=float(trim.environment.gravity), battery=battery)
    numbers = Gains(1.0 / rate, motors or HeightYawGains(), rotors, chosen, law)
    return Autopilot(vehicle.name, vehicle.card.title, mode, numbers)


def unpack(row: Symbols) -> Gains:
    """The gains from their row."""
    values = iter(row[i] for i in range(len(row)))

    def group(kind: Any) -> Any:
        return kind(*(next(values) for _ in kind._fields))

    kinds = (HeightYawGains, CoaxialRotors, CyclicGains, Decoupler)
    return Gains._make([next(values), *map(group, kinds)])


def row_step(
    memory: Symbols, measured: Symbols, reference: Symbols, gains: Symbols, xp: ArrayFunctions
) -> tuple[Operand, Operand]:
    """`step` on rows, as `simulate_closed_loop` calls it."""
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    wanted = Reference(*(reference[i] for i in range(len(REFERENCES))))
    carried = Memory(HeightYawMemory(memory[0], memory[1], memory[2]), memory[3], memory[4])
    after, commands = step(carried, body, measured[-1], wanted, unpack(gains), ArrayBackend(xp))
    return xp.stack([*after.motors, after.ahead, after.right]), xp.stack(commands)
