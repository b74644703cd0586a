"""What a controller is: a rate, a memory, and a step that becomes a graph; what it may have beside is declared here."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.law import FELT, REFERENCES, LawGraph, draw_names
from swashplate.engine.roots import require_casadi
from swashplate.engine.symbols import SymbolArrays, expressions, symbols
from swashplate.engine.untraced import untraced
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

Step = Callable[[Any, Any, Any, Any, Any], tuple[Any, Any]]
"""`(memory, measured, reference, gains, xp) -> (memory, commands)`, on rows of numbers or of symbols.

`measured` is the vehicle's state row, the battery voltage and what sensors of its own draw, `reference` the row of
`REFERENCES`, `xp` the array functions: NumPy, or `engine.symbols.SymbolArrays` for a trace.
"""


class Controller(ABC):
    """Something that turns measured states into inputs. What is not abstract here, a controller need not have.

    Attributes:
        rate: how often it runs [Hz]; a whole part of the simulation's rate.
        type: of its file; "" where it has none.
        at_once: whether it only keeps an aircraft in the room for an experiment, and none of its commands are late
            unless delays are given.
    """

    if TYPE_CHECKING:  # a dataclass would take a property for the default of its field

        @property
        def rate(self) -> float: ...

    type: ClassVar[str] = ""
    at_once: ClassVar[bool] = False

    @property
    def delays(self) -> Mapping[str, float]:
        """From command to action as it was designed for, by input [s]; empty where it was designed without."""
        return {}

    @property
    def drawn(self) -> int:
        """How many numbers sensors of its own draw at each step."""
        return 0

    @abstractmethod
    def law(self, vehicle: Vehicle) -> LawGraph:
        """Its step as a graph, for a vehicle with these states.

        Raises:
            ExportError: for a step that CasADi cannot trace.
            MissingLibraryError: without CasADi.
        """

    @abstractmethod
    def memory_of_law(self, seed: int | None = None) -> Array:
        """What its law carries at the start; `seed` is of sensors of its own, None for its usual one."""

    def draws(self, samples: int, seed: int | None = None) -> Array:
        """What sensors of its own draw for each of its samples, shape (samples, drawn)."""
        return np.zeros((samples, 0))

    def with_seed(self, seed: int) -> Controller:
        """The same with other noise of its own sensors, where it has any."""
        return self


class StepController(Controller):
    """A controller whose step is a function of rows (`Step`).

    Attributes:
        memory: its state at the start, a row of numbers.
        gains: its numbers, a row; no part of what is compiled.
        step: see `Step`.
    """

    if TYPE_CHECKING:

        @property
        def memory(self) -> Array: ...
        @property
        def gains(self) -> Array: ...
        @property
        def step(self) -> Step: ...

    def law(self, vehicle: Vehicle) -> LawGraph:
        return law_of_step(self.step, vehicle, len(self.memory), len(self.gains), drawn=self.drawn)

    def memory_of_law(self, seed: int | None = None) -> Array:
        return np.concatenate([self.memory, self.gains]).astype(np.float64)


class DesignedLaw(StepController):
    """One for one vehicle's equations.

    Attributes:
        vehicle: the name of the equations that it is for.
        model: the title of the card that its numbers are from.
    """

    if TYPE_CHECKING:

        @property
        def vehicle(self) -> str: ...
        @property
        def model(self) -> str: ...

    def at(self, vehicle: Vehicle, trim: Trim) -> Self:
        """The same with a memory that holds that trim already, where it has one."""
        return self


def told_names(vehicle: Vehicle, drawn: int) -> tuple[str, ...]:
    """All that a flight of a vehicle tells a controller, in order."""
    return (*vehicle.state_names, *FELT, "voltage", *draw_names(drawn))


def law_of_step(step: Step, vehicle: Vehicle, memory: int, gains: int, *, drawn: int = 0) -> LawGraph:
    """A step as a graph; the gains are carried behind the memory, so that others compile nothing anew.

    Raises:
        ExportError: where CasADi cannot trace it.
    """
    casadi = require_casadi()
    measured = (*vehicle.state_names, "voltage", *draw_names(drawn))
    sizes = {"memory": memory + gains, "measured": len(measured), "reference": len(REFERENCES)}
    carried, heard, asked = (casadi.SX.sym(name, size) for name, size in sizes.items())
    row = symbols(carried)
    try:
        after, commands = step(row[:memory], symbols(heard), symbols(asked), row[memory:], SymbolArrays())
        results = casadi.vertcat(expressions(after), carried[memory:], expressions(commands))
    except Exception as error:  # whatever a step of another package does with numbers that are none
        raise untraced(error, "step", getattr(step, "__name__", "step")) from error
    function = casadi.Function("swash_traced", [carried, heard, asked], [casadi.densify(results)], {"cse": True})
    return LawGraph(function, measured, told_names(vehicle, drawn), memory + gains, drawn, fixed=gains)
