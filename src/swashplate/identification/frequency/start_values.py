"""Start values of a state-space model: from a vehicle's linearisation, or from fitted transfer functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.frequency.response_cost import Target, target
from swashplate.identification.frequency.state_space_fit import fit_targets
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel

if TYPE_CHECKING:
    from swashplate.simulation.linearize import LinearModel

_FAST = 1e-9

_CALLED = {
    "lateral": "A1",
    "longitudinal": "B1",
    "pedal": "theta0T",
    "collective": "theta0",
    "a": "a1",
    "b": "b1",
    "r_fb": "r_gyro",
}
"""What the ready structures call otherwise than a single-rotor helicopter does: its inputs, disc tilt, yaw gyro."""


def from_linear_model(model: StateSpaceModel, linear: LinearModel) -> StateSpaceModel:
    """The model with start values read off a linearised vehicle (`swashplate.linearize`).

    An entry that is one parameter (or minus one) takes the linearisation's number at the same states and inputs, scaled
    by the left side. States of the vehicle that the model does not have are residualised: they follow at once, as a
    quasi-steady derivative supposes (Tischler and Remple 2012, ch. 13). What the vehicle lacks keeps its value. A time
    constant that stands on the left side before a rate whose right side has minus the state is read off its decay.

    Raises:
        IdentificationError: where vehicle and model share no state or no input.
    """

    def in_vehicle(name: str, known: Sequence[str]) -> str:
        return name if name in known else _CALLED.get(name, name)

    called = {name: in_vehicle(name, (*linear.states, *linear.inputs)) for name in (*model.states, *model.inputs)}
    states = [name for name in model.states if called[name] in linear.states]
    inputs = [name for name in model.inputs if called[name] in linear.inputs]
    if not states or not inputs:
        raise IdentificationError(
            f"'{model.name}' shares no state or no input with the vehicle, which has states {', '.join(linear.states)} "
            f"and inputs {', '.join(linear.inputs)}."
        )
    a, b = _residualised(linear, [called[name] for name in states])
    model = model.with_values(_time_constants(model, states, a))
    values = model.numbers()
    left = {
        (e.row, e.column): float(e.expression(values)) for e in model.elements if e.matrix == "M" and e.row == e.column
    }
    starts = {}
    for e in model.elements:
        if e.matrix not in ("F", "G") or model.states[e.row] not in states:
            continue
        names = states if e.matrix == "F" else inputs
        column = (model.states if e.matrix == "F" else model.inputs)[e.column]
        text = e.expression.text.replace(" ", "")
        name, sign = text.lstrip("-"), -1.0 if text.startswith("-") else 1.0
        if (
            name not in model.parameters
            or name in model.trim.values()
            or model.parameters[name].tie is not None
            or column not in names
            or name in starts
        ):
            continue
        row = states.index(model.states[e.row])
        number = a[row, states.index(column)] if e.matrix == "F" else b[row, linear.inputs.index(called[column])]
        parameter = model.parameters[name]
        value = sign * float(number) * left.get((e.row, e.row), 1.0)
        starts[name] = float(np.clip(value, parameter.lower, parameter.upper))
    trimmed = linear.trim.states()
    starts |= {name: trimmed[state] for state, name in model.trim.items() if state in trimmed}
    return model.with_values(starts)


def at_flown_trim(model: StateSpaceModel, responses: FrequencyResponse) -> StateSpaceModel:
    """The model about the flights' mean speeds and angles, where the responses have them among their outputs.

    Only held parameters of the model's [trim] that are zero change: what was given stays. A [trim] that is there is
    also told the inputs' means, which stitching needs.
    """
    means = {name: value for name, value in responses.settings.get("means", {}).items() if np.isfinite(value)}
    about = {name: means[state] for state, name in model.trim.items() if state in means}
    trimmed = model.with_values({n: v for n, v in about.items() if model.parameters[n].value == 0.0})
    trim = model.document.get("trim")
    if not trim:
        return trimmed
    inputs = {name: repr(float(means[name])) for name in model.inputs if name in means and name not in trim}
    return replace(trimmed, document={**trimmed.document, "trim": {**trim, **inputs}})


def _time_constants(model: StateSpaceModel, states: Sequence[str], a: Array) -> dict[str, float]:
    """Parameters that alone multiply a state's rate where the right side has minus that state."""
    diagonal = [e for e in model.elements if e.row == e.column and model.states[e.row] in states]
    decays = {e.row for e in diagonal if e.matrix == "F" and e.expression.text.replace(" ", "") == "-1"}
    constants = {}
    for e in diagonal:
        name = e.expression.text.strip()
        if e.matrix == "M" and e.row in decays and name in model.parameters and name not in constants:
            place, parameter = states.index(model.states[e.row]), model.parameters[name]
            if a[place, place] < 0.0 and parameter.tie is None:
                constants[name] = float(np.clip(-1.0 / a[place, place], parameter.lower, parameter.upper))
    return constants


def _residualised(linear: LinearModel, states: Sequence[str]) -> tuple[Array, Array]:
    """A and B of the kept states, the others following at once; integrators that nothing feeds back are left out."""
    keep = [linear.states.index(name) for name in states]
    others = [i for i in range(len(linear.states)) if i not in keep and abs(linear.A[i, i]) > _FAST]
    a, b = linear.A[np.ix_(keep, keep)], linear.B[keep]
    if others:
        gain = linear.A[np.ix_(keep, others)] @ np.linalg.inv(linear.A[np.ix_(others, others)])
        a, b = a - gain @ linear.A[np.ix_(others, keep)], b - gain @ linear.B[others]
    return np.asarray(a), np.asarray(b)


def from_models(
    model: StateSpaceModel, fitted: Sequence[StateSpaceModel], responses: FrequencyResponse, *, seed: int = 0
) -> StateSpaceModel:
    """The model with start values that answer as simpler fitted models do, over the responses' coherent bands.

    Args:
        model: what needs start values.
        fitted: models with inputs and outputs of it (those that `swash identify` wrote).
        responses: measured, for the bands.

    Raises:
        IdentificationError: where none of them joins an output and an input of model and responses.
    """
    targets = []
    for one in fitted:
        for o, output in enumerate(one.outputs):
            for i, name in enumerate(one.inputs):
                if {output} <= {*model.outputs} & {*responses.outputs} and {name} <= {*model.inputs} & {
                    *responses.inputs
                }:
                    measured = target(responses, output, name)
                    if measured is not None:
                        h = one.response(measured.omega)[:, o, i]
                        targets.append(Target(output, name, measured.omega, h, np.ones(measured.omega.size)))
    return _matched(model, targets, seed=seed)


def _matched(model: StateSpaceModel, targets: Sequence[Target], *, seed: int) -> StateSpaceModel:
    if not targets:
        raise IdentificationError(f"no transfer function joins an output and an input of '{model.name}'.")
    fit = fit_targets(model, targets, seed=seed, iterations=40)
    return model.with_values({name: fit.solution.parameters[name].value for name in fit.names})
