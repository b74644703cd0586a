"""What a unit of ArduPilot's mixer commands does to a vehicle's inputs, and the responses that follow: the truth.

Sources: AP_MotorsHeli_Single and AP_MotorsHeli_Swash (roll and pitch are 0.45 of each servo's whole travel either way,
yaw the whole tail servo, throttle the way from H_COL_MIN to H_COL_MAX); AP_MotorsCoax (flaps by roll or pitch over the
thrust, at least 0.5; motors by the thrust and half of yaw either way, through the thrust curve).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import LinkError
from swashplate.links.ardupilot.mixing import CYCLIC
from swashplate.links.servos import CoaxialMapping, ServoMapping
from swashplate.simulation.linearize import LinearModel


class MixedAxis(NamedTuple):
    """One axis: SID_AXIS of its sweep, the mixer's and the answering channel, and the log's name for the latter."""

    number: int
    input: str
    output: str
    logged: str


MIXER_AXES: Mapping[str, MixedAxis] = {
    "roll": MixedAxis(10, "mixer_roll", "p", "p_sid"),
    "pitch": MixedAxis(11, "mixer_pitch", "q", "q_sid"),
    "yaw": MixedAxis(12, "mixer_yaw", "r", "r_sid"),
    "heave": MixedAxis(13, "mixer_collective", "az", "az_sid"),
}
"""By name."""


def mixed(mapping: ServoMapping, model: LinearModel) -> dict[str, Array]:
    """By axis, how far a unit of the mixer's command moves the vehicle's inputs, shape (n_inputs,).

    Raises:
        LinkError: for a frame whose mixing is not known here.
    """
    if isinstance(mapping, CoaxialMapping):
        raise LinkError(
            "the mixing of ArduPilot's coaxial frame depends on the thrust; a trial knows single rotors only.",
            channel="--vehicle",
            hint="Fly a coaxial by hand as the how-to says.",
        )
    side, ahead = (CYCLIC * math.radians(angle) for angle in mapping.cyclic_deg)
    least, most = (math.radians(angle) for angle in mapping.collective_deg)
    low, high = (math.radians(angle) for angle in mapping.tail_deg)
    tail = 0.5 * (high - low)
    turn = tail * model.B[model.states.index("r"), model.inputs.index("theta0T")]
    moves = {"roll": ("A1", side), "pitch": ("B1", -ahead), "heave": ("theta0", most - least)}
    moves["yaw"] = ("theta0T", math.copysign(tail, tail * turn))  # SERVOn_REVERSED has the nose go right
    return {axis: _column(model, *moves[axis]) for axis in MIXER_AXES}


def _column(model: LinearModel, name: str, by: float) -> Array:
    column = np.zeros(len(model.inputs))
    column[model.inputs.index(name)] = by
    return column


def mixer_response(
    model: LinearModel, moved: Array, output: str, omega: Array, *, late: float, gravity: float
) -> Complex:
    """The linearised vehicle's answer to a mixer command, shape (n_f,).

    Args:
        model: about the trim that is flown.
        moved: from `mixed`.
        output: "p", "q", "r", or "az" (specific force at the centre of gravity along body z).
        omega: frequencies [rad/s]. late: by which the command acts later [s]. gravity: [m/s^2].
    """
    place, eye = model.states.index, np.eye(len(model.states))
    drive = model.B @ moved
    states = np.array([np.linalg.solve(1j * w * eye - model.A, drive) for w in omega])
    if output == "az":
        trim = model.trim.states()
        u, v, phi, theta = (trim[name] for name in ("u", "v", "phi", "theta"))
        answer = 1j * omega * states[:, place("w")] + v * states[:, place("p")] - u * states[:, place("q")]
        answer += gravity * math.sin(theta) * math.cos(phi) * states[:, place("theta")]
        answer += gravity * math.cos(theta) * math.sin(phi) * states[:, place("phi")]
    else:
        answer = states[:, place(output)]
    return np.asarray(answer * np.exp(-1j * omega * late))


def hover_stick(mapping: ServoMapping, model: LinearModel) -> float:
    """Where the collective stick is in hover, 0 to 1."""
    assert not isinstance(mapping, CoaxialMapping), "refused by `mixed`"
    least, most = (math.radians(angle) for angle in mapping.collective_deg)
    return float((model.trim.commands()["theta0"] - least) / (most - least))
