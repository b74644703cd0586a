"""A linear model as formats carry it: matrices, names, units, delays and the flight that it is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from swashplate.arrays import Array
from swashplate.errors import ExportError
from swashplate.models.linear import python_control
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim


@dataclass(frozen=True)
class Linear:
    """dx/dt = A x + B u(t - delay), y = C x + D u(t - delay), in deviations from `about`.

    Attributes:
        name, title, trust: what it is and where it holds.
        A, B, C, D: matrices (n, n), (n, m), (k, n), (k, m).
        states, inputs, outputs: names.
        units: by name.
        delays: [s] by input, or by "output/input" for one response.
        about: states and inputs by name at the flight that deviations count from; empty where that is not known.
        origin: what its file says that it was made from, a line each; empty where it says nothing.
    """

    name: str
    title: str
    trust: str
    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    delays: Mapping[str, float] = field(default_factory=dict)
    about: Mapping[str, float] = field(default_factory=dict)
    origin: tuple[str, ...] = ()

    def delay(self, output: str, input: str) -> float:
        """Delay of one response [s]."""
        return self.delays.get(f"{output}/{input}", self.delays.get(input, 0.0))

    def to_control(self, *, pade: int | None = None) -> Any:
        """As `control.StateSpace` of python-control with named signals.

        Args:
            pade: order of the polynomials that stand for the delays; 0 leaves the delays out, None does so with a
                warning where there are any.

        Raises:
            SwashError: an order outside 0 to 12.
        """
        return python_control.state_space(
            (self.A, self.B, self.C, self.D),
            states=self.states,
            inputs=self.inputs,
            outputs=self.outputs,
            delays=self.delays,
            pade=pade,
            name=self.name,
        )


def logged_delays(vehicle: Vehicle) -> dict[str, float]:
    """The identified delays of a vehicle's inputs [s] (see `input_delays`).

    Raises:
        ExportError: where the card remembers none.
    """
    if not (delays := input_delays(vehicle)):
        raise ExportError(
            "the card remembers no delays.",
            where=vehicle.card.path or vehicle.name,
            channel="--delays",
            hint="Only a model that `swash identify` wrote has them.",
        )
    return delays


def of_vehicle(vehicle: Vehicle, trim: Trim, *, name: str, delays: Mapping[str, float] | None = None) -> Linear:
    """A vehicle about a trim, exactly differentiated; the outputs are the states. Delays of inputs [s] where given."""
    linear = linearize(vehicle, trim)
    units = dict(zip(vehicle.state_names, vehicle.state_units, strict=True))
    units |= dict(zip(vehicle.input_names, vehicle.input_units, strict=True))
    return Linear(
        name,
        vehicle.card.title,
        vehicle.card.trust,
        linear.A,
        linear.B,
        linear.C,
        linear.D,
        linear.states,
        linear.inputs,
        linear.states,
        units,
        dict(delays or {}),
        about={**trim.states(), **trim.commands()},
    )


def of_state_space(model: StateSpaceModel, *, name: str) -> Linear:
    """An identified (or ready) linear model with its present numbers.

    Raises:
        CardError: where its left side cannot be solved for the states' derivatives, or entries have own delays.
    """
    model.refuse_entry_delays("exports hold the delay of")
    numbers = model.numbers()
    return Linear(
        name,
        model.title,
        model.trust,
        *model.explicit(),
        model.states,
        model.inputs,
        model.outputs,
        dict(model.units),
        {name: float(expression(numbers)) for name, expression in model.delays.items()},
    )
