"""An identified (or ready) state-space model as a vehicle: trimmed, held, flown and exported like any other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter
from swashplate.models.linear.card_vehicle import NAME, SIZE, entry_name, entry_unit, linear
from swashplate.models.linear.state_space import UNMOVED, ModelParameter, StateSpaceModel
from swashplate.models.linear.state_space_file import to_toml
from swashplate.models.surroundings import BY_ENTRY, BY_OUTPUT, SECTION
from swashplate.models.vehicle import Vehicle

USUAL_RANGE = {"1": 1.0, "rad": np.radians(20.0), "deg": 20.0}
"""Either way of the trim, where a file does not say how far its inputs go."""


@dataclass(frozen=True)
class StateSpaceVehicle(Vehicle):
    """A vehicle of a state-space model: its card holds the matrices, `structure` the expressions behind them."""

    def with_values(self, values: Mapping[str, float], **changes: Any) -> Vehicle:
        """A copy with other numbers: the structure's parameters, whose matrices follow, or single entries of matrices.

        What single entries are changed of has no structure any more.
        """
        model = self.structure
        if model is None or not values.keys() <= model.parameters.keys():
            return self.with_card(self.card.with_values(values, **changes))
        known = {field.name for field in fields(ModelParameter)}
        kept = {name: value for name, value in changes.items() if name in known}
        return linear_vehicle(model.with_values(values, **kept))

    def with_card(self, card: Card) -> Vehicle:
        vehicle = super().with_card(card)
        same = card.values() == self.card.values() and dict(card.options) == dict(self.card.options)
        return vehicle if same else linear(card)

    def save(self, path: str | Path) -> Path:
        """Write the model's file, which `swashplate.vehicle` reads."""
        from swashplate.atomic import write_text

        return super().save(path) if self.structure is None else write_text(path, to_toml(self.structure))

    def __repr__(self) -> str:
        return f"{super().__repr__()}\n{self.structure!r}"


def structure_of(model: Vehicle | StateSpaceModel) -> StateSpaceModel:
    """The matrices of named expressions of a vehicle that has them (or which are given themselves).

    Raises:
        CardError: for a vehicle of other equations.
    """
    structure = model.structure if isinstance(model, Vehicle) else model
    if structure is None:
        assert isinstance(model, Vehicle)
        raise CardError(
            "has no matrices of named parameters, which this needs.",
            where=model.card.where,
            hint="Give a state-space file or `swashplate.structure(...)`; `swashplate.linearize` makes matrices.",
        )
    return structure


def linear_vehicle(model: StateSpaceModel, *, limits: Mapping[str, tuple[float, float]] | None = None) -> Vehicle:
    """The vehicle of a linear model's present numbers; its delays are kept beside them, for the controller.

    Args:
        model: deviations from a trim. With u, v, w, phi, theta, p, q and r among its states it can be flown; any other
            is simulated, fitted and exported, and says why it cannot be trimmed.
        limits: of inputs, from the trim; otherwise those of the file's [limits], otherwise 1 (20 degrees) either way.

    Raises:
        CardError: for limits that are none, or a left side that cannot be solved.
    """
    A, B, _, _ = model.explicit()
    if limits:
        given = {name: list(ends) for name, ends in limits.items()}
        model = replace(model, document={**model.document, "limits": {**model.document.get("limits", {}), **given}})
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
    ranges = _ranges(model)
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
    learnt: dict[str, Mapping[str, float]] = {**_delays(model)}
    learnt |= {UNMOVED: dict(model.document[UNMOVED])} if UNMOVED in model.document else {}
    card = Card(NAME, model.title, model.trust, options, parameters, observer=learnt, path=model.name)
    vehicle = linear(card)
    parts: dict[str, Any] = {f.name: getattr(vehicle, f.name) for f in fields(Vehicle)}
    return StateSpaceVehicle(**parts | {"structure": model})


def _delays(model: StateSpaceModel) -> dict[str, dict[str, float]]:
    """Sections of the card's observer: delays of inputs, of responses where outputs differ, or of entries."""
    if model.entry_delays:
        return {BY_ENTRY: {name: float(model.delays[name](model.numbers())) for name in model.entry_delays}}
    every = {name: {model.delay(output, name) for output in model.outputs} or {0.0} for name in model.inputs}
    if all(len(delays) == 1 for delays in every.values()):
        return {SECTION: {name: max(0.0, *delays) for name, delays in every.items()}}
    return {BY_OUTPUT: {f"{o}/{i}": max(0.0, model.delay(o, i)) for i in model.inputs for o in model.outputs}}


def _ranges(model: StateSpaceModel) -> dict[str, tuple[float, float]]:
    limits = model.document.get("limits", {})
    ranges = {}
    for name in model.inputs:
        usual = USUAL_RANGE.get(model.units.get(name, "1") or "1", 1.0)
        low, high = limits.get(name, (-usual, usual))
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
