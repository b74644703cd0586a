"""An identified (or ready) state-space model as a vehicle: trimmed, held, flown and exported like any other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swashplate.errors import CardError, ControllerError
from swashplate.identification.state_space import StateSpaceModel
from swashplate.simulation.trim import Trim
from swashplate.vehicles.card import Card, Parameter
from swashplate.vehicles.catalogue import from_card
from swashplate.vehicles.linear import NAME, SIZE, entry_name, entry_unit
from swashplate.vehicles.vehicle import Vehicle

DELAYS = "input_delays"
"""Section of the card's `observer` with the identified delay of each input [s]."""
_USUAL_RANGE = {"1": 1.0, "rad": np.radians(20.0), "deg": 20.0}
"""Either way of the trim, where a file does not say how far its inputs go."""


def linear_vehicle(model: StateSpaceModel, *, limits: Mapping[str, tuple[float, float]] | None = None) -> Vehicle:
    """The vehicle of a linear model's present numbers; its delays are kept beside them, for the controller.

    Args:
        model: with u, v, w, phi, theta, p, q and r among its states, deviations from hover.
        limits: of inputs, from the trim; otherwise those of the file's [limits], otherwise 1 (20 degrees) either way.

    Raises:
        CardError: for delays that differ between outputs, limits that are none, or a model that is not enough to fly.
    """
    A, B, _, _ = model.explicit()
    delays = {}
    for name in model.inputs:
        found = {model.delay(output, name) for output in model.outputs} or {0.0}
        if len(found) > 1:
            raise CardError(
                f"comes after {min(found):g} to {max(found):g} s, by output: expected one delay of each input.",
                where=model.name,
                channel=name,
                hint="Give the file one delay per input.",
            )
        delays[name] = max(0.0, found.pop())
    parameters = {}
    for matrix, columns in ((A, model.states), (B, model.inputs)):
        for i, row in enumerate(model.states):
            for j, column in enumerate(columns):
                if matrix[i, j]:
                    unit = entry_unit(model.units.get(row, "1"), model.units.get(column, "1"))
                    parameters[entry_name(row, column)] = Parameter(
                        float(matrix[i, j]), unit, f"derived: {model.title}", "identified"
                    )
    for name in (*model.states, *model.inputs):
        unit = model.units.get(name, "1") or "1"
        parameters[f"trim_{name}"] = Parameter(0.0, unit, "derived: the model counts deviations", "derived")
    ranges = _ranges(model, limits or {})
    options: dict[str, Any] = {
        "states": list(model.states),
        "state_units": [model.units.get(name, "1") or "1" for name in model.states],
        "inputs": list(model.inputs),
        "input_units": [model.units.get(name, "1") or "1" for name in model.inputs],
        "low": [ranges[name][0] for name in model.inputs],
        "high": [ranges[name][1] for name in model.inputs],
    }
    if (size := model.document.get("shape", {}).get(SIZE)) is not None:
        options[SIZE] = float(size)
    card = Card(NAME, model.title, model.trust, options, parameters, observer={DELAYS: delays}, path=model.name)
    return from_card(card)


def _ranges(model: StateSpaceModel, given: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    found = {**model.document.get("limits", {}), **given}
    ranges = {}
    for name in model.inputs:
        usual = _USUAL_RANGE.get(model.units.get(name, "1") or "1", 1.0)
        low, high = found.get(name, (-usual, usual))
        if not low < 0.0 < high:
            raise CardError(
                f"is {low:g} to {high:g}, expected a range about the trim, zero.",
                where=model.name,
                channel=f"limits.{name}",
            )
        ranges[name] = (float(low), float(high))
    return ranges


def unlimited(model: StateSpaceModel) -> tuple[str, ...]:
    """Inputs whose range the file does not say."""
    return tuple(name for name in model.inputs if name not in model.document.get("limits", {}))


def delays_of(vehicle: Vehicle) -> dict[str, float]:
    """Identified delays of a vehicle's inputs [s]; empty where its card holds none."""
    return dict(vehicle.card.observer.get(DELAYS, {}))


def about(vehicle: Vehicle, trim: Trim) -> Vehicle:
    """A linear vehicle about another vehicle's trim: where it flies, deviations count from there.

    Args:
        vehicle: linear.
        trim: of the vehicle that is to be flown; states of the same name move, others keep theirs.

    Raises:
        ControllerError: where the inputs are not the same.
    """
    if trim.input_names != vehicle.input_names:
        raise ControllerError(
            f"has the inputs {', '.join(vehicle.input_names)}, the aircraft {', '.join(trim.input_names)}.",
            where=vehicle.card.title,
        )
    found = {**trim.states(), **trim.commands()}
    names = {f"trim_{n}": found[n] for n in (*vehicle.card.options["states"], *vehicle.input_names) if n in found}
    return vehicle.with_values(names, source="derived: the trim that it is flown at", status="derived")
