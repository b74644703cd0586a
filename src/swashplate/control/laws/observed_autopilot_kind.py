"""The autopilot on estimates among the kinds of controllers: two controllers in one file, the law's loop."""

from __future__ import annotations

from typing import Any

from swashplate.control.analysis.judged_loop import Aircraft, JudgedLoop, judged_with_states
from swashplate.control.analysis.margins import Margins
from swashplate.control.kinds import ControllerKind, TracedStep
from swashplate.control.laws.autopilot_kind import KIND as LAW
from swashplate.control.laws.observed_autopilot import ObservedAutopilot
from swashplate.control.lqg.kind import KIND as OBSERVER
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

_FED = (
    "Modes, margins, disturbance rejection and bandwidth are those of the law fed with the true states: the observer's "
    "own lag is not in them. The steps are flown with its noisy sensors."
)


class ObservedAutopilotKind(ControllerKind[ObservedAutopilot]):
    """An autopilot fed by an observer."""

    own_sensors = True

    def about(self, controller: ObservedAutopilot, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> ObservedAutopilot:
        LAW.about(controller.autopilot, vehicle, trim)
        return controller.starting_at(trim, seed=seed)

    def judged(self, controller: ObservedAutopilot, flying: Aircraft) -> JudgedLoop:
        return judged_with_states(controller.autopilot, flying, notes=(_FED,))

    def differences(self, controller: ObservedAutopilot, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        return OBSERVER.differences(controller.observer, flying, margins)

    def to_document(self, controller: ObservedAutopilot) -> dict[str, Any]:
        """The autopilot's document and, in [observer], the observer's."""
        law = LAW.to_document(controller.autopilot)
        return {**law, "type": controller.type, "observer": OBSERVER.to_document(controller.observer)}

    def from_document(self, document: dict[str, Any], path: str) -> ObservedAutopilot:
        observer = document.get("observer")
        if not isinstance(observer, dict):
            raise ControllerError("is missing.", where=path, channel="[observer]")
        law = LAW.from_document({name: part for name, part in document.items() if name != "observer"}, path)
        return ObservedAutopilot(law, OBSERVER.from_document(observer, path))

    def traced(self, controller: ObservedAutopilot) -> TracedStep:
        raise ControllerError(
            "flies on estimates, and its C is not written yet.",
            where=controller.autopilot.model,
            hint="Export the law alone (`swash decouple` without --sensors) or an LQG (`swash control design`).",
        )


KIND = ObservedAutopilotKind()
