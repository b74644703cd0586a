"""Which way an input moves the aircraft, read off its responses, and whether its name promises the other way."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.flights.flight import Flight
from swashplate.flights.motion_signs import (
    FEWEST,
    INTEGRATIONS,
    LINES,
    LOWEST,
    ResponseSign,
    base_motion,
    expected_sense,
    sign_of,
)
from swashplate.flights.readers.options import unit_to_give
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse


def response_sign(
    pairs: FrequencyResponse,
    output: str,
    input: str,
    *,
    expected: int,
    integrations: int,
    band: tuple[float, float] | None = None,
) -> ResponseSign:
    """The sign of one response.

    Args:
        pairs: responses.
        output, input: of one of them.
        expected: the sign that it should have.
        integrations: how often an acceleration is integrated to the output.
        band: where it is read off [rad/s]; its coherent band where None.
    """
    h, coherence, error = pairs.pair(output, input)
    band = band or pairs.band(output, input) or (0.0, 0.0)
    inside = np.isfinite(h) & (coherence >= LEAST_COHERENCE) & (pairs.omega >= max(band[0], LOWEST))
    inside &= (pairs.omega <= band[1]) & (np.abs(h) > 0.0)
    lines = np.flatnonzero(inside)
    if lines.size < FEWEST:
        return ResponseSign(output, input, expected, 0, 0.0, 0.0, (np.nan, np.nan), 0.0)
    lines = lines[np.unique(np.linspace(0, lines.size - 1, min(lines.size, LINES)).astype(int))]
    omega = pairs.omega[lines]
    sign, odds, misfit = sign_of(omega, h[lines], integrations=integrations, error=error[lines])
    return ResponseSign(
        output, input, expected, sign, float(omega[0] / TWO_PI), float(omega[-1] / TWO_PI), misfit, odds
    )


def response_signs(pairs: FrequencyResponse) -> tuple[ResponseSign, ...]:
    """The signs of all responses whose names promise one."""
    return tuple(
        response_sign(pairs, output, input, expected=sense, integrations=INTEGRATIONS[base_motion(output)])
        for output in pairs.outputs
        for input in pairs.inputs
        if (sense := expected_sense(output, input))
    )


def sign_problems(pairs: FrequencyResponse, flight: Flight, *, called: Mapping[str, str]) -> list[str]:
    """A problem for every response that contradicts what the names of its channels promise.

    Args:
        pairs: responses of inputs that were moved from outside.
        flight: that they are from. called: the log's channel by the name that it has here, where that is another one.
    """
    problems = []
    for sign in response_signs(pairs):
        if sign.wrong:
            name = called.get(sign.input, sign.input)
            remedy = unit_to_give(flight, sign.input, sign="-").replace(f" {sign.input}=", f" {name}=")
            problems.append(sign.problem(remedy))
    return problems
