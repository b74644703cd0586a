"""The verbs `structures` and `show_structure`: what a linear model can be made of, and what one is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from swashplate.models.linear.composition import PREFIX
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure, structure_names
from swashplate.models.linear.structure_parts import PARTS
from swashplate.models.linear.written import WrittenStructure
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Saved


@dataclass(frozen=True)
class Structures(Saved):
    """What a linear model can be made of.

    Attributes:
        ready: titles of the ready structures by name.
        parts: what "compose:" takes, by name, a line each.
    """

    ready: dict[str, str]
    parts: dict[str, str]

    def to_document(self) -> dict[str, object]:
        return {"ready": self.ready, "parts": self.parts}

    def __repr__(self) -> str:
        wide = max(map(len, (*self.ready, *self.parts))) + 2
        lines = ["Ready structures:", *(f"  {name:<{wide}}{title}" for name, title in self.ready.items()), ""]
        lines += [f"Parts, joined by + after {PREFIX} (for example {PREFIX}body+flap+inflow+torque):"]
        for name, about in self.parts.items():
            needs = " or ".join(PARTS[name].needs)
            lines.append(f"  {name:<{wide}}{about}{f' (with {needs})' if needs else ''}")
        return "\n".join(lines)


def structures() -> Structures:
    """The ready structures, and the parts of which others are composed."""
    return Structures(
        {name: structure(name).title for name in structure_names()}, {name: part.about for name, part in PARTS.items()}
    )


def show_structure(model: Vehicle | StateSpaceModel | str | Path) -> WrittenStructure:
    """A structure as a person writes it: equations, parameters with unit, start value and where that comes from.

    Args:
        model: a ready structure's name, "compose:body+flap+...", a state-space file, or a linear model.

    Raises:
        CardError, ExpressionError: naming the file, the entry or the part, what was found and what was expected.
    """
    return WrittenStructure(structure(model) if isinstance(model, str | Path) else structure_of(model))
