"""Rotorflight's law as a controller of ours: rate loops, ANGLE mode, mixer and governor, and a pilot at its sticks.

Written anew from Rotorflight's sources (4.6: pid.c in mode 3, leveling.c, mixer.c, governor.c, filter.c, gyro.c), at
the rate of 1000 Hz that its loops have by default. What is not in it: shaping of sticks (rates, smoothing, response),
spool-up, rescue, notches by rotor speed, the decimation of the gyro, its estimate of attitude (it is fed with true
states). Rotorflight holds neither a place nor a height: a pilot of ours does, in the mode "hover".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.control.laws.rotorflight.filters import low_pass
from swashplate.control.laws.rotorflight.mixers import GOVERNOR, SATURATED, governed, limited
from swashplate.control.laws.rotorflight.parameters import AXES, DEFAULTS, SCALES, known
from swashplate.control.laws.rotorflight.pid import MEMORY, Deflections, pid_step
from swashplate.control.laws.tail import turn_by_tail
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Scalar
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import DesignedLaw, Step
from swashplate.simulation.trim import Trim

RotorflightMode = Literal["angle", "hover"]
MODES: tuple[RotorflightMode, ...] = ("angle", "hover")
RATE_OF_LOOPS = 1000.0
"""Hz: a gyro of 8 kHz and `pid_process_denom` 8."""
GRAVITY = 9.80665
_OWN: Mapping[str, int] = {
    "gyro": 6, **MEMORY, **GOVERNOR, "cut": 3, "collective": 1, "cyclic": 1, "place": 2, "height": 1,
}  # fmt: skip
"""What the law carries, with sizes; the last two are integrals of the pilot."""
_ENDS = np.cumsum(list(_OWN.values()))
_PLACES = dict(zip(_OWN, np.split(np.arange(_ENDS[-1]), _ENDS[:-1]), strict=True))
_NAMES = tuple(DEFAULTS)
_SIDE, _CLIMB, _TURN = 3.0, 1.5, 90.0
"""m/s, m/s and deg/s: the pilot's most."""
_LEAN = 20.0
"""Degrees: the pilot's most."""
_UNIT, _TAIL = 12.0, 24.0
"""Degrees of blade pitch for a command of one: what the firmware's tables count (error_decay_rate_curve and others are
over 0 to 15 degrees for 0 to 1.25); the tail's is a setup's choice, assumed."""


class Rigging(NamedTuple):
    """From the mixer's commands to blades.

    Attributes:
        pitch: of blades for a command of one [rad]: 12 degrees, as the firmware's tables count.
        tail: the same of the tail's blades [rad]; more of a command turns the nose left.
        centre: of the tail at a command of zero [rad].
        sense: 1 for a main rotor that turns counter-clockwise, -1 for a clockwise one.
    """

    pitch: float
    tail: float
    centre: float
    sense: float


class SticksPilot(NamedTuple):
    """Who sits at the sticks.

    Attributes:
        place, speed, place_sum: speed per place [1/s], acceleration per speed [1/s], its integral [1/s^2].
        height, climb, climb_sum: climb per height [1/s], collective per climb [s/m], its integral [1/m].
        heading: rate per heading [1/s].
    """

    place: float = 0.35
    speed: float = 0.7
    place_sum: float = 0.1
    height: float = 0.6
    climb: float = 0.1
    climb_sum: float = 0.05
    heading: float = 2.0


@dataclass(frozen=True)
class RotorflightLaw(DesignedLaw):
    """A controller for `simulate_closed_loop`.

    Attributes:
        vehicle: the name of the equations that it is for. model: the title of the card that its numbers are from.
        mode: "angle" holds a lean and a heading at the hover's collective, "hover" a place and a height too. A
            pilot's roll and pitch lean it by up to `angle_level_limit` in both.
        parameters: by Rotorflight's names (`known`).
        rigging, pilot: blades, sticks.
        hover: deflection of the collective in hover.
        inputs: how many the vehicle has. speed_state: place of the rotor's speed among its states; -1 for none.
        rate: how often it runs [Hz].
        settled: commands (roll, pitch, yaw), attitude (roll, pitch, yaw) and rotor speed of the hover that it holds
            already at the start; none where it has yet to find them.
    """

    vehicle: str
    model: str
    mode: RotorflightMode
    parameters: Mapping[str, float]
    rigging: Rigging
    pilot: SticksPilot
    hover: float
    inputs: int
    speed_state: int = -1
    rate: float = RATE_OF_LOOPS
    settled: tuple[float, ...] = ()
    type: ClassVar[str] = "rotorflight"

    @property
    def memory(self) -> Array:
        start = np.zeros(_ENDS[-1])
        start[_PLACES["collective"]] = start[_PLACES["flood"]] = self.hover
        if not self.settled:
            return start
        roll, pitch, yaw, phi, theta, _, speed = self.settled
        k, at = self.parameters, _PLACES
        gains = {
            name[0]: [k.get(f"{a}_{name}", 0.0) * s for a, s in zip(AXES, SCALES[name], strict=True)] for name in SCALES
        }
        start[at["cyclic"]] = np.hypot(roll, pitch)
        drag = (abs(self.hover) * k["yaw_collective_ff_gain"] + np.hypot(roll, pitch) * k["yaw_cyclic_ff_gain"]) / 100.0
        start[at["precomp"]] = drag * drag
        rpm = speed * 30.0 / np.pi
        start[at["speed"]] = start[at["speed_slope"]] = rpm / 3000.0
        start[at["speed_slope"][1]] = 0.0
        start[at["rpm"]] = rpm
        yaw -= drag * drag * self.rigging.sense
        for i, command in enumerate((roll, pitch - self.hover * k["pitch_collective_ff_gain"] / 500.0, yaw)):
            if i < 2 and gains["o"][i] > 0.0 and gains["i"][i] > 0.0 and self.hover:
                start[at["offset"][i]] = command / (gains["o"][i] * self.hover)
            elif gains["i"][i] > 0.0:
                start[at["error"][i]] = command / gains["i"][i]
        start[at["place"]] = GRAVITY * np.tan(-theta), GRAVITY * np.tan(phi)
        return start

    @property
    def gains(self) -> Array:
        """Its numbers as one row."""
        head = [1.0 / self.rate, float(self.mode == "hover"), self.hover]
        numbers = [*head, *self.rigging, *self.pilot, *(self.parameters[name] for name in _NAMES)]
        return np.array(numbers, dtype=np.float64)

    @property
    def step(self) -> Step:
        key = (self.inputs, self.speed_state)
        return _STEPS.setdefault(key, partial(rotorflight_step, inputs=key[0], speed_state=key[1]))

    def in_mode(self, mode: RotorflightMode) -> RotorflightLaw:
        """The same in another mode."""
        return replace(self, mode=mode)

    def at(self, vehicle: Vehicle, trim: Trim) -> RotorflightLaw:
        """The same with integrals that hold that trim already."""
        commands, states, rig = trim.commands(), trim.states(), self.rigging
        mixed = commands["A1"] / rig.pitch, commands["B1"] / rig.pitch, (commands["theta0T"] - rig.centre) / rig.tail
        settled = (*mixed, *(states[name] for name in ("phi", "theta", "psi")), states.get("omega", 0.0))
        place = vehicle.state_names.index("omega") if "omega" in vehicle.state_names else -1
        return replace(
            self,
            settled=tuple(map(float, settled)),
            hover=float(commands["theta0"]) / rig.pitch,
            inputs=len(vehicle.input_names),
            speed_state=place,
        )


_STEPS: dict[tuple[int, int], Step] = {}


def rotorflight_law(vehicle: Vehicle, hover: Trim, *, given: Mapping[str, float] | None = None) -> RotorflightLaw:
    """Rotorflight's own numbers on a single-rotor helicopter, calibrated so that a command of one is 12 degrees.

    Args:
        vehicle, hover: in free flight, its hover.
        given: parameters by Rotorflight's names that replace its own.

    Raises:
        ControllerError: for a vehicle that has no swashplate and tail, or whose tail turns nothing.
    """
    if vehicle.traits.servo_layout != "swashplate" or "theta0T" not in vehicle.input_names:
        raise ControllerError(
            "is no helicopter with one rotor and a tail, which Rotorflight flies.", where=vehicle.name
        )
    turn = turn_by_tail(vehicle, hover)
    if turn == 0.0:
        raise ControllerError("the tail moves nothing.", where=vehicle.name, channel="theta0T")
    sense = 1.0 if vehicle.card.options.get("rotation", "ccw") == "ccw" else -1.0
    rigging = Rigging(np.radians(_UNIT), -np.copysign(np.radians(_TAIL), turn), 0.0, sense)
    law = RotorflightLaw(vehicle.name, vehicle.card.title, "hover", known(given or {}), rigging, SticksPilot(), 0.0, 4)
    return replace(law.at(vehicle, hover), settled=())


def rotorflight_step(
    memory: Symbols,
    measured: Symbols,
    reference: Symbols,
    gains: Symbols,
    xp: ArrayFunctions,
    *,
    inputs: int,
    speed_state: int,
) -> tuple[Operand, Operand]:
    """One step, as `simulate_closed_loop` calls it."""
    dt, places, hover = gains[0], gains[1], gains[2]
    first = 3 + len(Rigging._fields)
    rig, pilot = Rigging(*gains[3:first]), SticksPilot(*gains[first : first + len(SticksPilot._fields)])
    k = {name: gains[first + len(SticksPilot._fields) + i] for i, name in enumerate(_NAMES)}
    m = {name: memory[where] for name, where in _PLACES.items()}
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    degrees = 180.0 / np.pi
    after: dict[str, Operand] = {}

    # Rotorflight's axes: roll right, pitch nose down, yaw nose left.
    gyro = degrees * xp.stack([body.p, -body.q, -body.r])
    gyro, kept = low_pass(m["gyro"].reshape(2, 3), gyro, k["gyro_lpf1_static_hz"], dt, xp)
    after["gyro"] = kept.ravel()
    lean, collective = _pilot(body, reference, pilot, m, after, places, hover, dt, xp)
    demand = _demand(body, reference, lean, pilot, k, xp)
    headspeed = measured[speed_state] * (30.0 / np.pi) if speed_state >= 0 else 0.0 * dt
    mixed = Deflections(m["collective"][0], m["cyclic"][0], m["cut"])
    commands, carried = pid_step(m, gyro, demand, mixed, headspeed, k, rig.sense, dt, xp)
    after |= carried
    commands, collective, cut = limited(commands, collective, k["swash_ring"], xp)
    after["cut"] = xp.where(xp.greater(cut, 0.5), SATURATED, xp.maximum(m["cut"] - 1.0, 0.0))
    cyclic = xp.sqrt(commands[0] * commands[0] + commands[1] * commands[1] + 1e-18)
    after["collective"], after["cyclic"] = collective, cyclic
    throttle = governed(m, after, headspeed, commands, collective, cyclic, k, dt, xp)
    blades = [
        rig.pitch * collective,
        rig.pitch * commands[1],
        rig.pitch * commands[0],
        rig.centre + rig.tail * commands[2],
        throttle + 0.0 * collective,
    ]
    row = xp.concatenate([xp.atleast_1d(after[name]) for name in _PLACES])
    return row, xp.stack(blades[:inputs])


def _pilot(
    body: RigidBody,
    reference: Symbols,
    pilot: SticksPilot,
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    places: Scalar,
    hover: Scalar,
    dt: Scalar,
    xp: ArrayFunctions,
) -> tuple[Operand, Operand]:
    """Lean to the right and nose down [deg], and the collective."""
    cf, sf, ct, st, cp, sp = (f(a) for a in (body.phi, body.theta, body.psi) for f in (xp.cos, xp.sin))
    u, v, w = body.u, body.v, body.w
    level, side, down = ct * u + sf * st * v + cf * st * w, cf * v - sf * w, -st * u + sf * ct * v + cf * ct * w
    north, east = reference[0] - body.x, reference[1] - body.y
    ahead, right = cp * north + sp * east, -sp * north + cp * east
    missing = xp.clip(pilot.place * xp.stack([ahead, right]), -_SIDE, _SIDE) - xp.stack([level, side])
    total = m["place"] + pilot.place_sum * dt * missing
    after["place"] = xp.where(places > 0.5, xp.clip(total, -0.2 * GRAVITY, 0.2 * GRAVITY), m["place"])
    pushed = xp.where(places > 0.5, pilot.speed * missing, 0.0) + after["place"]
    degrees = 180.0 / np.pi
    lean = degrees * xp.clip(xp.arctan(pushed / GRAVITY), -_LEAN / degrees, _LEAN / degrees)
    climb = xp.clip(pilot.height * (body.z - reference[2]), -_CLIMB, _CLIMB) + down
    lifted = xp.clip(m["height"] + pilot.climb_sum * dt * climb, -0.5, 0.5)
    after["height"] = xp.where(places > 0.5, lifted, m["height"])
    collective = hover + xp.where(places > 0.5, after["height"][0] + pilot.climb * climb, 0.0)
    return xp.stack([lean[1], lean[0]]), collective


def _demand(
    body: RigidBody, reference: Symbols, lean: Symbols, pilot: SticksPilot, k: Mapping[str, Operand], xp: ArrayFunctions
) -> Operand:
    """Rates asked of the rate loops [deg/s], (3,): ANGLE mode, and the pilot's rate of the heading."""
    degrees, most = 180.0 / np.pi, k["angle_level_limit"]
    asked = xp.clip(most * reference[6:8] + lean, -most, most)
    attitude = degrees * xp.stack([body.phi, -body.theta])
    off = reference[3] - body.psi
    turn = degrees * pilot.heading * xp.arctan2(xp.sin(off), xp.cos(off))
    return xp.concatenate(
        [0.1 * k["angle_level_strength"] * (asked - attitude), xp.stack([-xp.clip(turn, -_TURN, _TURN)])]
    )
