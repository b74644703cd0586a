"""A designed multisine for an autopilot that takes angles: the motion that the design makes, line by line."""

from __future__ import annotations

import numpy as np

from swashplate.api.design_maneuver import usual_hold
from swashplate.api.designed_maneuver import LEAD, DesignedManeuver
from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers.ardupilot_script import FASTEST, ardupilot_script
from swashplate.flights.maneuvers.composed import ComposedMultisine
from swashplate.simulation.closed_loop import simulate_maneuver

_MOTION = {"roll": "phi", "pitch": "theta", "yaw": "psi", "heave": "z"}
_LOST = 0.5
"""Share of the design's power above what an autopilot follows, from which the script is no longer the design."""


def maneuver_script(made: DesignedManeuver) -> str:
    """The text of a Lua script for ArduPilot that flies the best offer of a design.

    The design is simulated once; of the motion of each axis, its own lines are what the script asks for.

    Raises:
        ManeuverError: for an offer that is no multisine (the chirp's parameters or the series fly it), or one of which
            most lies above what an attitude loop follows.
    """
    best = made.best
    (piece,) = best.pieces[:1]
    if not isinstance(piece, ComposedMultisine):
        raise ManeuverError(
            f"is for multisines, and the best offer is the {best.kind}.",
            channel="script",
            hint="Sweeps are flown by ArduPilot's System ID mode: the .param files beside the series.",
        )
    kept = {axis: tuple(n for n, _, _ in own if n / piece.duration <= FASTEST) for axis, own in piece.lines.items()}
    power = np.array([(n / piece.duration, a**2) for own in piece.lines.values() for n, a, _ in own])
    lost = float(np.sum(power[power[:, 0] > FASTEST, 1]) / np.sum(power[:, 1]))
    if lost > _LOST:
        raise ManeuverError(
            f"{100.0 * lost:.0f} % of the design's power lies above {FASTEST:g} Hz, where an autopilot does not follow "
            "the angles that a script asks for.",
            channel="script",
            hint=f"Design it with --band 0.3-{FASTEST:g}, or fly the series through a mixer of your own.",
        )
    rate = made.rate
    flight = simulate_maneuver(made.vehicle, piece, controller=usual_hold, lead=LEAD, tail=0.0, rate=rate)
    begin, count = round(LEAD * rate), round(piece.duration * rate)
    lines = {}
    for axis, numbers in kept.items():
        values = np.unwrap(flight.values(_MOTION[axis])) if axis == "yaw" else flight.values(_MOTION[axis])
        row = -np.gradient(values) * rate if axis == "heave" else values
        row = row[begin : begin + count] - np.mean(row[begin : begin + count])
        turn = np.exp(-2j * np.pi * np.outer(numbers, np.arange(count)) / count)
        phasors = 2.0 / count * turn @ row
        lines[axis] = tuple((n, float(np.abs(v)), float(np.angle(v))) for n, v in zip(numbers, phasors, strict=True))
    told = f"{made.vehicle.name}: {', '.join(made.unknown)}, {piece.duration:g} s"
    return ardupilot_script(lines, duration=piece.duration, limits=made.limits, title=told)
