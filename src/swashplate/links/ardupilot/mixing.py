"""What ArduPilot's motor classes do behind a servo mapping: the mixer of the rebuilt law."""

from __future__ import annotations

import math

from swashplate.control.laws.ardupilot.mixers import CoaxialMixer, Mixer, SwashplateMixer, TwinSwashplateMixer
from swashplate.control.laws.tail import turn_by_tail
from swashplate.errors import LinkError
from swashplate.links.servos import CoaxialMapping, ServoMapping, TwinMapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

CYCLIC = 0.9
"""Share of the servos' travel that a full roll or pitch command takes (twice the 0.45 of AP_MotorsHeli_Swash)."""
DIFFERENTIAL = 450.0
"""us of collective that a full yaw command gives one swashplate and takes from the other at H_DCP_SCALER 1."""


def mixer_of(mapping: ServoMapping, vehicle: Vehicle, hover: Trim) -> Mixer:
    """The mixer from roll, pitch, yaw and throttle to the vehicle's inputs.

    Reversed servos are reversed in the parameter file too, and a tail that turns the nose left gets its output
    reversed: neither is seen here.

    Raises:
        LinkError: where the tail moves nothing.
    """
    if isinstance(mapping, CoaxialMapping):
        roll, pitch = mapping.travel
        return CoaxialMixer(roll, -pitch, *mapping.stopped)
    if isinstance(mapping, TwinMapping):
        return _twin(mapping, hover)
    least, most = map(math.radians, mapping.collective_deg)
    side, ahead = (CYCLIC * math.radians(angle) for angle in mapping.cyclic_deg)
    low, high = map(math.radians, mapping.tail_deg)
    sense = tail_sense(mapping.tail_deg, vehicle, hover)
    commands = hover.commands()
    engine = commands.get("throttle", 1.0)
    return SwashplateMixer(least, most, side, ahead, 0.5 * (low + high), sense * 0.5 * (high - low), engine)


def _twin(mapping: TwinMapping, hover: Trim) -> Mixer:
    """Both swashplates alike, and yaw by their difference in collective (AP_MotorsHeli_Dual::mix_intermeshing)."""
    plate = mapping.upper
    least, most = map(math.radians, plate.collective_deg)
    side, ahead = (CYCLIC * math.radians(angle) for angle in plate.cyclic_deg)
    first, last = plate.collective_pulse
    turn = DIFFERENTIAL * mapping.yaw_share * (most - least) / (last - first)
    return TwinSwashplateMixer(least, most, side, ahead, 0.0, turn, hover.commands().get("throttle", 1.0))


def tail_sense(deg: tuple[float, float], vehicle: Vehicle, hover: Trim) -> float:
    """1 where more of the tail's output turns the nose right, -1 where it has to be reversed.

    Raises:
        LinkError: where it moves nothing.
    """
    turn = (deg[1] - deg[0]) * turn_by_tail(vehicle, hover)
    if turn == 0.0:
        raise LinkError("the tail moves nothing.", channel="tail.deg")
    return math.copysign(1.0, turn)
