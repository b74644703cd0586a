"""`swash vehicle list`, `show`, `new`, `stitch` and `structures`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FromFewLogs
from swashplate.api.languages import Aircraft, Logs, Things
from swashplate.api.question import VerbQuestion, argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.models.card import Card
    from swashplate.models.vehicle import Vehicle


class ListVehicles(VerbQuestion[Any]):
    """List the vehicles by name."""

    def answer(self, say: Say = silent) -> Any:
        from swashplate.models.catalogue import cards_by_name

        return cards_by_name()

    def document(self, answer: Any) -> Any:
        return {name: {"title": card.title, "trust": card.trust} for name, card in answer[0].items()}

    def text(self, answer: Any, width: int) -> list[Any]:
        from swashplate.text_table import text_columns

        return [text_columns(("name", "what it is"), [(name, card.title) for name, card in answer[0].items()], left=2)]

    def remarks(self, answer: Any) -> list[str]:
        return [f"Careful: {fault}" for fault in answer[1]]


@dataclass(frozen=True)
class ShownVehicle:
    """A vehicle, and its hover where that was asked for."""

    vehicle: Vehicle
    hover: Any = None


class ShowVehicle(VerbQuestion[ShownVehicle]):
    """Describe a vehicle, the range of its card, and every number with unit, status and source."""

    vehicle: Aircraft = argument(metavar="NAME", help="A vehicle's name, or a card or model file.", complete="vehicle")
    trim: bool = option(default=False, help="Also the hover: its inputs, states and modes.")

    def answer(self, say: Say = silent) -> ShownVehicle:
        from swashplate.models.catalogue import vehicle
        from swashplate.models.vehicle import Vehicle

        chosen = self.vehicle if isinstance(self.vehicle, Vehicle) else vehicle(self.vehicle)
        if not self.trim:
            return ShownVehicle(chosen)
        from swashplate.simulation.trim import trim

        return ShownVehicle(chosen, trim(chosen))

    def document(self, answer: ShownVehicle) -> Any:
        vehicle, card = answer.vehicle, answer.vehicle.card
        document: dict[str, Any] = {
            "vehicle": card.vehicle,
            "title": card.title,
            "trust": card.trust,
            "options": card.options,
            "states": dict(zip(vehicle.state_names, vehicle.state_units, strict=True)),
            "inputs": {
                name: list(limits) for name, limits in zip(vehicle.input_names, vehicle.input_limits, strict=True)
            },
            "parameters": {name: vars(parameter) for name, parameter in card.parameters.items()},
        }
        if answer.hover is not None:
            document["trim"] = {"inputs": answer.hover.commands(), "states": answer.hover.states()}
        return document

    def text(self, answer: ShownVehicle, width: int) -> list[Any]:
        from swashplate.reporting.terminal_tables import parameter_table

        vehicle, card = answer.vehicle, answer.vehicle.card
        parts: list[Any] = [
            card.title,
            f"Trust: {card.trust}",
            f"States: {', '.join(vehicle.state_names)}\nInputs: {', '.join(vehicle.input_names)}\n",
            parameter_table(vehicle),
        ]
        if answer.hover is not None:
            from swashplate.simulation.linearize import linearize

            parts.append(f"\n{answer.hover!r}\n\n{linearize(vehicle, answer.hover)!r}")
        return parts


class NewVehicle(VerbQuestion["Card"]):
    """Write a commented card for your own single-rotor helicopter: statistics of its class, to be measured."""

    file: Path = argument(metavar="FILE", help="The card to write, e.g. mine.toml.")
    mass: float = option(help="Mass with fuel or battery.", unit="kg")
    radius: float = option(help="Radius of the main rotor.", unit="m")
    title: str = option(default="My helicopter", help="Title of the card.")
    rotation: str = option(default="cw", help="Direction of the main rotor, seen from above.", choices=("cw", "ccw"))
    size_class: str | None = setting(
        default=None,
        help="class whose statistics are used; by default from mass and radius.",
        choices=("full-size", "rmax", "600", "90", "micro"),
    )
    like: Aircraft | None = option(default=None, help="Scale a packaged helicopter instead of using a class.")

    def answer(self, say: Say = silent) -> Card:
        from swashplate.atomic import write_text
        from swashplate.models.catalogue import from_card
        from swashplate.models.conventional.new_card import commented, new_card

        if self.file.exists():
            raise SwashError("exists already; it is not overwritten.", where=self.file, hint="Choose another name.")
        card = new_card(
            self.title,
            mass=self.mass,
            radius=self.radius,
            rotation=self.rotation,
            like=self.like,
            size_class=self.size_class,
        )
        from_card(card)
        write_text(self.file, commented(card))
        return card

    def document(self, answer: Card) -> Any:
        return {"written": str(self.file), "title": answer.title}

    def text(self, answer: Card, width: int) -> list[Any]:
        told = f"Written: {self.file}. Replace the guesses by measurements, then try: swash vehicle trim {self.file}"
        if self.like is not None:
            return [told]
        named = self.size_class
        return [f"Numbers of {self._usual().why}." if named is None else f"Numbers of class {named}, as asked.", told]

    def remarks(self, answer: Card) -> list[str]:
        if self.like is not None or self.size_class in (None, self._usual().name):
            return []
        return [f"Careful: mass and radius ask for {self._usual().why}."]

    def _usual(self) -> Any:
        from swashplate.models.conventional.new_card import default_class

        return default_class(self.mass, self.radius)


class StitchModels(FromFewLogs["Vehicle"]):
    """Stitch linear models at several speeds into one that trims, flies, exports and links like every vehicle.

    Trims and derivatives are interpolated over the air speed ahead; gravity and kinematics are nonlinear. Points are
    files of `swash vehicle linearize --out` or identified models with [trim]. It trims, flies and is saved as any
    vehicle. Between the points it is near what they were made of; beyond them trims and derivatives are held.

    Raises:
        CardError: fewer than two points, two at one speed, other states, inputs or units, no trim, no level flight,
            kinematics or gravity that do not belong to the trim.
        SwashError: trims that are not as many as the points, or a flight without what its means shall tell.
    """

    files: ClassVar[tuple[str, ...]] = ("model.toml",)
    needs_out: ClassVar[bool] = True

    points: Things = argument(metavar="POINT...", help="Model files, one a speed, or their folder.")
    trim: Logs | None = option(
        default=None, help="Flight whose mean values are a point's trim; one for each point, in order."
    )
    gradients: str | None = setting(
        default=None,
        help="how trims change with speed: from the points' derivatives, or from differences of the trims (default for "
        "identified points).",
        choices=("derivatives", "trims"),
    )
    title: str = setting(default="", help="title of the model.")

    def answer(self, say: Say = silent) -> Vehicle:
        from swashplate.api.stitch import stitch_asked

        return stitch_asked(self)

    def write(self, answer: Vehicle, folder: Path, names: tuple[str, ...]) -> None:
        for name in names:
            answer.save(folder / name)

    def document(self, answer: Vehicle) -> Any:
        return {"vehicle": answer.name, "title": answer.card.title}


stitch = verb("stitch", StitchModels)


class ShowStructures(VerbQuestion[Any]):
    """List ready structures of linear models and the parts that `compose:` takes, or show the equations of one.

    Of one: equations and free parameters, with units, start values and where these come from; --out FILE.toml writes
    it as a model file.
    """

    files: ClassVar[tuple[str, ...]] = ("structure.toml",)

    structure: Aircraft | None = argument(
        default=None, metavar="STRUCTURE", help="A ready structure, compose:body+flap+..., or a model file."
    )

    def check_places(self, outs: tuple[Path, ...]) -> None:
        for out in outs:
            if out.is_file():
                raise SwashError("exists already; it is not overwritten.", where=out, hint="Choose another name.")
            if self.structure is None:
                raise SwashError("is for one structure.", channel="--out", hint="Name one.")

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.structures import show_structure, structures

        return structures() if self.structure is None else show_structure(self.structure)

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.models.catalogue import structure

        for name in names:
            structure(self.structure).save(folder / name)  # pyrefly: ignore[bad-argument-type]

    def document(self, answer: Any) -> Any:
        return answer.to_document()
