"""Linear models that the data of a fit cannot tell from the identified one: their entries, draw by draw.

What is drawn are the model's parameters, ties followed; the matrices' entries come from those, so that entries which
share a parameter stay together.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.models.linear.card_vehicle import entry_name
from swashplate.models.linear.state_space import StateSpaceModel


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
            told = f"is tied: {p.tie.text}" if p is not None and p.tie is not None else "is no parameter of the model"
            raise ControllerError(f"{told}.", where=model.name, channel=name)
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
