"""The autopilot among the kinds of controllers: its file, its C."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from swashplate import documents
from swashplate.control.kinds import OneVehiclesKind, TracedStep
from swashplate.control.laws.autopilot import MODES, Autopilot, CyclicGains, Gains, Memory, Mode, Reference, step
from swashplate.control.laws.decoupling import Decoupler
from swashplate.control.laws.height_yaw import CoaxialRotors, HeightYawGains, HeightYawMemory
from swashplate.errors import ControllerError
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.rigid_body import RigidBody

SCHEMA = 1
_GROUPS: dict[str, Any] = {
    "motors": HeightYawGains,
    "rotors": CoaxialRotors,
    "cyclic": CyclicGains,
    "law": Decoupler,
}
_ADDED = ("linkage_asymmetry", "phase_asymmetry")
"""Numbers that files of earlier versions do not have."""
_NUMBERS: dict[str, Any] = {
    name: msgspec.defstruct(
        name,
        [(field, float, kind._field_defaults[field]) if field in _ADDED else (field, float) for field in kind._fields],
        forbid_unknown_fields=True,
    )
    for name, kind in _GROUPS.items()
}
_FILE: Any = msgspec.defstruct(
    "AutopilotFile",
    [
        ("kind", str),
        ("schema", Literal[1]),
        ("type", str),
        ("vehicle", str),
        ("model", str),
        ("mode", Mode),
        ("rate", float),
        *_NUMBERS.items(),
    ],
    forbid_unknown_fields=True,
)


class AutopilotKind(OneVehiclesKind[Autopilot]):
    """The autopilot of a coaxial helicopter, fed with the states."""

    every_mode = True

    def to_document(self, controller: Autopilot) -> dict[str, Any]:
        return {
            "kind": "controller",
            "schema": SCHEMA,
            "type": controller.type,
            "vehicle": controller.vehicle,
            "model": controller.model,
            "mode": controller.mode,
            "rate": controller.rate,
            **{name: getattr(controller.numbers, name)._asdict() for name in _GROUPS},
        }

    def from_document(self, document: dict[str, Any], path: str) -> Autopilot:
        if document.get("mode") not in MODES:
            mode = document.get("mode")
            raise ControllerError(f"is {mode!r:.60}, expected {', '.join(MODES)}.", where=path, channel="mode")
        read = documents.checked(document, _FILE, where=path, error=ControllerError)
        if read.rate <= 0.0:
            raise ControllerError(f"is {read.rate:g} Hz, expected a positive rate.", where=path, channel="rate")
        groups = {name: kind(**msgspec.structs.asdict(getattr(read, name))) for name, kind in _GROUPS.items()}
        return Autopilot(read.vehicle, read.model, read.mode, Gains(1.0 / read.rate, **groups))

    def traced(self, controller: Autopilot) -> TracedStep:
        import casadi

        names = ("height", "heading", "spool", "ahead", "right")
        memory, measured, reference = (
            casadi.SX.sym(name, n)
            for name, n in (("memory", len(names)), ("measured", len(RigidBody._fields) + 1), ("reference", 8))
        )
        carried = Memory(HeightYawMemory(memory[0], memory[1], memory[2]), memory[3], memory[4])
        body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
        wanted = Reference(*(reference[i] for i in range(len(Reference._fields))))
        after, command = step(carried, body, measured[len(body)], wanted, controller.numbers, CasadiBackend())
        results = casadi.vertcat(*after.motors, after.ahead, after.right, *command)
        return TracedStep(
            casadi.Function("swash_traced", [memory, measured, reference], [results]),
            tuple(controller.memory.tolist()),
            ", ".join(names),
            (*RigidBody._fields, "voltage"),
            command._fields,
            f"{controller.vehicle}, mode {controller.mode}, designed on: {controller.model}",
        )


KIND = AutopilotKind()
