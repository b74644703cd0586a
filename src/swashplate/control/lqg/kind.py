"""Linear-quadratic controllers among the kinds of controllers: their file, their loop, their C."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.judged_loop import Aircraft, JudgedLoop, judged_with_states
from swashplate.control.analysis.margins import Margins
from swashplate.control.kinds import ControllerKind, TracedStep
from swashplate.control.lqg.analysis import sensitivity
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.file import lqg_document, lqg_from
from swashplate.control.lqg.other_model import differences
from swashplate.control.lqg.steady_loop import observed_loop
from swashplate.control.lqg.transfer import flown_on
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

_OBSERVED = (
    "With an observer, modes, margins and disturbance rejection are those of its steady filter about the flown "
    "vehicle; a disturbance is added to a state in every sensor that shows it. It takes no pilot's command, so there "
    "is no bandwidth; the steps are flown with its noisy sensors."
)
_POINTS = 400
"""Of the frequency grid with an observer."""


class LqgKind(ControllerKind[Lqg]):
    """With sensors (LQG) or fed with the states (LQR)."""

    takes_stick = False
    own_sensors = True

    def about(self, controller: Lqg, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> Lqg:
        own = controller.vehicle
        if own.traits.linear and not vehicle.traits.linear:
            return replace(flown_on(controller, vehicle, trim), seed=seed)
        if own.name != vehicle.name:
            raise ControllerError(f"is for '{own.name}', not for '{vehicle.name}'.", where=own.card.title)
        return controller.starting_at(trim, seed=seed)

    def judged(self, controller: Lqg, flying: Aircraft) -> JudgedLoop:
        if not controller.plan.sensors:
            return judged_with_states(controller, flying)
        at = int(np.argmin(np.abs(np.asarray(controller.feedback.speeds) - flying.trim.speed)))
        place = float(controller.feedback.place) > 0.5

        def left(frequencies: Array, state: str) -> Complex | None:
            return sensitivity(controller, frequencies, state, at=at, on=flying)

        return JudgedLoop(
            observed_loop(controller, at=at, on=flying, where=flying.vehicle.name),
            ("psi", "z", *(("x", "y") if place else ("ahead", "right"))),
            left,
            points=_POINTS,
            notes=(_OBSERVED,),
        )

    def differences(self, controller: Lqg, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        return differences(controller, flying, margins)

    def to_document(self, controller: Lqg) -> dict[str, Any]:
        return lqg_document(controller)

    def from_document(self, document: dict[str, Any], path: str) -> Lqg:
        return lqg_from(document, path)

    def traced(self, controller: Lqg) -> TracedStep:
        vehicle, plan = controller.vehicle, controller.plan
        return TracedStep(
            controller.graph(),
            tuple(controller.inner_memory.tolist()),
            "estimates, their covariance, commands given, counts, integrals and speeds",
            (*(plan.channels if plan.sensors else vehicle.state_names), "voltage"),
            vehicle.input_names,
            f"{vehicle.name}, LQG, designed on: {vehicle.card.title}",
        )


KIND = LqgKind()
