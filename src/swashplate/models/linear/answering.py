"""`LinearResponse`: what can be asked for its frequency response, whatever it is made of."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from swashplate.arrays import Array, Complex


@runtime_checkable
class LinearResponse(Protocol):
    """A model that answers its inputs linearly.

    A state-space model, transfer functions of one input (`TransferFunctions`) and what `swashplate.linearize` gives are
    such models. A vehicle gives one: `Vehicle.as_linear`.
    """

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names, in the order of the response's last axis."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names, in the order of the response's middle axis."""

    def response(self, omega: Array) -> Complex:
        """H(j omega) with its delays at frequencies [rad/s], shape (n, n_outputs, n_inputs)."""

    def eigenvalues(self) -> Complex:
        """Poles of all responses [1/s], each once, fastest first."""


def pair_response(model: LinearResponse, output: str, input: str, omega: Array) -> Complex:
    """One response of a model at frequencies [rad/s], shape (n,)."""
    return model.response(omega)[:, model.outputs.index(output), model.inputs.index(input)]
