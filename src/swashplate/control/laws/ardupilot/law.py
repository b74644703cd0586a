"""ArduPilot's cascade as a controller of ours: place, speed, lean, rate; height, climb, acceleration, throttle.

The law of Copter 4.6, written anew from its documentation and sources (AC_PosControl, AC_AttitudeControl and its _Heli
and _Multi, AC_PID, AC_HELI_PID), at its rate of 400 Hz. What is not in it: its EKF (it is fed with true states), the
slew limiter (SMAX), the jerk-limited path of a moved target, take-off and landing, 4.7's S-curve on attitude demands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal

import numpy as np

from swashplate.arrays import Array
from swashplate.control.laws.ardupilot.filters import low_pass, notch, one_pole, reached_by
from swashplate.control.laws.ardupilot.mixers import FRAMES, Mixer, SwashplateMixer
from swashplate.control.laws.ardupilot.outputs import LOOPS_LATER, WIDEST, LawFirmware, output_delays
from swashplate.control.laws.ardupilot.parameters import AXES, DEFAULTS, RATE
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Scalar
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import DesignedLaw, Step
from swashplate.simulation.trim import Trim

FlightMode = Literal["stabilize", "alt_hold", "loiter"]
FLIGHT_MODES: tuple[FlightMode, ...] = ("stabilize", "alt_hold", "loiter")
RATE_OF_LOOPS = 400.0
"""Hz: SCHED_LOOP_RATE of Copter."""
GRAVITY = 9.80665
_MEMORY: Mapping[str, int] = {
    "begun": 1, "gyro": 6, "notch": 12, "climb": 1, "felt": 2, "target": 3, "turning": 3, "wanted": 3, "error": 3,
    "slope": 3, "sum": 3, "cut": 3, "speed_error": 2, "speed_slope": 2, "speed_sum": 2, "climb_error": 1,
    "climb_sum": 1, "lift_error": 1, "lift_sum": 1, "throttle": 1, "sent": WIDEST,
}  # fmt: skip
"""What the law carries, with sizes. Filters of gyros and of vertical acceleration keep two numbers for each stage."""
_ENDS = np.cumsum(list(_MEMORY.values()))
_PLACES = dict(zip(_MEMORY, np.split(np.arange(_ENDS[-1]), _ENDS[:-1]), strict=True))
_NAMES = tuple(DEFAULTS)
_THROTTLE = "POSCONTROL_THROTTLE_CUTOFF_FREQ_HZ"
_HEAD = ("dt", "height", "place")
_LEAK = 0.02
"""Of the leaking integral, each step (AC_ATTITUDE_HELI_RATE_INTEGRATOR_LEAK_RATE)."""
_CLIMB, _SINK, _LIFT = 2.5, 1.5, 2.5
"""m/s up and down, m/s^2: limits of the height loop (PILOT_SPEED_UP, PILOT_SPEED_DN, PILOT_ACCEL_Z)."""
_FASTEST, _SIDEWAYS = 12.5, 5.0
"""m/s and m/s^2: LOIT_SPEED, LOIT_ACC_MAX."""
_TURNING = tuple(np.radians([(40.0, 720.0), (40.0, 720.0), (10.0, 120.0)]).T)
"""rad/s^2: bounds of what the angle controller takes for the largest acceleration."""


@dataclass(frozen=True)
class ArduPilotLaw(DesignedLaw):
    """A controller for `simulate_closed_loop`.

    Attributes:
        vehicle: the name of the equations that it is for. model: the title of the card that its numbers are from.
        mode: "stabilize" holds an attitude at the hover's throttle, "alt_hold" a height too, "loiter" a place too. A
            pilot's roll and pitch lean it by up to ANGLE_MAX in every mode.
        parameters: by ArduPilot's names (`known`).
        mixer: from commands to inputs.
        inputs: how many the vehicle has.
        rate: how often it runs [Hz].
        firmware: whose outputs these are: some leave a loop later (`LOOPS_LATER`).
        settled: commands (roll, pitch, yaw, throttle) and attitude of the hover that it holds already at the start;
            none where it has yet to find them.
    """

    vehicle: str
    model: str
    mode: FlightMode
    parameters: Mapping[str, float]
    mixer: Mixer
    inputs: int
    rate: float = RATE_OF_LOOPS
    firmware: LawFirmware = "ardupilot"
    settled: tuple[float, ...] = ()
    type: ClassVar[str] = "ardupilot"

    @property
    def frame(self) -> str:
        """What is mixed: a key of `FRAMES`."""
        return next(name for name, kind in FRAMES.items() if type(self.mixer) is kind)

    @property
    def memory(self) -> Array:
        start = np.zeros(sum(_MEMORY.values()))
        if self.settled:
            start[_PLACES["sum"]] = self.settled[:3]
            start[_PLACES["lift_sum"]] = start[_PLACES["throttle"]] = self.settled[3] - self.hover
            start[_PLACES["target"]], start[_PLACES["begun"]] = self.settled[4:], 1.0
            settled = self.mixer.mix(np.array(self.settled[:4]), dict(self.parameters), np).inputs
            start[_PLACES["sent"][: len(settled)]] = settled
        return start

    @property
    def output_delays(self) -> Array:
        """From the end of a loop to the output [s], shape (inputs,)."""
        return output_delays(self.firmware, self.frame, self.inputs, self.rate)

    @property
    def hover(self) -> float:
        """The throttle that it takes for the hover's."""
        return self.parameters["H_COL_HOVER" if isinstance(self.mixer, SwashplateMixer) else "MOT_THST_HOVER"]

    @property
    def gains(self) -> Array:
        """Its numbers as one row."""
        height, place = float(self.mode != "stabilize"), float(self.mode == "loiter")
        numbers = [1.0 / self.rate, height, place, *(self.parameters[name] for name in _NAMES), *self.mixer]
        numbers += LOOPS_LATER[self.firmware][self.frame]
        return np.array(numbers, dtype=np.float64)

    @property
    def step(self) -> Step:
        key = (self.frame, self.inputs)
        return _STEPS.setdefault(key, partial(ardupilot_step, frame=self.frame, inputs=self.inputs))

    def in_mode(self, mode: FlightMode) -> ArduPilotLaw:
        """The same in another mode."""
        return replace(self, mode=mode)

    def at(self, vehicle: Vehicle, trim: Trim) -> ArduPilotLaw:
        """The same with integrals that hold that trim already."""
        commands, states = self.mixer.unmixed(trim.inputs, self.parameters), trim.states()
        settled = (*commands, *(states[name] for name in ("phi", "theta", "psi")))
        return replace(self, settled=tuple(map(float, settled)), inputs=len(vehicle.input_names))


_STEPS: dict[tuple[str, int], Step] = {}


def ardupilot_step(
    memory: Symbols,
    measured: Symbols,
    reference: Symbols,
    gains: Symbols,
    xp: ArrayFunctions,
    *,
    frame: str,
    inputs: int,
) -> tuple[Operand, Operand]:
    """One step, as `simulate_closed_loop` calls it."""
    head, rest = len(_HEAD), len(_HEAD) + len(_NAMES)
    dt, height, place = (gains[i] for i in range(head))
    k = {name: gains[head + i] for i, name in enumerate(_NAMES)}
    numbers: Operand = [gains[rest + i] for i in range(len(FRAMES[frame]._fields))]
    mixer = FRAMES[frame](*numbers)
    later = gains[rest + len(numbers) : rest + len(numbers) + inputs]
    m = {name: memory[where] for name, where in _PLACES.items()}
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    heli = issubclass(FRAMES[frame], SwashplateMixer)
    after: dict[str, Operand] = {"begun": xp.ones(1)}
    velocity = _to_north_east_down(body, xp)

    lean = _horizontal(body, velocity, reference, k, m, after, dt, xp) * place
    most = xp.radians(0.01 * k["ANGLE_MAX"])
    trimmed = xp.radians(0.01 * k["ATC_HOVR_ROL_TRM"]) if heli else 0.0
    wanted = xp.stack([lean[0] + most * reference[6] + trimmed, lean[1] - most * reference[7], reference[3]])
    throttle = _vertical(body, velocity, reference, k, m, after, dt, xp, height, heli=heli)
    rates = _attitude(body, wanted, k, m, after, dt, xp)
    commands = _rates(body, rates, k, m, after, dt, xp, heli=heli)
    mixed = mixer.mix(xp.concatenate([commands, throttle]), k, xp)
    after["cut"] = mixed.cut
    computed = mixed.inputs[:inputs]
    waits = xp.greater(later, 0.5) & xp.greater(m["begun"], 0.5)
    after["sent"] = xp.concatenate([computed, xp.zeros(WIDEST - inputs)]) if inputs < WIDEST else computed
    carried = xp.concatenate([xp.atleast_1d(after[name]) for name in _PLACES])
    return carried, xp.where(waits, m["sent"][:inputs], computed)


def square_root(error: Scalar, p: Scalar, most: Scalar, xp: ArrayFunctions) -> Operand:
    """ArduPilot's `sqrt_controller`: proportional near zero, and from there no faster than `most` can brake."""
    near = most / xp.maximum(p * p, 1e-12)
    beyond = xp.sqrt(2.0 * most * xp.maximum(xp.abs(error) - 0.5 * near, 0.5 * near))
    return xp.where(xp.greater(xp.abs(error), near), xp.sign(error) * beyond, p * error)


def _to_north_east_down(body: RigidBody, xp: ArrayFunctions) -> Operand:
    cf, sf, ct, st, cp, sp = (f(a) for a in (body.phi, body.theta, body.psi) for f in (xp.cos, xp.sin))
    u, v, w = body.u, body.v, body.w
    level, side, down = ct * u + sf * st * v + cf * st * w, cf * v - sf * w, -st * u + sf * ct * v + cf * ct * w
    return xp.stack([cp * level - sp * side, sp * level + cp * side, down])


def _horizontal(
    body: RigidBody,
    velocity: Symbols,
    reference: Symbols,
    k: Mapping[str, Operand],
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    dt: Scalar,
    xp: ArrayFunctions,
) -> Operand:
    """Roll and pitch [rad] that the place asks for."""
    off = xp.stack([reference[0] - body.x, reference[1] - body.y])
    far = xp.sqrt(off @ off + 1e-12)
    speed = off / far * xp.minimum(square_root(far, k["PSC_POSXY_P"], _SIDEWAYS, xp), _FASTEST)
    c, s = xp.cos(body.psi), xp.sin(body.psi)
    speed = speed + xp.stack([c * reference[4] - s * reference[5], s * reference[4] + c * reference[5]])
    error = speed - velocity[:2]
    filtered = one_pole(m["speed_error"], error, k["PSC_VELXY_FLTE"], dt, m["begun"], xp)
    slope = reached_by(m["speed_slope"], (filtered - m["speed_error"]) / dt, k["PSC_VELXY_FLTD"], dt, xp) * m["begun"]
    asked = k["PSC_VELXY_P"] * filtered + m["speed_sum"] + k["PSC_VELXY_D"] * slope
    size, most = xp.sqrt(asked @ asked + 1e-12), GRAVITY * xp.tan(xp.radians(0.01 * k["ANGLE_MAX"]))
    asked = asked * xp.minimum(1.0, most / size)
    growing = xp.greater(size, most) & xp.greater(filtered @ asked, 0.0)
    total = m["speed_sum"] + xp.where(growing, 0.0, k["PSC_VELXY_I"] * dt) * filtered
    bound = 0.01 * k["PSC_VELXY_IMAX"]
    after |= {"speed_error": filtered, "speed_slope": slope, "speed_sum": xp.clip(total, -bound, bound)}
    ahead, right = c * asked[0] + s * asked[1], -s * asked[0] + c * asked[1]
    pitch = -xp.arctan(ahead / GRAVITY)
    return xp.stack([xp.arctan(right * xp.cos(pitch) / GRAVITY), pitch])


def _vertical(
    body: RigidBody,
    velocity: Symbols,
    reference: Symbols,
    k: Mapping[str, Operand],
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    dt: Scalar,
    xp: ArrayFunctions,
    height: Scalar,
    *,
    heli: bool,
) -> Operand:
    """The throttle, shape (1,): the hover's and what the height asks for."""
    climb, hover = -velocity[2:], k["H_COL_HOVER" if heli else "MOT_THST_HOVER"]
    felt = m["begun"] * (climb - m["climb"]) / dt  # what accelerometers feel, less gravity, since the last step
    felt, stages = low_pass(m["felt"].reshape(1, 2), felt, k["INS_ACCEL_FILTER"], dt, xp)
    asked = xp.clip(square_root(body.z - reference[2], k["PSC_POSZ_P"], _LIFT, xp), -_SINK, _CLIMB)
    error = one_pole(m["climb_error"], asked - climb, k["PSC_VELZ_FLTE"], dt, m["begun"], xp)
    bound = 0.01 * k["PSC_VELZ_IMAX"]
    total = xp.clip(m["climb_sum"] + k["PSC_VELZ_I"] * dt * error, -bound, bound)
    lift = one_pole(m["lift_error"], k["PSC_VELZ_P"] * error + total - felt, k["PSC_ACCZ_FLTE"], dt, m["begun"], xp)
    most = xp.maximum(1e-3 * k["PSC_ACCZ_IMAX"], hover)
    upper = xp.less_equal(1.0, hover + m["throttle"])
    lower = xp.less_equal(hover + m["throttle"], 0.0)
    stuck = (upper & xp.greater(lift, 0.0)) | (lower & xp.greater(0.0, lift))
    lifted = xp.clip(m["lift_sum"] + xp.where(stuck, 0.0, 0.1 * k["PSC_ACCZ_I"] * dt) * lift, -most, most)
    thrust = hover + 0.1 * k["PSC_ACCZ_P"] * lift + lifted
    tilt = 1.0 if heli else 1.0 / xp.clip(xp.cos(body.phi) * xp.cos(body.theta), 0.5, 1.0)
    throttle = reached_by(m["throttle"], xp.clip(thrust * tilt, 0.0, 1.0) - hover, k[_THROTTLE], dt, xp)
    holds = height > 0.5
    after |= {
        "climb": climb,
        "felt": stages[0],
        "climb_error": error,
        "climb_sum": xp.where(holds, total, m["climb_sum"]),
        "lift_error": lift,
        "lift_sum": xp.where(holds, lifted, m["lift_sum"]),
        "throttle": xp.where(holds, throttle, m["throttle"]),
    }
    return hover + after["throttle"]


def _attitude(
    body: RigidBody,
    wanted: Symbols,
    k: Mapping[str, Operand],
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    dt: Scalar,
    xp: ArrayFunctions,
) -> Operand:
    """Rates [rad/s] asked of the rate controllers, shape (3,)."""
    now = xp.stack([body.phi, body.theta, body.psi])
    target = xp.where(xp.greater(m["begun"], 0.5), m["target"], now)
    largest = xp.radians(0.01 * xp.stack([k[f"ATC_ACCEL_{n}_MAX"] for n in "RPY"]))
    off = wanted - target
    off = xp.stack([off[0], off[1], xp.arctan2(xp.sin(off[2]), xp.cos(off[2]))])
    turning = square_root(off, 1.0 / xp.maximum(k["ATC_INPUT_TC"], 0.01), largest, xp)
    turning = m["turning"] + xp.clip(turning - m["turning"], -largest * dt, largest * dt)
    shaped = k["ATC_RATE_FF_ENAB"] > 0.5  # otherwise the demand itself, and no rate of it is fed forward
    target, turning = xp.where(shaped, target + turning * dt, target + off), xp.where(shaped, turning, 0.0)
    after |= {"target": target, "turning": turning}
    error = _rotation(now, target, xp)
    gain = xp.stack([k[f"ATC_ANG_{axis}_P"] for axis in AXES])
    rates = square_root(error, gain, xp.clip(0.5 * largest, _TURNING[0], _TURNING[1]), xp)
    sf, cf, st, ct = xp.sin(target[0]), xp.cos(target[0]), xp.sin(target[1]), xp.cos(target[1])
    p, q, r = turning[0], turning[1], turning[2]
    return rates + xp.stack([p - r * st, q * cf + r * sf * ct, r * cf * ct - q * sf])


def _rotation(now: Symbols, target: Symbols, xp: ArrayFunctions) -> Operand:
    """The rotation in body axes from one attitude to another [rad], from their quaternions."""

    def quaternion(angles: Symbols) -> Operand:
        (cf, ct, cp), (sf, st, sp) = xp.cos(0.5 * angles), xp.sin(0.5 * angles)
        return (
            cf * ct * cp + sf * st * sp,
            xp.stack([sf * ct * cp - cf * st * sp, cf * st * cp + sf * ct * sp, cf * ct * sp - sf * st * cp]),
        )

    (a, u), (b, v) = quaternion(now), quaternion(target)
    real, parts = a * b + u @ v, a * v - b * u - xp.cross(u, v)
    size = xp.sqrt(parts @ parts + 1e-18)
    return parts / size * 2.0 * xp.arctan2(size, xp.abs(real)) * xp.where(real < 0.0, -1.0, 1.0)


def _rates(
    body: RigidBody,
    asked: Symbols,
    k: Mapping[str, Operand],
    m: Mapping[str, Operand],
    after: dict[str, Operand],
    dt: Scalar,
    xp: ArrayFunctions,
    *,
    heli: bool,
) -> Operand:
    """Roll, pitch and yaw commands, shape (3,)."""
    at = {name: xp.stack([k[f"ATC_RAT_{axis}_{name}"] for axis in AXES]) for name in RATE}
    gyro = xp.stack([body.p, body.q, body.r])
    gyro, after["notch"] = notch(m["notch"], gyro, k, dt, xp)
    gyro, stages = low_pass(m["gyro"].reshape(3, 2), gyro, k["INS_GYRO_FILTER"], dt, xp)
    after["gyro"] = stages.ravel()
    wanted = one_pole(m["wanted"], asked, at["FLTT"], dt, m["begun"], xp)
    error = one_pole(m["error"], wanted - gyro, at["FLTE"], dt, m["begun"], xp)
    slope = reached_by(m["slope"], m["begun"] * (error - m["error"]) / dt, at["FLTD"], dt, xp)
    total = m["sum"]
    if heli:  # roll and pitch near hover: down to ILMI
        kept = xp.clip(total, -at["ILMI"], at["ILMI"])
        total = total - _LEAK * (total - kept) * np.array([1.0, 1.0, 0.0])
    stuck = xp.greater(m["cut"], 0.5) & xp.greater(total * error, 0.0)
    total = xp.clip(total + xp.where(stuck, 0.0, at["I"] * dt) * error, -at["IMAX"], at["IMAX"])
    after |= {"wanted": wanted, "error": error, "slope": slope, "sum": total}
    return xp.clip(at["FF"] * wanted + at["P"] * error + total + at["D"] * slope, -1.0, 1.0)
