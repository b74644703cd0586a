"""Sweeps of a trial: as large as the vehicle stays gentle, and no lower than its outputs are resolved."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import LinkError
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES, mixer_response
from swashplate.links.servo import CENTRE
from swashplate.links.servos import ServoMapping
from swashplate.simulation.linearize import LinearModel

_GENTLE: Mapping[str, tuple[float, float]] = {"p": (0.4, 0.1), "q": (0.4, 0.1), "r": (1.2, 0.4), "az": (2.5, 0.7)}
"""Most rate [rad/s] and angle [rad] that a sweep may make, or acceleration [m/s^2] and speed [m/s]."""
OF_TWO_MOTORS = 0.2
"""rad/s: the most rate of roll and pitch of a coaxial by two motors. The truth is linear, but the CoaX flaps with the
square of its rate (Fankhauser et al. 2011): at 0.4 rad/s that damped it by 0.7 /s more than in hover, and turned its
response by 6 degrees above the resonance of its bar."""
_MOST = 0.2
"""Of a mixer's command."""
RESOLVED = 4.0
"""us: the least amplitude of the output that moves most. Pulses are whole microseconds; rounding a sine of 4 changes
it by at most 0.4 dB and 2.7 degrees, one of 1 by 2.7 dB and 21 degrees (its describing function), and coherently."""
RESOLVED_AT_TRIM = 14.0
"""us: of an output that the firmware cuts off towards its trim: a sine of 14 loses 0.5 dB, one of 4 loses 2."""


def gentle_sweep(
    model: LinearModel,
    direction: Array,
    axis: str,
    gains: Mapping[str, float],
    *,
    band: tuple[float, float],
    seconds: float,
    gravity: float,
    mapping: ServoMapping,
    least: float = RESOLVED,
    quickest: float = math.inf,
) -> Chirp:
    """The largest sweep that stays gentle, by the linear model under the autopilot's loops without their filters.

    The loops hold against the sweep, most where it is slow: it begins where what they leave of it still moves
    an output by `least`.

    Args:
        model: about hover. direction: how far a unit of the mixer's command moves its inputs. axis: that is swept.
        gains: of the loops, by ArduPilot's names.
        band: asked for [Hz]. seconds: of the sweep. gravity: [m/s^2]. mapping: from outputs to inputs.
        least: amplitude of the output that moves most [us]. quickest: rate, below what is gentle [rad/s].

    Raises:
        LinkError: where it is resolved nowhere in the lower two thirds of the band.
    """
    a = MIXER_AXES[axis]
    omega = 2.0 * np.pi * np.geomspace(*band, 60)
    answer = mixer_response(model, direction, a.output, omega, delay=0.0, gravity=gravity)
    left = np.abs(1.0 / (1.0 + answer * _feedback(axis, gains, omega)))
    answer = np.abs(answer) * left
    quick, far = _GENTLE[a.output]
    pulse = largest_pulse(mapping, direction)
    size, start = 0.0, 0
    while start < 2 * omega.size // 3:
        part = slice(start, None)
        size = min(_MOST, min(quick, quickest) / float(answer[part].max()), far / float((answer / omega)[part].max()))
        unseen = np.flatnonzero(size * left[part] * pulse < least)
        if not unseen.size:
            low = band[0] if start == 0 else float(f"{omega[start] / (2.0 * np.pi):.2g}")
            return Chirp.planned(a.number, float(f"{size:.2g}"), (low, band[1]), record=seconds, fade=1.0)
        start += int(unseen[-1]) + 1
    raise LinkError(
        f"no gentle sweep of {axis} moves an output by {least:g} us in the lower two thirds of "
        f"{band[0]:g} to {band[1]:g} Hz: pulses are whole microseconds.",
        channel="--axes",
        hint="Leave the axis out, sweep higher (band), or give gains that hold less against it (defaults).",
    )


def largest_pulse(mapping: ServoMapping, direction: Array) -> float:
    """Of the output that moves most, per unit of the mixer's command [us]."""
    wide = 1e6  # s: an engine that is run up slowly is not asked here
    middle = [CENTRE] * max(mapping.channels)
    still = np.array(mapping.inputs(middle, wide))
    slopes = []
    for channel in mapping.channels:
        pulses = middle.copy()
        pulses[channel - 1] += 1.0
        slopes.append(np.array(mapping.inputs(pulses, wide)) - still)
    mapping.restart()
    return float(np.abs(np.linalg.pinv(np.array(slopes).T) @ direction).max())


def _feedback(axis: str, gains: Mapping[str, float], omega: Array) -> Complex:
    """What the loops add to the mixer's command against a rate, per rad/s; none against heave in STABILIZE."""
    if axis == "heave":
        return np.zeros(omega.size, dtype=complex)
    name, s = {"roll": "RLL", "pitch": "PIT", "yaw": "YAW"}[axis], 1j * omega
    p, i, d, forward = (gains.get(f"ATC_RAT_{name}_{end}", 0.0) for end in ("P", "I", "D", "FF"))
    angle = gains[f"ATC_ANG_{name}_P"] / s
    return np.asarray((p + i / s + d * s) * (1.0 + angle) + forward * angle)
