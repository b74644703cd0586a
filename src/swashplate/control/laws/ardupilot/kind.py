"""ArduPilot's law among the kinds of controllers: its file, its loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import msgspec

from swashplate import documents
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.margins import Margins
from swashplate.control.kinds import ControllerKind
from swashplate.control.laws.ardupilot.law import ArduPilotLaw, FlightMode
from swashplate.control.laws.ardupilot.mixers import FRAMES
from swashplate.control.laws.ardupilot.outputs import LawFirmware
from swashplate.control.laws.ardupilot.parameters import DEFAULTS, known
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

SCHEMA = 1
_RATES = (50.0, 2000.0)


class _LawFile(msgspec.Struct, forbid_unknown_fields=True):
    kind: str
    schema: Literal[1]
    type: str
    vehicle: str
    model: str
    mode: FlightMode
    frame: str
    inputs: int
    rate: float
    firmware: LawFirmware
    mixer: dict[str, float]
    parameters: dict[str, float]


class ArduPilotKind(ControllerKind[ArduPilotLaw]):
    """ArduPilot's cascade, fed with the states; it starts with integrals that hold the trim."""

    def about(self, controller: ArduPilotLaw, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> ArduPilotLaw:
        if controller.vehicle != vehicle.name:
            raise ControllerError(f"is for '{controller.vehicle}', not for '{vehicle.name}'.", where=controller.model)
        return controller.at(vehicle, trim)

    def differences(self, controller: ArduPilotLaw, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        designed_on, theirs = controller.model, flying.vehicle.card.title
        return () if designed_on == theirs else (f"Designed on '{designed_on}', flown on '{theirs}'.",)

    def to_document(self, controller: ArduPilotLaw) -> dict[str, Any]:
        return {
            "kind": "controller",
            "schema": SCHEMA,
            "type": controller.type,
            "vehicle": controller.vehicle,
            "model": controller.model,
            "mode": controller.mode,
            "frame": controller.frame,
            "inputs": controller.inputs,
            "rate": controller.rate,
            "firmware": controller.firmware,
            "mixer": {name: float(value) for name, value in controller.mixer._asdict().items()},
            "parameters": {name: float(value) for name, value in controller.parameters.items()},
        }

    def from_document(self, document: Mapping[str, Any], path: str) -> ArduPilotLaw:
        read = documents.checked(document, _LawFile, where=path, error=ControllerError)
        if read.frame not in FRAMES:
            raise ControllerError(f"is '{read.frame}', expected {', '.join(FRAMES)}.", where=path, channel="frame")
        kind = FRAMES[read.frame]
        if set(read.mixer) != set(kind._fields):
            problem = f"has {', '.join(read.mixer)}, expected {', '.join(kind._fields)}."
            raise ControllerError(problem, where=path, channel="mixer")
        low, high = _RATES
        if not low <= read.rate <= high:
            raise ControllerError(f"is {read.rate:g} Hz, expected {low:g} to {high:g}.", where=path, channel="rate")
        strange = sorted(set(read.parameters) - set(DEFAULTS))
        if strange:
            raise ControllerError("is no parameter of the law.", where=path, channel=f"parameters.{strange[0]}")
        numbers = known(read.parameters, frame=read.frame)
        mixer = kind(**read.mixer)
        return ArduPilotLaw(read.vehicle, read.model, read.mode, numbers, mixer, read.inputs, read.rate, read.firmware)


KIND = ArduPilotKind()
