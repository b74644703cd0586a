"""Kinds of controllers: what each can be asked beside its step, found by the `type` of its file.

A controller itself is small (`swashplate.simulation.controller.Controller`): a rate, a memory, a step. Its kind
knows how it becomes a file, how it is taken to another vehicle, which loop is judged, and how its step becomes C. A
controller says its kind by an attribute `type`; one that says none is of the plain kind. Another package adds a kind by
an entry point of the group `swashplate.controllers` that names an instance of a `ControllerKind`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import tomli_w

from swashplate import documents
from swashplate.atomic import write_text
from swashplate.control.analysis.judged_loop import Aircraft, JudgedLoop, judged_with_states
from swashplate.control.analysis.margins import Margins
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.registry import Registry
from swashplate.simulation.controller import Controller, DesignedLaw
from swashplate.simulation.trim import Trim

C = TypeVar("C", bound=Controller)
D = TypeVar("D", bound=DesignedLaw)


@dataclass(frozen=True)
class TracedStep:
    """A step as a CasADi function of (memory, measured, reference) to (memory, command), and what its rows hold.

    Attributes:
        function: of columns; its result is memory and command in one.
        start: what the memory starts with.
        memory: what it holds, in words.
        measured, commands: names, in order.
        about: what it is for, in a line.
    """

    function: Any
    start: tuple[float, ...]
    memory: str
    measured: tuple[str, ...]
    commands: tuple[str, ...]
    about: str


class ControllerKind(Generic[C]):
    """What one kind of controller can be asked; the methods here are right for one that is fed with the states.

    Attributes:
        takes_stick: whether it answers a pilot's roll and pitch commands.
        own_sensors: whether it simulates sensors of its own, with their noise.
        every_mode: whether other gains make it an autopilot of every mode of the live page; "position" alone if not.
    """

    takes_stick: bool = True
    own_sensors: bool = False
    every_mode: bool = False

    def about(self, controller: C, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> C:
        """The same law for that vehicle at that trim; `seed` is of its sensors' noise.

        Raises:
            ControllerError: where it is for another vehicle.
        """
        return controller

    def judged(self, controller: C, flying: Aircraft) -> JudgedLoop:
        """The loop that margins, modes and disturbance rejection are told of.

        Raises:
            SwashError: where there is none.
        """
        return judged_with_states(controller, flying)

    def differences(self, controller: C, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        """How far what flies is from the model of the design, in words; nothing where it is the same."""
        return ()

    def to_document(self, controller: C) -> dict[str, Any]:
        """What its file says.

        Raises:
            ControllerError: where this kind has no file.
        """
        raise ControllerError("has no file: it is made where it flies.", where=type(controller).__name__)

    def from_document(self, document: dict[str, Any], path: str) -> C:
        """The controller of a file's document; `path` is named in messages.

        Raises:
            ControllerError: naming the file and the entry that is missing, unknown or of the wrong size.
        """
        raise ControllerError("is of a kind that has no file.", where=path)

    def traced(self, controller: C) -> TracedStep:
        """One step for CasADi, which must be installed.

        Raises:
            ControllerError: where its step cannot be printed as C.
        """
        raise ControllerError("has no C of its own yet.", where=type(controller).__name__)


class OneVehiclesKind(ControllerKind[D]):
    """Of a law for one vehicle's equations, which knows the model of its design by the title only."""

    def about(self, controller: D, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> D:
        if controller.vehicle != vehicle.name:
            raise ControllerError(f"is for '{controller.vehicle}', not for '{vehicle.name}'.", where=controller.model)
        return controller.at(vehicle, trim)

    def differences(self, controller: D, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        theirs = flying.vehicle.card.title
        return () if controller.model == theirs else (f"Designed on '{controller.model}', flown on '{theirs}'.",)


PLAIN: ControllerKind[Any] = ControllerKind()
"""Of a controller that says nothing of itself."""

CONTROLLERS: Registry[ControllerKind[Any]] = Registry(
    "controllers",
    what="type of controller",
    own={
        "ardupilot": "swashplate.control.laws.ardupilot.kind:KIND",
        "autopilot": "swashplate.control.laws.autopilot_kind:KIND",
        "lqg": "swashplate.control.lqg.kind:KIND",
        "rotorflight": "swashplate.control.laws.rotorflight.kind:KIND",
    },
)


def kind_of(controller: Controller) -> ControllerKind[Any]:
    """The kind of a controller, by its `type`.

    Raises:
        ControllerError: what is no controller.
    """
    if not isinstance(controller, Controller):
        raise ControllerError(f"is {controller!r}, expected a controller or its file.", channel="controller")
    return CONTROLLERS[controller.type] if controller.type else PLAIN


def save_controller(controller: Controller, path: str | Path) -> None:
    """Write a controller as a TOML file.

    Raises:
        ControllerError: where its kind has no file.
    """
    write_text(path, tomli_w.dumps(kind_of(controller).to_document(controller)))


def load_controller(path: str | Path) -> Controller:
    """A controller from its file, of any type that is known here or in another package.

    Args:
        path: what `swash control decouple --out`, `swash control design --out` or `save` of their results wrote.

    Raises:
        ControllerError: naming the file and the entry that is missing, unknown or of the wrong size.
    """
    document = documents.read_document(path, form="toml", error=ControllerError)
    if document.get("kind") != "controller":
        raise ControllerError(
            f"kind is {document.get('kind')!r:.60}, expected 'controller'.",
            where=path,
            hint="`swash control decouple MODEL --out FILE` writes one.",
        )
    name = document.get("type")
    if not isinstance(name, str) or name not in CONTROLLERS:
        raise ControllerError(f"is {name!r:.60}, expected {', '.join(CONTROLLERS)}.", where=path, channel="type")
    controller: Controller = CONTROLLERS[name].from_document(document, str(path))
    return controller
