"""Rate-loop feed-forward and gains for ArduPilot's helicopter code, from an identified model, with their margins.

ArduPilot's heli rate controller gives the mixer command u = FF target + P e + I int e + D de/dt, with the rate error e
in rad/s and a derivative filter of first order (parameters ATC_RAT_*_FF, _P, _I, _D, _FLTD).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.flights.flight import Array
from swashplate.identification.handling import Margins, margins
from swashplate.identification.spectra import Complex
from swashplate.identification.state_space import StateSpaceModel

PHASE_MARGIN, GAIN_MARGIN = 45.0, 6.0
"""Degrees and decibels that every suggestion keeps."""

AXES = {"RLL": ("p", "mixer_roll"), "PIT": ("q", "mixer_pitch"), "YAW": ("r", "mixer_yaw")}
_DERIVATIVE_FILTER = 20.0  # Hz
_SEEN = 2.0 * np.pi * np.geomspace(0.05, 40.0, 1500)


@dataclass(frozen=True)
class Suggestion:
    """Gains of one axis.

    Attributes:
        axis: "RLL", "PIT" or "YAW".
        parameters: by ArduPilot's names.
        margins: of the broken rate loop with these gains.
        peak: largest closed-loop sensitivity |1/(1+L)|.
        words: what it is, and what to do first.
    """

    axis: str
    parameters: dict[str, float]
    margins: Margins
    peak: float
    words: str


def suggest_gains(model: StateSpaceModel) -> tuple[Suggestion, ...]:
    """Feed-forward and gains for every axis whose rate and mixer command the model joins.

    Feed-forward: one over the steady rate per command, so that a commanded rate is reached without an error. P, I and
    D: the largest P of a grid, with I = FF (a time constant of the error of about P/FF seconds) and D up to a fifth of
    P, that keeps 45 degrees, 6 dB and a sensitivity peak below two at every crossing with the model's own delay. Other
    axes are left open: cross-coupling is not compensated.
    """
    made = []
    for axis, (rate, command) in AXES.items():
        if rate in model.outputs and command in model.inputs:
            o, i = model.outputs.index(rate), model.inputs.index(command)
            plant = model.response(_SEEN)[:, o, i]
            best = _best(axis, plant, _steady(model, o, i))
            if best is not None:
                made.append(best)
    return tuple(made)


def _steady(model: StateSpaceModel, o: int, i: int) -> float:
    """Rate per command well below the rotor's modes [rad/s]."""
    low = model.response(np.array([2.0 * np.pi * 0.2]))[0, o, i]
    return float(np.abs(low) * np.sign(low.real or 1.0))


def _best(axis: str, plant: Complex, steady: float) -> Suggestion | None:
    ff = 1.0 / steady
    s = 1j * _SEEN
    found: tuple[float, dict[str, float], Complex] | None = None
    for p in abs(ff) * np.geomspace(2.0, 0.02, 40):
        for share in (0.2, 0.1, 0.05, 0.02, 0.0):
            d = share * p * 0.1
            controller = np.sign(ff) * (p + abs(ff) * 0.5 / s + d * s / (1.0 + s / (2.0 * np.pi * _DERIVATIVE_FILTER)))
            loop = np.asarray(controller * plant, dtype=np.complex128)
            if _keeps(loop):
                found = (
                    p,
                    {
                        f"ATC_RAT_{axis}_FF": ff,
                        f"ATC_RAT_{axis}_P": float(np.sign(ff) * p),
                        f"ATC_RAT_{axis}_I": ff * 0.5,
                        f"ATC_RAT_{axis}_D": float(np.sign(ff) * d),
                    },
                    loop,
                )
                break
        if found is not None:
            break
    if found is None:
        return None
    _, parameters, loop = found
    read = margins(_SEEN, loop)
    return Suggestion(
        axis,
        parameters,
        read,
        float(np.max(np.abs(1.0 / (1.0 + loop)))),
        f"Keeps {PHASE_MARGIN:g} degrees and {GAIN_MARGIN:g} dB on the model, one axis at a time. Fly the feed-forward "
        "first with P, I and D at a third, then raise them.",
    )


def _keeps(loop: Complex) -> bool:
    """Stable by Nyquist's count of a stable plant, and far enough from -1 at every crossing."""
    distance = np.abs(1.0 + loop)
    turns = np.unwrap(np.angle(1.0 + loop))
    encircled = abs(turns[-1] - turns[0]) > np.pi
    return bool(not encircled and distance.min() > 0.5 and _margins_hold(loop))


def _margins_hold(loop: Complex) -> bool:
    size, phase = np.abs(loop), np.degrees(np.angle(loop))
    above = size > 1.0
    crossings = np.flatnonzero(above[:-1] != above[1:])
    if any(180.0 - abs(phase[k]) < PHASE_MARGIN for k in crossings):
        return False
    half_turns = np.flatnonzero(np.abs(np.diff(phase)) > 180.0)
    return all(size[k] < 10.0 ** (-GAIN_MARGIN / 20.0) for k in half_turns)


def loop_of(model: StateSpaceModel, suggestion: Suggestion, omega: Array) -> Complex:
    """The broken rate loop of a suggestion on a model, shape (n,)."""
    rate, command = AXES[suggestion.axis]
    s = 1j * omega
    k = {name.rsplit("_", 1)[1]: value for name, value in suggestion.parameters.items()}
    controller = k["P"] + k["I"] / s + k["D"] * s / (1.0 + s / (2.0 * np.pi * _DERIVATIVE_FILTER))
    return np.asarray(
        controller * model.response(omega)[:, model.outputs.index(rate), model.inputs.index(command)],
        dtype=np.complex128,
    )
