"""Rotorflight's law among the kinds of controllers: its file, its loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import msgspec

from swashplate import documents
from swashplate.control.kinds import OneVehiclesKind
from swashplate.control.laws.rotorflight.law import Rigging, RotorflightLaw, RotorflightMode, SticksPilot
from swashplate.control.laws.rotorflight.parameters import DEFAULTS, known
from swashplate.errors import ControllerError

SCHEMA = 1
_RATES = (250.0, 4000.0)


class _LawFile(msgspec.Struct, forbid_unknown_fields=True):
    kind: str
    schema: Literal[1]
    type: str
    vehicle: str
    model: str
    mode: RotorflightMode
    hover: float
    rate: float
    rigging: dict[str, float]
    pilot: dict[str, float]
    parameters: dict[str, float]


class RotorflightKind(OneVehiclesKind[RotorflightLaw]):
    """Rotorflight's rate loops with a pilot, fed with the states; it starts with integrals that hold the trim."""

    def to_document(self, controller: RotorflightLaw) -> dict[str, Any]:
        return {
            "kind": "controller",
            "schema": SCHEMA,
            "type": controller.type,
            "vehicle": controller.vehicle,
            "model": controller.model,
            "mode": controller.mode,
            "hover": float(controller.hover),
            "rate": controller.rate,
            "rigging": {name: float(value) for name, value in controller.rigging._asdict().items()},
            "pilot": {name: float(value) for name, value in controller.pilot._asdict().items()},
            "parameters": {name: float(value) for name, value in controller.parameters.items()},
        }

    def from_document(self, document: Mapping[str, Any], path: str) -> RotorflightLaw:
        read = documents.checked(document, _LawFile, where=path, error=ControllerError)
        for channel, entries, expected in (
            ("rigging", read.rigging, Rigging._fields),
            ("pilot", read.pilot, SticksPilot._fields),
        ):
            if set(entries) != set(expected):
                problem = f"has {', '.join(entries)}, expected {', '.join(expected)}."
                raise ControllerError(problem, where=path, channel=channel)
        low, high = _RATES
        if not low <= read.rate <= high:
            raise ControllerError(f"is {read.rate:g} Hz, expected {low:g} to {high:g}.", where=path, channel="rate")
        strange = sorted(set(read.parameters) - set(DEFAULTS))
        if strange:
            raise ControllerError("is no parameter of the law.", where=path, channel=f"parameters.{strange[0]}")
        rigging, pilot = Rigging(**read.rigging), SticksPilot(**read.pilot)
        numbers = known(read.parameters)
        return RotorflightLaw(
            read.vehicle, read.model, read.mode, numbers, rigging, pilot, read.hover, 4, rate=read.rate
        )


KIND = RotorflightKind()
