"""A linear model as formats carry it: matrices, names, units, delays and the flight that it is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.control.linear_vehicle import delays_of
from swashplate.errors import ExportError
from swashplate.identification.state_space import StateSpaceModel
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim
from swashplate.vehicles.vehicle import Vehicle

Array = NDArray[np.float64]


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

    def delay(self, output: str, input: str) -> float:
        """Delay of one response [s]."""
        return self.delays.get(f"{output}/{input}", self.delays.get(input, 0.0))

    def to_control(self) -> Any:
        """As `control.StateSpace` of python-control with named signals, without the delays."""
        import control

        return control.ss(
            self.A,
            self.B,
            self.C,
            self.D,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
            name=self.name,
        )


def logged_delays(vehicle: Vehicle) -> dict[str, float]:
    """By how much the motion lagged each logged input when a vehicle was identified [s].

    Latency of the radio, the servo pulses and the logger's clock: the equations do not have it, the card's observer
    section remembers it (`delay_motor` for motors, `delay_servo` for all else; a linear model's card by input).

    Raises:
        ExportError: where the card remembers none.
    """
    if own := delays_of(vehicle):
        return own
    found = vehicle.card.observer.get("nuisance", {})
    names = {i: "delay_motor" if i.startswith("motor") else "delay_servo" for i in vehicle.input_names}
    if not found.keys() & set(names.values()):
        raise ExportError(
            "the card remembers no delays.",
            where=vehicle.card.path or vehicle.name,
            channel="--delays",
            hint="Only a model that `swash identify` wrote has them.",
        )
    return {name: max(0.0, float(found.get(key, 0.0))) for name, key in names.items()}


def of_vehicle(vehicle: Vehicle, trim: Trim, *, name: str, delays: Mapping[str, float] | None = None) -> Linear:
    """A vehicle about a trim, exactly differentiated; the outputs are the states. Delays of inputs [s] where given."""
    found = linearize(vehicle, trim)
    units = dict(zip(vehicle.state_names, vehicle.state_units, strict=True))
    units |= dict(zip(vehicle.input_names, vehicle.input_units, strict=True))
    return Linear(
        name,
        vehicle.card.title,
        vehicle.card.trust,
        found.A,
        found.B,
        found.C,
        found.D,
        found.states,
        found.inputs,
        found.states,
        units,
        dict(delays or {}),
        about={**trim.states(), **trim.commands()},
    )


def of_state_space(model: StateSpaceModel, *, name: str) -> Linear:
    """An identified (or ready) linear model with its present numbers.

    Raises:
        CardError: where its left side cannot be solved for the states' derivatives.
    """
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
