"""ArduPilot's law among the kinds of controllers: its file, its loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import msgspec

from swashplate import documents
from swashplate.control.kinds import OneVehiclesKind
from swashplate.control.laws.ardupilot.law import ArduPilotLaw, FlightMode
from swashplate.control.laws.ardupilot.mixers import FRAMES
from swashplate.control.laws.ardupilot.outputs import LawFirmware
from swashplate.control.laws.ardupilot.parameters import DEFAULTS, known
from swashplate.errors import ControllerError

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


class ArduPilotKind(OneVehiclesKind[ArduPilotLaw]):
    """ArduPilot's cascade, fed with the states; it starts with integrals that hold the trim."""

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
