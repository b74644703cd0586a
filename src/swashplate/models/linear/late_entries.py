"""Entries of G with delays of their own: an input whose entries act at different times is taken as several inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from swashplate.arrays import Array, Complex

if TYPE_CHECKING:
    from swashplate.models.linear.state_space import StateSpaceModel


def places(model: StateSpaceModel) -> dict[str, tuple[int, int]]:
    """Row and column of each entry of G that has a delay of its own, by "state_dot/input"."""
    split = {key: key.partition("/") for key in model.delays}
    return {
        key: (model.states.index(row.removesuffix("_dot")), model.inputs.index(name))
        for key, (row, _, name) in split.items()
        if key not in model.inputs and row not in model.outputs
    }


def widened(model: StateSpaceModel) -> tuple[StateSpaceModel, tuple[int, ...]]:
    """The model with one more input for each of these entries, and which input of the model drives which."""
    entries = places(model)
    column = {place: len(model.inputs) + k for k, place in enumerate(entries.values())}
    elements = tuple(
        replace(e, column=column[e.row, e.column]) if e.matrix == "G" and (e.row, e.column) in column else e
        for e in model.elements
    )
    owner = (*range(len(model.inputs)), *(j for _, j in entries.values()))
    return replace(model, inputs=(*model.inputs, *entries), elements=elements), owner


def shares(owner: Sequence[int]) -> Array:
    """Which input of a model drives which of its wide form, shape (n_wide, n_inputs)."""
    return np.eye(max(owner) + 1)[list(owner)]


def sensitivities(
    model: StateSpaceModel, free: tuple[str, ...], numbers: Array, pairs: list[tuple[int, int, Array]]
) -> tuple[list[Complex], list[Complex]]:
    """`StateSpaceModel.sensitivities` as sums over the wide form's inputs."""
    wide, owner = model.wide
    parts = [[(o, k, omega) for k, j in enumerate(owner) if j == i] for o, i, omega in pairs]
    h, slopes = map(iter, wide.sensitivities(free, numbers, [one for part in parts for one in part]))
    responses, derivatives = [], []
    for part in parts:
        responses.append(np.sum([next(h) for _ in part], axis=0))
        derivatives.append(np.sum([next(slopes) for _ in part], axis=0))
    return responses, derivatives
