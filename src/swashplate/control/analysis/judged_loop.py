"""What flies under a controller, and the linearised loop that it is judged by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.sampled_loop import SampledLoop, sampled_loop
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim


class Aircraft(NamedTuple):
    """What a controller flies, which need not be the model of its design.

    Attributes:
        vehicle, trim: who, where.
        delays: from command to actuator by input [s].
    """

    vehicle: Vehicle
    trim: Trim
    delays: Mapping[str, float]


@dataclass(frozen=True)
class JudgedLoop:
    """A loop, and what of it can be told.

    Attributes:
        loop: linearised.
        held: references that it answers; None where the loop has the references in it and tells so itself. Without
            them no pilot's command is told of.
        sensitivity: from frequencies [rad/s] and a state to what the loop leaves of a disturbance added to it; None
            where no sensor shows the state.
        points: of the frequency grid, where it costs much; None for the check's own.
        notes: what is not told, and why.
    """

    loop: SampledLoop
    held: tuple[str, ...] | None
    sensitivity: Callable[[Array, str], Complex | None]
    points: int | None = None
    notes: tuple[str, ...] = ()


def judged_with_states(controller: Controller, flying: Aircraft, *, notes: tuple[str, ...] = ()) -> JudgedLoop:
    """The loop of a controller that is fed with the true states.

    Raises:
        SwashError: where the loop is not finite there.
    """
    loop = sampled_loop(flying.vehicle, controller, flying.trim, delays=flying.delays)

    def sensitivity(frequencies: Array, state: str) -> Complex | None:
        return loop.sensitivity(frequencies, state) if state in loop.states else None

    return JudgedLoop(loop, None, sensitivity, notes=notes)
