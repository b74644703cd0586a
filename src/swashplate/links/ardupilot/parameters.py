"""ArduPilot's parameters for a vehicle behind a servo mapping: what its SITL needs on top of its own defaults.

Names and meanings: ArduPilot's parameter reference of Copter 4.5 (H_, ATC_, SERVOn_).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from swashplate.errors import LinkError
from swashplate.links.ardupilot.mixing import tail_sense
from swashplate.links.plate import Plate
from swashplate.links.servo import Servo
from swashplate.links.servos import CoaxialMapping, Engine, HelicopterMapping, ServoMapping, TwinMapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

Parameters = dict[str, float]

TYPES = {"H3": 0, "H1": 1, "H3-140": 2, "H3-120": 3, "H4-90": 4, "H4-45": 5}
"""H_SW_TYPE by our name."""
SPARE = 16.0
"""% that the throttle's set point lies above where the governor has the whole engine."""
SINGLE_ROTOR, COAXIAL, DUAL = 6, 9, 11
"""FRAME_CLASS: Heli, CoaxCopter, Heli_Dual. 8 is SingleCopter, a ducted fan on which these outputs mean others."""
BASES = {
    SINGLE_ROTOR: ("copter-heli.parm",),
    COAXIAL: ("copter-single.parm", "copter-coax.parm"),
    DUAL: ("copter-heli.parm", "copter-heli-dual.parm"),
}
"""ArduPilot's own files of defaults that come before ours, in the order in which they are read, by FRAME_CLASS."""
RUN_UP = 7.0
"""s that a rotor needs beyond its engine's ramp."""
_HELI_SERVOS, _FIFTH, _TAIL, _THROTTLE = (33, 34, 35), 37, 36, 31
_SECOND_SERVOS = (36, 37, 38)
_MOTORS = {1: 33, 2: 34, 5: 37, 6: 38}


def parameters(mapping: ServoMapping, vehicle: Vehicle, hover: Trim) -> Parameters:
    """By name, what ArduPilot has to be told about a vehicle.

    Gains are not among them: `swashplate.links.ardupilot.gains` has those.

    Args:
        mapping: between the autopilot's outputs and the vehicle.
        vehicle: in free flight.
        hover: its trim.

    Raises:
        LinkError: for a swashplate that has no number in ArduPilot.
    """
    if isinstance(mapping, CoaxialMapping):
        values: Parameters = {"FRAME_CLASS": COAXIAL}
        for servo in (*mapping.servos, *mapping.motors):
            if servo.channel not in _MOTORS:
                raise LinkError(f"output {servo.channel} is none of ArduPilot's coaxial frame.", channel="--servos")
            values |= _output(servo, _MOTORS[servo.channel])
    elif isinstance(mapping, TwinMapping):
        values = _dual(mapping)
    else:
        values = _helicopter(mapping, vehicle, hover)
    return values | {"SIM_RATE_HZ": 1200, "RNGFND1_TYPE": 100, "RPM1_TYPE": 10}


def parameter_file(values: Parameters, *, title: str) -> str:
    """The text of a file that SITL (`--defaults`, `--add-param-file`) and ground stations load."""
    base = " and ".join(BASES[int(values["FRAME_CLASS"])])
    head = f"# {' '.join(title.split())}: on top of ArduPilot's {base}, written by swash link ardupilot\n"
    return head + "".join(f"{name},{_digits(value)}\n" for name, value in values.items())


def as_written(values: Mapping[str, float]) -> Parameters:
    """The numbers that an autopilot has after it has read them from a file."""
    return {name: float(_digits(value)) for name, value in values.items()}


def _digits(value: float) -> str:
    return f"{round(value, 6):g}"


def _helicopter(mapping: HelicopterMapping, vehicle: Vehicle, hover: Trim) -> Parameters:
    plate = _plate(mapping)
    functions = (*_HELI_SERVOS, _FIFTH)
    outputs: Parameters = {}
    for servo, function in zip(mapping.swash, functions, strict=False):
        outputs |= _output(servo, function)
    tail = _output(mapping.tail, _TAIL)
    if tail_sense(mapping.tail_deg, vehicle, hover) < 0.0:  # more of the tail's pitch turns the nose left
        name = f"SERVO{mapping.tail.channel}_REVERSED"
        tail[name] = 1.0 - tail[name]
    return {
        "FRAME_CLASS": SINGLE_ROTOR,
        **plate,
        "H_TAIL_TYPE": 0,
        **_engine(mapping.engine),
        **outputs,
        **tail,
        "ATC_HOVR_ROL_TRM": round(100.0 * math.degrees(hover.states()["phi"])),
    }


def _dual(mapping: TwinMapping) -> Parameters:
    """A coaxial helicopter as ArduPilot's dual frame: cyclic alike on both swashplates, yaw by their collectives."""
    if len(mapping.first.servos) > len(_HELI_SERVOS):
        raise LinkError("ArduPilot's dual frame has swashplates of three servos.", channel="--servos")
    first, outputs = _plate(mapping.first), dict[str, float]()
    for plate, functions in ((mapping.first, _HELI_SERVOS), (mapping.second, _SECOND_SERVOS)):
        for servo, function in zip(plate.servos, functions, strict=True):
            outputs |= _output(servo, function)
    return {
        "FRAME_CLASS": DUAL,
        "H_DUAL_MODE": 2,
        "H_DCP_SCALER": mapping.yaw_share,
        "H_YAW_SCALER": 0.0,
        **first,
        "H_SW2_TYPE": first["H_SW_TYPE"],
        "H_SW2_COL_DIR": 0,
        "H_COL2_MIN": first["H_COL_MIN"],
        "H_COL2_MAX": first["H_COL_MAX"],
        **_engine(mapping.engine),
        **outputs,
        "ATC_HOVR_ROL_TRM": 0.0,
    }


def _plate(plate: Plate | HelicopterMapping) -> Parameters:
    """A swashplate's type, collective and cyclic."""
    if plate.type not in TYPES:
        raise LinkError(
            f"a swashplate of type '{plate.type}' has no number in ArduPilot.",
            channel="--out",
            hint=f"Types with one: {', '.join(TYPES)}.",
        )
    (low, high), (least, most) = plate.collective_pulse, plate.collective_deg
    if not (low < high and least < most):
        raise LinkError("ArduPilot wants collective_pulse and collective_deg from low to high.", channel="--servos")
    return {
        "H_SW_TYPE": TYPES[plate.type],
        "H_SW_COL_DIR": 0,
        "H_COL_MIN": low,
        "H_COL_MAX": high,
        "H_COL_ANG_MIN": least,
        "H_COL_ANG_MAX": most,
        "H_CYC_MAX": 2500,
    }


def _engine(engine: Engine) -> Parameters:
    """Rotor speed control and its output, and the switch that starts it."""
    return {
        "H_RSC_MODE": 2,
        "H_RSC_SETPOINT": min(100.0, 100.0 * engine.full + SPARE),
        "H_RSC_RAMP_TIME": math.ceil(engine.spool),
        "H_RSC_RUNUP_TIME": math.ceil(engine.spool + RUN_UP),
        **{k: v for k, v in _output(engine.servo, _THROTTLE).items() if not k.endswith("_TRIM")},
        "RC8_OPTION": 32,
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
