"""A state-space model of plain matrices: one named, fixed number for every entry, with its trim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomli_w

from swashplate.arrays import Array
from swashplate.models.linear.card_vehicle import entry_name, entry_unit
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse

_PLACE = ("x", "y", "z", "psi")
_ROUNDING = 1e-14
"""Of the largest entry; automatic differentiation leaves such zeros."""


def state_space_of_matrices(
    matrices: tuple[Array, Array],
    *,
    states: Sequence[str],
    inputs: Sequence[str],
    units: Mapping[str, str],
    trim: Mapping[str, float],
    limits: Mapping[str, tuple[float, float]],
    delays: Mapping[str, float],
    name: str,
    title: str,
) -> StateSpaceModel:
    """dx/dt = A x + B u about a trim as a model that a file can hold; its outputs are the states.

    Place and heading are left out where no other state depends on them.

    Args:
        matrices: A and B.
        states, inputs: names.
        units: of both; "1" where one is not told.
        trim: values of states and inputs, and `air_density`; what is no state that is kept and no input is left out.
        limits: lower and upper of the inputs, absolute; ranges that do not enclose the trim are left out.
        delays: by input, or by "output/input" [s].
        name, title: of the model.

    Raises:
        CardError: what a model file refuses.
    """
    A, B = matrices
    others = [i for i, s in enumerate(states) if s not in _PLACE]
    gone = [s for j, s in enumerate(states) if s in _PLACE and not A[others, j].any()]
    kept = [s for s in states if s not in gone]
    equations: dict[str, dict[str, str]] = {s: {} for s in kept}
    parameters: dict[str, Any] = {}
    for matrix, columns in ((A, states), (B, inputs)):
        for row in kept:
            for j, column in enumerate(columns):
                value = float(matrix[states.index(row), j])
                if column not in gone and abs(value) > _ROUNDING * abs(matrix).max():
                    entry = entry_name(row, column)
                    equations[row][column] = entry
                    unit = entry_unit(units.get(row, "1"), units.get(column, "1"))
                    parameters[entry] = {"value": value, "unit": unit, "fixed": True}
    ranges = {i: (low - trim[i], high - trim[i]) for i, (low, high) in limits.items() if i in trim}
    document = {
        "kind": "state-space",
        "name": name,
        "title": title,
        "trust": "near its trim only",
        "states": {s: units.get(s, "1") for s in kept},
        "inputs": {i: units.get(i, "1") for i in inputs},
        "equations": equations,
        "outputs": {s: {"of": {s: "1"}} for s in kept},
        "delays": {key: repr(delay) for key, delay in delays.items() if delay and key.split("/")[0] not in gone},
        "limits": {i: [low, high] for i, (low, high) in ranges.items() if low < 0.0 < high},
        "trim": {n: repr(float(v)) for n, v in trim.items() if n in (*kept, *inputs, "air_density", "u", "v", "w")},
        "parameters": parameters,
    }
    return parse(tomli_w.dumps(document), path=name)
