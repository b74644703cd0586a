"""What differs from aircraft to aircraft: what an identification leaves open, tolerances, payload, delay."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.identification.core.result import Result
from swashplate.identification.core.result_file import load
from swashplate.models.linear.card_vehicle import entry_name
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle


def tolerances_of(vehicle: Vehicle) -> dict[str, float]:
    """Standard deviations of a card's numbers, those that have one.

    Raises:
        ControllerError: where none has.
    """
    sigmas = {name: float(p.sigma) for name, p in vehicle.card.parameters.items() if p.sigma}
    if not sigmas:
        raise ControllerError(
            "no number of the card has a sigma.",
            where=vehicle.card.path or vehicle.name,
            hint="Take a card from `swash bench` or `swash identify`, or say what varies: --vary mass=5%, "
            'in a campaign\'s file numbers = {mass = "5%"} without tolerances.',
        )
    return sigmas


def draw_numbers(
    vehicle: Vehicle,
    sigmas: Mapping[str, float],
    *,
    count: int,
    seed: int,
    about: Mapping[str, Array] | None = None,
) -> dict[str, Array]:
    """Numbers of `count` aircraft, independent and normal, cut at the bounds of physics, shape (count,) each.

    Args:
        vehicle: whose card gives centre and bounds.
        sigmas: standard deviations by name [the parameter's unit].
        count, seed: of the draws.
        about: models that are already drawn, kept for every name that is not in `sigmas` and the centre of those that
            are.

    Raises:
        ControllerError: for a name that the card does not have, or a negative sigma.
    """
    random = np.random.default_rng(seed)
    numbers = dict(about or {})
    for name, sigma in sigmas.items():
        if name not in vehicle.card.parameters or name not in vehicle.parameter_names:
            raise ControllerError("is not a number of the card.", where=vehicle.name, channel=name)
        if not sigma >= 0.0:
            raise ControllerError(f"varies by {sigma:g}, expected zero or more.", where=vehicle.name, channel=name)
        p = vehicle.card.parameters[name]
        drawn = numbers.get(name, p.value) + sigma * random.standard_normal(count)
        low = -np.inf if p.lower is None else p.lower
        numbers[name] = np.clip(drawn, low, np.inf if p.upper is None else p.upper)
    return numbers


def load_them(vehicle: Vehicle, drawn: Mapping[str, Array], *, most: float, count: int, seed: int) -> dict[str, Array]:
    """The same aircraft with a payload of up to `most` kg each at the centre of gravity, evenly spread.

    Raises:
        ControllerError: for a negative payload.
    """
    if not most >= 0.0:
        raise ControllerError(f"is {most:g} kg, expected zero or more.", channel="payload")
    payload = most * np.random.default_rng(seed).random(count)
    return {**drawn, "mass": drawn.get("mass", vehicle.card.values()["mass"]) + payload}


def draw_delays(*, most: float, count: int, seed: int) -> Array:
    """Delays of up to `most` seconds, evenly spread, shape (count,).

    Raises:
        ControllerError: for a negative delay.
    """
    if not most >= 0.0:
        raise ControllerError(f"is {most:g} s, expected zero or more.", channel="delay")
    return most * np.random.default_rng(seed).random(count)


def bounds_of(model: StateSpaceModel) -> dict[str, float]:
    """Standard deviations of the free parameters that the model's file carries.

    Raises:
        ControllerError: where it carries none.
    """
    bounds = {n: p.cramer_rao for n in model.free if np.isfinite((p := model.parameters[n]).cramer_rao)}
    if not bounds:
        raise ControllerError(
            "no number of the file has a standard deviation (cramer_rao).",
            where=model.name,
            channel="--tolerances",
            hint="Take a model of `swash identify`, or say what varies: --vary Xu=5%.",
        )
    return bounds


def vary_parameters(
    model: StateSpaceModel, sigmas: Mapping[str, float], *, count: int, seed: int, about: Mapping[str, Array]
) -> dict[str, Array]:
    """Independent normal draws of parameters, cut at their bounds, shape (count,) each.

    Args:
        model: gives centres and bounds.
        sigmas: standard deviations by name [the parameter's unit].
        count, seed: of the draws.
        about: parameters that are already drawn; the centre of those that are varied too.

    Raises:
        ControllerError: for a name that the model does not have or ties to others, or a negative sigma.
    """
    random, drawn = np.random.default_rng(seed), dict(about)
    for name, sigma in sigmas.items():
        p = model.parameters.get(name)
        if p is None or p.tie is not None:
            problem = (
                f"is tied: {p.tie.text}" if p is not None and p.tie is not None else "is no parameter of the model"
            )
            raise ControllerError(f"{problem}.", where=model.name, channel=name)
        if not sigma >= 0.0:
            raise ControllerError(f"varies by {sigma:g}, expected zero or more.", where=model.name, channel=name)
        drawn[name] = np.clip(drawn.get(name, p.value) + sigma * random.standard_normal(count), p.lower, p.upper)
    return drawn


def entries_of(model: StateSpaceModel, drawn: Mapping[str, Array], *, count: int) -> dict[str, Array]:
    """Entries of A and B of every draw, by the names of the linear vehicle's card, shape (count,) each.

    An entry that is zero in the model itself stays zero: the vehicle has no equation for it.
    """
    A, B, _, _ = model.explicit()
    places = [(matrix, *place) for matrix, of in enumerate((A, B)) for place in np.argwhere(of)]
    table = np.empty((len(places), count))
    for k in range(count):
        matrices = model.with_values({name: float(values[k]) for name, values in drawn.items()}).explicit()[:2]
        table[:, k] = [matrices[matrix][i, j] for matrix, i, j in places]
    columns = (model.states, model.inputs)
    return {entry_name(model.states[i], columns[m][j]): table[k] for k, (m, i, j) in enumerate(places)}


SENSOR_NOISE: Mapping[str, float] = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("u", "v", "w"), 0.02),
    **dict.fromkeys(("phi", "theta", "psi"), 0.005),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
"""White noise on each sample of what a controller is told [m, m/s, rad, rad/s]; assumed, as of cameras and gyros."""


def draw_models(
    model: Vehicle | StateSpaceModel,
    fit: Result[object, object] | str | Path,
    *,
    count: int,
    seed: int,
    corrected: bool = True,
) -> dict[str, Array]:
    """Parameters of models that the data of a fit cannot tell from the identified one, shape (count,) each.

    Args:
        model: whose bounds hold.
        fit: a result, or its file (the `fit.json` beside a model file).
        count, seed, corrected: see `Result.draw_values`.

    Raises:
        ControllerError: where the fit is of another model.
        DocumentError: where the file is no result.
        IdentificationError: where the fit knows no spread, or one that lies mostly outside the bounds of physics.
    """
    result = fit if isinstance(fit, Result) else load(fit, equations=model if isinstance(model, Vehicle) else None)
    where = "the fit" if isinstance(fit, Result) else str(fit)
    if isinstance(model, Vehicle):
        model = model.structure or model
    known = model.card.parameters if isinstance(model, Vehicle) else model.parameters
    strange = sorted(set(result.names) - set(known))
    if strange:
        raise ControllerError(f"is of another model: {model.name} has no {', '.join(strange)}.", where=where)
    return result.draw_values(count, seed=seed, corrected=corrected, within=model)
