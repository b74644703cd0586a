"""ArduPilot's parameters for a vehicle behind a servo mapping: what its SITL needs on top of its own defaults.

Names and meanings: ArduPilot's parameter reference of Copter 4.5 (H_, ATC_, SERVOn_).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.errors import LinkError
from swashplate.links.servo import Servo
from swashplate.links.servos import CoaxialMapping, HelicopterMapping, ServoMapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

Parameters = dict[str, float]

TYPES = {"H3": 0, "H1": 1, "H3-140": 2, "H3-120": 3, "H4-90": 4, "H4-45": 5}
"""H_SW_TYPE by our name."""
CYCLIC = 0.9
"""Share of the servos' travel that a full roll or pitch command takes (twice the 0.45 of AP_MotorsHeli_Swash)."""
SPARE = 16.0
"""% that the throttle's set point lies above where the governor has the whole engine."""
SINGLE_ROTOR, COAXIAL = 6, 9
"""FRAME_CLASS: Heli and CoaxCopter. 8 is SingleCopter, a ducted fan on which these outputs mean something else."""
BASES = {SINGLE_ROTOR: ("copter-heli.parm",), COAXIAL: ("copter-single.parm", "copter-coax.parm")}
"""ArduPilot's own files of defaults that come before ours, in the order in which they are read, by FRAME_CLASS."""
RUN_UP = 7.0
"""s that a rotor needs beyond its engine's ramp."""
_HELI_SERVOS, _FIFTH, _TAIL, _THROTTLE = (33, 34, 35), 37, 36, 31
_MOTORS = {1: 33, 2: 34, 5: 37, 6: 38}
_SEEN = np.geomspace(1.0, 10.0, 30)  # rad/s
_CROSSOVER = 7.0  # rad/s, of the yaw rate loop
_KEPT, _MARGIN = 0.1, 1.25


def parameters(mapping: ServoMapping, vehicle: Vehicle, hover: Trim) -> Parameters:
    """By name, what ArduPilot has to be told about a vehicle.

    Rate loops of a single rotor: feed-forward is one over the largest rate per command from 1 to 10 rad/s, P 0.28 and I
    0.55 of it; yaw has a P that crosses over at 7 rad/s. Near hover ArduPilot lets the integrals of roll and pitch leak
    down to ILMI: that is a quarter more than what the hover's cyclic asks for, at least 0.1. These are starts that
    hover, made from the linear model about hover without ArduPilot's filters and delays, not tuned gains. A coaxial
    gets none.

    Args:
        mapping: between the autopilot's outputs and the vehicle.
        vehicle: in free flight.
        hover: its trim.

    Raises:
        LinkError: for a swashplate that has no number in ArduPilot.
    """
    if isinstance(mapping, CoaxialMapping):
        found: Parameters = {"FRAME_CLASS": COAXIAL}
        for servo in (*mapping.servos, *mapping.motors):
            if servo.channel not in _MOTORS:
                raise LinkError(f"output {servo.channel} is none of ArduPilot's coaxial frame.", channel="--servos")
            found |= _output(servo, _MOTORS[servo.channel])
    else:
        found = _helicopter(mapping, vehicle, hover)
    return found | {"SIM_RATE_HZ": 1200, "RNGFND1_TYPE": 100, "RPM1_TYPE": 10}


def parameter_file(found: Parameters, *, title: str) -> str:
    """The text of a file that SITL (`--defaults`, `--add-param-file`) and ground stations load."""
    base = " and ".join(BASES[int(found["FRAME_CLASS"])])
    head = f"# {' '.join(title.split())}: on top of ArduPilot's {base}, written by swash link ardupilot\n"
    return head + "".join(f"{name},{_digits(value)}\n" for name, value in found.items())


def as_written(found: Mapping[str, float]) -> Parameters:
    """The numbers that an autopilot has after it has read them from a file."""
    return {name: float(_digits(value)) for name, value in found.items()}


def _digits(value: float) -> str:
    return f"{round(value, 4):g}"


def _helicopter(mapping: HelicopterMapping, vehicle: Vehicle, hover: Trim) -> Parameters:
    if mapping.type not in TYPES:
        raise LinkError(
            f"a swashplate of type '{mapping.type}' has no number in ArduPilot.",
            channel="--write-parameters",
            hint=f"Types with one: {', '.join(TYPES)}.",
        )
    (low, high), (least, most) = mapping.collective_pulse, mapping.collective_deg
    if not (low < high and least < most):
        raise LinkError("ArduPilot wants collective_pulse and collective_deg from low to high.", channel="--servos")
    functions = (*_HELI_SERVOS, _FIFTH)
    outputs: Parameters = {}
    for servo, function in zip(mapping.swash, functions, strict=False):
        outputs |= _output(servo, function)
    turned, gains = _rates(mapping, vehicle, hover)
    tail = _output(mapping.tail, _TAIL)
    if turned:  # more of the tail's pitch turns the nose left
        name = f"SERVO{mapping.tail.channel}_REVERSED"
        tail[name] = 1.0 - tail[name]
    return {
        "FRAME_CLASS": SINGLE_ROTOR,
        "H_SW_TYPE": TYPES[mapping.type],
        "H_SW_COL_DIR": 0,
        "H_COL_MIN": low,
        "H_COL_MAX": high,
        "H_COL_ANG_MIN": least,
        "H_COL_ANG_MAX": most,
        "H_CYC_MAX": 2500,
        "H_TAIL_TYPE": 0,
        "H_RSC_MODE": 2,
        "H_RSC_SETPOINT": min(100.0, 100.0 * mapping.full + SPARE),
        "H_RSC_RAMP_TIME": math.ceil(mapping.spool),
        "H_RSC_RUNUP_TIME": math.ceil(mapping.spool + RUN_UP),
        **outputs,
        **tail,
        **{k: v for k, v in _output(mapping.throttle, _THROTTLE).items() if not k.endswith("_TRIM")},
        "RC8_OPTION": 32,
        "ATC_HOVR_ROL_TRM": round(100.0 * math.degrees(hover.states()["phi"])),
        **{f"ATC_ANG_{axis}_P": 4.5 for axis in ("RLL", "PIT", "YAW")},
        **gains,
    }


def _output(servo: Servo, function: int) -> Parameters:
    name = f"SERVO{servo.channel}"
    return {
        f"{name}_FUNCTION": function,
        f"{name}_MIN": servo.low,
        f"{name}_TRIM": servo.centre,
        f"{name}_MAX": servo.high,
        f"{name}_REVERSED": float(servo.reversed),
    }


def _rates(mapping: HelicopterMapping, vehicle: Vehicle, hover: Trim) -> tuple[bool, Parameters]:
    """Whether the tail's sense has to be reversed, and ATC_RAT_ of three axes."""
    model = linearize(vehicle, hover)
    side, ahead = (CYCLIC * math.radians(angle) for angle in mapping.cyclic_deg)
    low, high = (math.radians(angle) for angle in mapping.tail_deg)

    def moved(name: str, by: float) -> Any:
        return by * model.B[:, model.inputs.index(name)]

    found: Parameters = {}
    commands = hover.commands()
    for axis, rate, name, full in (("RLL", "p", "A1", side), ("PIT", "q", "B1", -ahead)):
        forward = 1.0 / _largest(model.A, moved(name, full), model.states.index(rate))
        found |= _gains(axis, forward, 0.28 * forward, 0.55 * forward)
        found[f"ATC_RAT_{axis}_ILMI"] = max(_KEPT, round(_MARGIN * abs(commands[name] / full), 2))
    turn = float(moved("theta0T", 0.5 * (high - low))[model.states.index("r")])
    if turn == 0.0:
        raise LinkError("the tail moves nothing.", channel="tail.deg")
    hold = _CROSSOVER / abs(turn)
    return turn < 0.0, found | _gains("YAW", 0.0, hold, 1.2 * hold)


def _largest(A: Any, column: Any, row: int) -> float:
    eye = np.eye(len(A))
    return float(max(abs(np.linalg.solve(1j * w * eye - A, column)[row]) for w in _SEEN))


def _gains(axis: str, forward: float, proportional: float, integral: float) -> Parameters:
    values: Sequence[float] = (forward, proportional, integral, 0.0)
    return {f"ATC_RAT_{axis}_{name}": value for name, value in zip(("FF", "P", "I", "D"), values, strict=True)}
