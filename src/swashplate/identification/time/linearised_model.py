"""A vehicle's linearisation as a state-space model, so that it can be flown along records beside an identified one."""

from __future__ import annotations

import tomli_w

from swashplate.arrays import Array
from swashplate.flights.schema import channel
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.simulation.linearize import LinearModel

_HELD = ("x", "y", "z", "psi")
"""States on which nothing else hangs in calm air; a record's place and heading are not asked for."""


def model_of(linear: LinearModel, *, name: str) -> StateSpaceModel:
    """The linear model with its numbers; every state but place and heading is an output.

    Args:
        linear: of `swashplate.linearize`. name: what to call it.
    """
    kept = [s for s in linear.states if s not in _HELD]
    rows = [linear.states.index(s) for s in kept]
    columns: dict[str, Array] = {s: linear.A[rows, k] for s, k in zip(kept, rows, strict=True)}
    columns |= {i: linear.B[rows, k] for k, i in enumerate(linear.inputs)}
    document = {
        "kind": "state-space",
        "name": name,
        "title": f"{name}, linearised about its trim",
        "states": {s: channel(s).unit for s in kept},
        "inputs": {i: channel(i).unit for i in linear.inputs},
        "equations": {
            s: {of: repr(float(column[k])) for of, column in columns.items() if column[k] != 0.0}
            for k, s in enumerate(kept)
        },
        "outputs": {s: {"unit": channel(s).unit, "of": {s: "1"}} for s in kept},
        "parameters": {},
    }
    return parse(tomli_w.dumps(document), path=name)
