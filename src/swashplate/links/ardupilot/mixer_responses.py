"""What a unit of ArduPilot's mixer commands does to a vehicle's inputs, and the responses that follow: the truth.

The mixing itself and its sources are in `swashplate.control.laws.ardupilot.mixers`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.laws.ardupilot.mixers import Mixer
from swashplate.engine.symbols import jacobian_at
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim import Trim


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


def mixed(mixer: Mixer, hover: Trim, parameters: Mapping[str, float], *, inputs: Sequence[str]) -> dict[str, Array]:
    """By axis, how far a unit of the mixer's command moves the vehicle's inputs, shape (n_inputs,): the Jacobian.

    About the commands that hold the hover, because a coaxial's motors go through a thrust curve, and its flaps are
    divided by the thrust.

    Args:
        mixer: from `mixer_of`.
        hover: the trim.
        parameters: of the autopilot, by ArduPilot's names (`known`).
        inputs: names of the vehicle's inputs.
    """
    at = mixer.unmixed(hover.inputs, parameters)
    columns = jacobian_at(lambda commands, xp: mixer.mix(commands, parameters, xp).inputs, at)
    return {axis: columns[: len(inputs), place] for place, axis in enumerate(MIXER_AXES)}


def mixer_response(
    model: LinearModel, direction: Array, output: str, omega: Array, *, delay: Array | float, gravity: float
) -> Complex:
    """The linearised vehicle's answer to a mixer command, shape (n_f,).

    Args:
        model: about the trim that is flown.
        direction: from `mixed`.
        output: "p", "q", "r", or "az" (specific force at the centre of gravity along body z).
        omega: frequencies [rad/s].
        delay: by which the inputs move later than the command [s], shape (n_inputs,) or one number for all.
        gravity: [m/s^2].
    """
    place, eye = model.states.index, np.eye(len(model.states))
    drives = np.exp(-1j * omega[:, None] * delay) * direction @ model.B.T
    states = np.array([np.linalg.solve(1j * w * eye - model.A, drive) for w, drive in zip(omega, drives, strict=True)])
    if output == "az":
        trim = model.trim.states()
        u, v, phi, theta = (trim[name] for name in ("u", "v", "phi", "theta"))
        answer = 1j * omega * states[:, place("w")] + v * states[:, place("p")] - u * states[:, place("q")]
        answer += gravity * math.sin(theta) * math.cos(phi) * states[:, place("theta")]
        answer += gravity * math.cos(theta) * math.sin(phi) * states[:, place("phi")]
    else:
        answer = states[:, place(output)]
    return np.asarray(answer, dtype=np.complex128)
