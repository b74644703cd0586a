"""Betaflight's gains for a multirotor's model: rates in P, I and D, and the strength of ANGLE mode, with margins.

Its scales (pid.h): a command is 0.032029 P per deg/s, 0.244381 I per deg and 0.000529 D per deg/s^2 of the thousand
that are a whole one; motors get 945 us of it between their idle and their top. Loops are judged one at a time with the
filters of its defaults, and as late as its motors are behind states that come from another program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.cascade import FREQUENCIES, BrokenLoops
from swashplate.control.analysis.cascade_gains import GAIN_KEPT, PEAK_KEPT, PHASE_KEPT, LoopWorth, worth_of
from swashplate.errors import LinkError
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.simulation.linearize import LinearModel

AXES = ("roll", "pitch", "yaw")
RATES = ("p", "q", "r")
SIGNS = (1.0, -1.0, 1.0)
"""Of the body's rates, forward-right-down, in Betaflight's axes: nose down is positive."""
TRAVEL = 0.945
"""Of a motor's command that a whole mixer command moves: idle is at 1055 us."""
_SCALES = {"p": 0.032029, "i": 0.244381, "d": 0.000529}
_WHOLE, _DEGREES = 1000.0, 180.0 / np.pi
_LATE = 0.006
"""s: a state waits up to 0.5 ms (1 ms at real time), the loop 1 ms, its motors as long as the state for the next one;
the rest is for a machine that is late."""
_GYRO, _SLOPE = (250.0, 500.0), (75.0, 150.0)
"""Hz: low-passes of first order of the gyro and of D, at a low throttle."""
_YAW = 100.0
"""Hz: another of yaw's P (yaw_lowpass_hz)."""
_QUICK = 20.0
"""rad/s: where a command is asked which way it turns, before speed and motors have much to say."""
_LARGEST = 250.0
_RESERVE = (1.0, 8.0)
"""dB and degrees that rates leave to the angle around them."""


@dataclass(frozen=True)
class BetaflightGains:
    """Gains, and what the rate loops are worth with the angle closed around them.

    Attributes:
        settings: by the command line's names.
        loops: of roll, pitch and yaw.
    """

    settings: Mapping[str, float]
    loops: tuple[LoopWorth, ...]


def axis_response(model: LinearModel, mapping: MotorMapping, axis: int, omega: Array) -> Complex:
    """From the mixer's roll, pitch or yaw command to the rate, in Betaflight's signs [rad/s], shape (n,)."""
    shares = np.array([row[axis] for row in mapping.mixer])
    # A positive yaw command is turned around before it is mixed.
    drive = model.B @ (shares * TRAVEL * (-1.0 if axis == 2 else 1.0))
    eye, place = np.eye(len(model.states)), model.states.index(RATES[axis])
    states = np.array([np.linalg.solve(1j * w * eye - model.A, drive)[place] for w in omega])
    return np.asarray(SIGNS[axis] * states, dtype=np.complex128)


def betaflight_gains(model: LinearModel, mapping: MotorMapping) -> BetaflightGains:
    """Gains for a multirotor in hover.

    Raises:
        LinkError: naming the axis whose motors turn it the wrong way, or for which nothing keeps the margins.
    """
    settings: dict[str, float] = {"tpa_rate": 0.0, "anti_gravity_gain": 0.0}
    loops: list[LoopWorth] = []
    s: Complex = np.asarray(1j * FREQUENCIES, dtype=np.complex128)
    delay = np.exp(-s * _LATE) * _poles(s, _GYRO)
    strengths = []
    for axis, name in enumerate(AXES):
        plant = axis_response(model, mapping, axis, FREQUENCIES)
        at = int(np.argmin(np.abs(FREQUENCIES - _QUICK)))
        if (1j * plant[at]).real < 0.0:
            raise LinkError("turns against its command.", channel=name, hint="Are the senses of the rotors right?")
        grid = np.array(
            list(product(np.arange(1.0, _LARGEST), (0.3, 1.0), (0.0, 0.5, 1.0, 2.0), (2.0, 3.0, 4.0, 5.0)))
        ).T
        p, i, d = grid[0], np.round(grid[1] * grid[0]), np.round(grid[2] * grid[0])
        k = {key: (each * _SCALES[key] / _WHOLE * _DEGREES)[:, None] for key, each in (("p", p), ("i", i), ("d", d))}
        steady = k["p"] * (_poles(s, (_YAW,)) if name == "yaw" else 1.0) + k["i"] / s
        back = (steady + k["d"] * s * _poles(s, _SLOPE)) * delay
        outer = steady * np.exp(-s * _LATE) * (grid[3][:, None] if axis < 2 else 0.0) / s
        trial = BrokenLoops(FREQUENCIES, (plant * (back + outer))[..., None], np.zeros(p.size))
        bare = BrokenLoops(FREQUENCIES, (plant * back)[..., None], np.zeros(p.size))
        roomy = (trial.gain >= GAIN_KEPT + _RESERVE[0]) & (trial.phase >= PHASE_KEPT + _RESERVE[1])
        alone = (bare.gain >= GAIN_KEPT) & (bare.phase >= PHASE_KEPT)
        crosses = np.abs(trial.loop[:, -1]) < 1.0  # beyond the last frequency nobody has seen margins
        kept = np.all(roomy & crosses & (trial.peak <= PEAK_KEPT) & alone, axis=1) & (d <= _LARGEST) & (i <= _LARGEST)
        if not kept.any():
            raise LinkError(f"no gains of {name} keep {GAIN_KEPT:g} dB and {PHASE_KEPT:g} degrees.", channel=name)
        worth = np.where(kept, trial.quiet(0.2, 15.0)[:, 0], -np.inf)
        best = int(np.argmax(worth))
        settings |= {f"p_{name}": p[best], f"i_{name}": i[best], f"d_{name}": d[best], f"d_max_{name}": d[best]}
        settings[f"f_{name}"] = 0.0
        strengths.append(grid[3][best])
        chosen = BrokenLoops(FREQUENCIES, trial.loop[best][None], np.zeros(1))
        loops += worth_of(chosen, (name,))
    settings["angle_p_gain"] = 10.0 * min(strengths[:2])
    return BetaflightGains(settings, tuple(loops))


def _poles(s: Complex, hertz: tuple[float, ...]) -> Complex:
    response: Complex = np.ones_like(s)
    for corner in hertz:
        response = response / (1.0 + s / (2.0 * np.pi * corner))
    return response
