"""What only an identification from flights has: whether each axis was moved by itself, and whether the air moved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from swashplate.filtering.disturbances import Noise

MOVING = 0.2
"""Root mean square [rad/s^2] of gusts in roll and pitch from which they may be moving air. A CoaX simulated in still
air comes out at 0.003, in wind of 0.1 m/s at 0.7; its real flights indoors at 1.9."""


@dataclass(frozen=True)
class AxisExcitation:
    """Whether a record moves an axis independently of what the aircraft did.

    Attributes:
        record: the record's name.
        axis: "roll", "pitch", "yaw" or "heave".
        command: the input that drives it.
        explained: part of the command's variance that past motion explains (1: a controller's answer to the motion;
            NaN where the command stands still or the record is too short to tell).
        coherence: largest coherence between command and motion in the band.
        phase: phase of motion over command there [rad] (NaN where the command stands still).
        power: standard deviation of the command in the band [1].
        identifiable: False where there is no independent excitation.
        words: the finding, and what to fly instead.
        answer: whether the motion tells the command as it tells a controller's answer; where the axis is identifiable
            all the same, it is weakly excited.
    """

    record: str
    axis: str
    command: str
    explained: float
    coherence: float
    phase: float
    power: float
    identifiable: bool
    words: str
    answer: bool = False


@dataclass(frozen=True)
class FlightDetails:
    """What `identify` adds to a result.

    Attributes:
        excitation: per record and axis.
    """

    kind: ClassVar[str] = "flight"
    excitation: tuple[AxisExcitation, ...] = ()


def moving_air(noise: Noise) -> str:
    """What a fit without a wind is to say of the gusts that it found; "" where there are none."""
    rms = float(noise.gust_tilt) * math.sqrt(0.5 * float(noise.tau_gust_moment))
    if float(noise.wind) > 0.0 or not rms > MOVING:
        return ""
    return (
        f"gusts of {rms:.2g} rad/s^2 (rms) in roll and pitch that fade in {float(noise.tau_gust_moment):.2g} s. If the "
        "air moved, outdoors or in the rotors' own wake in a room, it acted through the rotors: without --wind "
        "(wind=True) the bounds of terms of speed, rotor lags and linkages are then too narrow. Fit again with it."
    )
