"""Arithmetic on frequency responses, one pair each, with random error and coherence carried through.

To first order a relative error dH/H stays as it is in a product, a ratio and an inverse, where errors of both add in
squares; with T = L / (1 + L) it is dT/T = (dL/L) / (1 + L), and with L = T / (1 - T) it is dL/L = (dT/T) / (1 - T).
The errors of two responses are taken as independent. The coherence that goes with an error e is c in
e^2 ~ (1 - c) / c, so noise over signal grows as e^2 does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.shared_errors import SharedErrors
from swashplate.registry import listed, nearest

Operation = Literal["product", "ratio", "inverse", "negative", "closed", "broken"]
OPERATIONS: tuple[Operation, ...] = get_args(Operation)
_OF_TWO = ("product", "ratio")

_SAME = 1e-9
_FEWEST = 3


def combine(
    operation: Operation, first: FrequencyResponse, second: FrequencyResponse | None = None
) -> FrequencyResponse:
    """A response computed from one or two others.

    Args:
        operation: "product" first times second (one behind the other), "ratio" first over second (what lies between
            two outputs of the same input), "inverse" 1 / first, "negative" -first (the loop broken at the actuator is
            minus the controller's output by the command), "closed" L / (1 + L) from a broken loop L with negative
            feedback, "broken" T / (1 - T) from the closed one, as at the stick from demand and rate.
        first, second: responses of one pair each, see `FrequencyResponse.select`. The second is interpolated between
            its frequencies; where either has none there is no result.

    Raises:
        IdentificationError: an unknown operation, more than one pair, units that do not fit, no common frequencies.
    """
    if operation not in OPERATIONS:
        hint = nearest(operation, OPERATIONS) or None
        raise IdentificationError(
            f"is no operation; there are {listed(OPERATIONS)}.", channel=str(operation), hint=hint
        )
    if (second is None) == (operation in _OF_TWO):
        count = "two responses" if operation in _OF_TWO else "one response"
        raise IdentificationError(f"takes {count}.", channel=operation)
    for one in (first, second):
        if one is not None and one.response.shape[1:] != (1, 1):
            raise IdentificationError(
                f"takes responses of one pair; these have {listed(one.outputs)} to {listed(one.inputs)}.",
                channel=operation,
                hint="Choose one with select((output,), (input,)), or on the command line FILE:OUTPUT/INPUT.",
            )
    h, noise, error = _parts(first)
    omega, unity = first.omega, np.complex128(1.0)
    if second is not None:
        omega, (h, noise, error), (h2, noise2, error2) = _together(first, second)
        _fits(operation, first, second)
        h = h * h2 if operation == "product" else h / h2
        noise, error = noise + noise2, np.hypot(error, error2)
    elif operation == "inverse":
        h = unity / h
    elif operation == "negative":
        h = -h
    else:
        through = np.abs(unity / (unity + h)) if operation == "closed" else np.abs(unity / (unity - h))
        _fits(operation, first, None)
        h = h / (unity + h) if operation == "closed" else h / (unity - h)
        noise, error = noise * through**2, error * through
    return _result_of(operation, first, second, omega, h, 1.0 / (1.0 + noise), error)


def _parts(pair: FrequencyResponse) -> tuple[Complex, Array, Array]:
    """Response, noise over signal, and error of the only pair, (n,) each."""
    c = np.clip(pair.coherence[:, 0, 0], 1e-12, 1.0)
    return pair.response[:, 0, 0], (1.0 - c) / c, pair.error[:, 0, 0]


def _together(
    first: FrequencyResponse, second: FrequencyResponse
) -> tuple[Array, tuple[Complex, Array, Array], tuple[Complex, Array, Array]]:
    """Both at the first's frequencies within the second's band."""
    low, high = second.omega[0] * (1.0 - _SAME), second.omega[-1] * (1.0 + _SAME)
    inside = (first.omega >= low) & (first.omega <= high)
    if inside.sum() < _FEWEST:
        raise IdentificationError(
            f"have no common band: {first.omega[0]:.3g} to {first.omega[-1]:.3g} and {second.omega[0]:.3g} to "
            f"{second.omega[-1]:.3g} rad/s.",
            channel="the responses",
        )
    omega = first.omega[inside]
    h, noise, error = _parts(second)
    known = np.isfinite(h) & (np.abs(h) > 0.0)
    if known.sum() < _FEWEST:
        raise IdentificationError("has hardly any numbers.", channel=f"{second.outputs[0]} / {second.inputs[0]}")
    at, grid = np.log(omega), np.log(second.omega[known])
    polar = np.log(np.abs(h[known])) + 1j * np.unwrap(np.angle(h[known]))
    # No number where the nearest known line is further than a line away.
    wide = 1.5 * np.max(np.diff(np.log(second.omega))) + _SAME
    near = np.min(np.abs(at[:, None] - grid[None]), axis=1) <= wide
    between = [np.where(near, np.interp(at, grid, part[known]), np.nan) for part in (noise, error)]
    answer = np.where(near, np.exp(np.interp(at, grid, polar.real) + 1j * np.interp(at, grid, polar.imag)), np.nan)
    mine = tuple(part[inside] for part in _parts(first))
    return omega, (mine[0], mine[1], mine[2]), (np.asarray(answer), between[0], between[1])


def _fits(operation: str, first: FrequencyResponse, second: FrequencyResponse | None) -> None:
    """That channels and units let responses follow each other, be divided, or close a loop."""
    if (
        operation == "ratio"
        and second is not None
        and first.inputs != second.inputs
        and first.outputs != second.outputs
    ):
        raise IdentificationError(
            f"{first.outputs[0]} / {first.inputs[0]} and {second.outputs[0]} / {second.inputs[0]} share neither input "
            "nor output: their ratio is no response.",
            channel=operation,
        )
    if not (first.input_units and first.output_units):
        return
    if operation == "product" and second is not None and second.output_units:
        given, wanted, what = second.output_units[0], first.input_units[0], f"{second.outputs[0]} goes into the first"
    elif operation in ("closed", "broken"):
        given, wanted, what = first.output_units[0], first.input_units[0], "a loop returns what goes into it"
    else:
        return
    if given != wanted:
        raise IdentificationError(
            f"cannot be: {what}, but one is in {given} and the other in {wanted}.", channel=operation
        )


def _result_of(
    operation: Operation,
    first: FrequencyResponse,
    second: FrequencyResponse | None,
    omega: Array,
    h: Complex,
    coherence: Array,
    error: Array,
) -> FrequencyResponse:
    other = second if second is not None else first
    of_inputs = operation == "ratio" and first.inputs != other.inputs  # (y / a) / (y / b) is b / a
    output, input = {
        "product": ((first, "outputs"), (other, "inputs")),
        "ratio": ((other, "inputs"), (first, "inputs")) if of_inputs else ((first, "outputs"), (other, "outputs")),
        "inverse": ((first, "inputs"), (first, "outputs")),
    }.get(operation, ((first, "outputs"), (first, "inputs")))
    units = {"inputs": "input_units", "outputs": "output_units"}
    names = [getattr(*side)[0] for side in (output, input)]
    of_units = [getattr(side[0], units[side[1]])[:1] for side in (output, input)]
    nothing = np.full((omega.size, 1), np.nan)
    pairs = [f"{one.outputs[0]} / {one.inputs[0]}" for one in (first, second) if one is not None]
    return replace(
        first,
        omega=omega,
        outputs=(names[0],),
        inputs=(names[1],),
        output_units=of_units[0],
        input_units=of_units[1],
        response=h[:, None, None],
        coherence=coherence[:, None, None],
        multiple=coherence[:, None],
        error=error[:, None, None],
        input_power=nothing,
        output_power=nothing,
        input_coherence=np.ones((omega.size, 1, 1)),
        method=f"{operation} of {' and '.join(pairs)}",
        sources=tuple(dict.fromkeys((*first.sources, *other.sources))),
        warnings=tuple(dict.fromkeys((*first.warnings, *other.warnings))),
        problems=tuple(dict.fromkeys((*first.problems, *other.problems))),
        settings={"operation": operation, "of": pairs},
        direct=None,
        direct_error=None,
        shared=_shared(first, second, omega),
    )


def _shared(first: FrequencyResponse, second: FrequencyResponse | None, omega: Array) -> SharedErrors | None:
    """How the errors of neighbouring lines go together: as in the one of the shorter windows."""
    known = [one for one in (first, second) if one is not None]
    windows = [np.interp(omega, one.omega, one.shared.window) for one in known if one.shared is not None]
    if len(windows) < len(known):
        return None
    alone = np.ones((omega.size, 1, 1), dtype=np.complex128)
    return SharedErrors(alone, alone, np.minimum.reduce(windows))
