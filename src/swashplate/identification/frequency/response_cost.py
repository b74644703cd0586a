"""The cost of a model's frequency responses, and what its Hessian says about the parameters.

J of one response = 20/n sum W_gamma [ W_g (dB error)^2 + W_p (phase error in deg)^2 ], W_gamma = [1.58 (1 - e^-g)]^2
with the coherence g (Tischler and Remple 2012, eqs 11.2 and 11.3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse
from swashplate.identification.responses.shared_errors import ErrorParts

POINTS = 20
"""Frequencies per response, spread evenly in log frequency."""

PHASE_WEIGHT = 0.01745
"""W_p: 7.57 degrees weigh as much as 1 dB."""

ACCEPTABLE, INDISTINGUISHABLE = 100.0, 50.0
"""J of a response up to which a model is acceptable, and hardly to be told from the flight."""

SIGMAS = 3.0
"""Errors by which a response that was not seen may exceed its estimate."""

DB, DEG = 20.0 / np.log(10.0), 180.0 / np.pi
"""What real and imaginary part of a logarithm are in dB and degrees."""


@dataclass(frozen=True)
class Target:
    """One measured response at the frequencies that the cost looks at.

    Attributes:
        output, input: its channels.
        omega: frequencies [rad/s], shape (n,).
        measured: the response there, shape (n,).
        coherence: partial coherence there, shape (n,).
        ceiling: True where nothing coherent was seen, and `measured` is what the response cannot exceed.
        error: relative random error there, shape (n,); None where it is not known.
        shared: what this error has in common with those of other points; None where it is not known.
    """

    output: str
    input: str
    omega: Array
    measured: Complex
    coherence: Array
    ceiling: bool = False
    error: Array | None = None
    shared: ErrorParts | None = None

    @property
    def name(self) -> str:
        return f"{self.output} / {self.input}"

    def above(self, omega: float) -> Target:
        """The part from a frequency [rad/s] on."""
        k = self.omega >= omega
        return replace(
            self,
            omega=self.omega[k],
            measured=self.measured[k],
            coherence=self.coherence[k],
            error=None if self.error is None else self.error[k],
            shared=None if self.shared is None else self.shared.among(k),
        )

    @property
    def weights(self) -> tuple[Array, Array]:
        """Square roots of what multiplies the squared dB and degree errors, shape (n,) each."""
        w = 20.0 / self.omega.size * (1.58 * (1.0 - np.exp(-self.coherence))) ** 2
        return np.sqrt(w), np.sqrt(w * PHASE_WEIGHT)


@dataclass(frozen=True)
class ResponseComparison:
    """A measured response beside the model's.

    Attributes:
        target: measured. model: response of the model there, shape (n,).
        cost: J.
    """

    kind: ClassVar[str] = "response"
    target: Target
    model: Complex
    cost: float

    @property
    def name(self) -> str:
        return self.target.name

    @property
    def residuals(self) -> Array:
        """Measured less model [dB, deg], shape (n, 2)."""
        error = -log_error(self.model, self.target.measured)
        return np.stack([DB * error.real, DEG * error.imag], axis=1)


def target(
    responses: FrequencyResponse,
    output: str,
    input: str,
    *,
    band: tuple[float, float] | None = None,
    points: int = POINTS,
    least: float = LEAST_COHERENCE,
) -> Target | None:
    """A pair of measured channels as something to fit; None where the coherence leaves no band.

    Args:
        responses: from `respond`.
        output, input: the pair.
        band: narrower limits [Hz].
        points: frequencies, evenly in log frequency.
        least: coherence from which on the response is used.
    """
    h, coherence, error = responses.pair(output, input)
    ends = responses.band(output, input, least=least)
    if ends is None:
        return None
    low, high = ends
    if band is not None:
        low, high = max(low, TWO_PI * band[0]), min(high, TWO_PI * band[1])
    known = np.isfinite(h) & (responses.omega >= low * (1 - 1e-9)) & (responses.omega <= high * (1 + 1e-9))
    if known.sum() < 4:
        return None
    omega, log = responses.omega[known], np.log(np.abs(h[known])) + 1j * np.unwrap(np.angle(h[known]))
    at = np.geomspace(omega[0], omega[-1], points)
    log_at = np.interp(np.log(at), np.log(omega), log.real) + 1j * np.interp(np.log(at), np.log(omega), log.imag)
    coherent, sure = (np.interp(np.log(at), np.log(omega), column[known]) for column in (coherence, error))
    shared = None
    if responses.shared is not None:
        shared = responses.shared.at(at, responses.omega, *responses.place(output, input))
    return Target(output, input, at, np.exp(log_at), coherent, error=sure, shared=shared)


def ceiling(
    responses: FrequencyResponse,
    output: str,
    input: str,
    *,
    band: tuple[float, float] | None = None,
    points: int = POINTS,
) -> Target | None:
    """What a pair without coherence still tells: a response above its estimate and three errors would have been seen.

    Without it a fit is free to invent a large response to an input where there was none to see. None where the input
    told nothing either.

    Args:
        responses: from `respond`.
        output, input: the pair.
        band: narrower limits [Hz].
        points: frequencies, evenly in log frequency.
    """
    h, _, error = responses.pair(output, input)
    low, high = (0.0, np.inf) if band is None else (TWO_PI * band[0], TWO_PI * band[1])
    known = (
        np.isfinite(h) & np.isfinite(error) & (np.abs(h) > 0.0) & (responses.omega >= low) & (responses.omega <= high)
    )
    if known.sum() < 4:
        return None
    omega = responses.omega[known]
    at = np.geomspace(omega[0], omega[-1], points)
    bound = np.interp(np.log(at), np.log(omega), np.log(np.abs(h[known]) * (1.0 + SIGMAS * error[known])))
    return Target(output, input, at, np.exp(bound).astype(np.complex128), np.ones(points), ceiling=True)


def log_error(model: Complex, measured: Complex) -> Complex:
    """log(model / measured) with the phase difference wrapped to half a turn either way."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = model / measured
        return np.asarray(np.log(np.abs(ratio)) + 1j * np.angle(ratio), dtype=np.complex128)


def cost_of(model: Complex, wanted: Target) -> float:
    """J of one response; of a ceiling, what stands above it."""
    gain, phase = wanted.weights
    if wanted.ceiling:
        return float(np.sum((gain * DB * _excess(model, wanted)) ** 2))
    error = log_error(model, wanted.measured)
    return float(np.sum((gain * DB * error.real) ** 2) + np.sum((phase * DEG * error.imag) ** 2))


def _excess(model: Complex, wanted: Target) -> Array:
    """Logarithm of how far a model stands above a ceiling, zero below it."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.maximum(np.log(np.abs(model)) - np.log(np.abs(wanted.measured)), 0.0))


Evaluate = Callable[[Array], tuple[list[Complex], list[Complex]]]
"""Parameters to the model's responses per target (n,) and the derivatives of their logarithms (n, n_parameters)."""

Answer = Callable[[Array], list[Complex]]
"""Parameters to the model's responses per target (n,) alone."""


class ResponseCost:
    """Half the sum of J over all targets and ceilings, in the form that `scoring.minimise` wants (Gauss-Newton).

    Args:
        row: the parameters that move.
        targets: what to fit.
        evaluate: the model. answer: the same without derivatives, where that is quicker.
    """

    def __init__(self, row: Row, targets: Sequence[Target], evaluate: Evaluate, answer: Answer | None = None) -> None:
        if not targets:
            raise IdentificationError(
                "there is no response to fit: none keeps a coherence of 0.6 over a band.",
                hint="Look at the responses; fly a better sweep, or lower --coherence and do not trust the result.",
            )
        self._row, self.targets, self._evaluate = row, tuple(targets), evaluate
        self._answer = answer or (lambda numbers: evaluate(numbers)[0])

    @property
    def row(self) -> Row:
        return self._row

    def refresh(self, row: Array) -> None:
        """Nothing is held during an iteration."""

    def cost(self, row: Array) -> float:
        return 0.5 * float(sum(self.each(row)))

    def evaluate(self, row: Array) -> tuple[list[Complex], list[Complex]]:
        """The model's responses, targets then ceilings, and the slopes of their logarithms."""
        return self._evaluate(np.asarray(row * self.row.scale))

    def each(self, row: Array) -> list[float]:
        """J of each target."""
        models = self._answer(np.asarray(row * self.row.scale))
        return [
            cost_of(model, wanted) if np.all(np.isfinite(model)) else np.inf
            for model, wanted in zip(models, self.targets, strict=True)
        ]

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        residual, slopes = self.residuals(row)
        return 0.5 * float(residual @ residual), slopes.T @ residual, slopes.T @ slopes

    def residuals(self, row: Array) -> tuple[Array, Array]:
        """Weighted errors of all targets, dB then degrees, and their slopes over the scaled row."""
        models, slopes = self._evaluate(np.asarray(row * self.row.scale))
        rows, derivatives = [], []
        for model, slope, wanted in zip(models, slopes, self.targets, strict=True):
            gain, phase = wanted.weights
            if wanted.ceiling:
                excess = _excess(model, wanted)
                above = np.where(excess > 0.0, gain * DB, 0.0)
                rows.append(gain * DB * excess)
                derivatives.append(above[:, None] * np.where(excess[:, None] > 0.0, slope.real, 0.0))
                continue
            error = log_error(model, wanted.measured)
            rows += [gain * DB * error.real, phase * DEG * error.imag]
            derivatives += [(gain * DB)[:, None] * slope.real, (phase * DEG)[:, None] * slope.imag]
        return np.concatenate(rows), np.concatenate(derivatives) * self.row.scale


class RelativeCost(ResponseCost):
    """The same to first order, of relative errors instead of their logarithms: the way down from a far start.

    A response cannot change its sign in logarithms: it would have to pass through zero, which is infinitely far away,
    or through half a turn of phase, from where the cost falls either way. Many a wrong end is such a response. Relative
    errors pass through zero like anything else. They are no fit: they care more for what is too large than for what is
    too small.

    Args:
        row, targets: as for the logarithms; without ceilings.
        evaluate: the model, with the derivatives of the responses themselves.
    """

    def each(self, row: Array) -> list[float]:
        """What each target adds, twice."""
        costs = []
        for model, wanted in zip(self._answer(np.asarray(row * self.row.scale)), self.targets, strict=True):
            gain, phase = wanted.weights
            error = model / wanted.measured - 1.0
            costs.append(float(np.sum((gain * DB * error.real) ** 2 + (phase * DEG * error.imag) ** 2)))
        return [cost if np.isfinite(cost) else np.inf for cost in costs]

    def residuals(self, row: Array) -> tuple[Array, Array]:
        """Weighted relative errors of all targets, real then imaginary part, and their slopes over the scaled row."""
        rows, derivatives = [], []
        for model, slope, wanted in zip(*self.evaluate(row), self.targets, strict=True):
            gain, phase = wanted.weights
            error, by = model / wanted.measured - 1.0, slope / wanted.measured[:, None]
            rows += [gain * DB * error.real, phase * DEG * error.imag]
            derivatives += [(gain * DB)[:, None] * by.real, (phase * DEG)[:, None] * by.imag]
        return np.concatenate(rows), np.concatenate(derivatives) * self.row.scale


NOT_FOLLOWED = "the model follows no response: J of each is above 1000, so that its numbers mean nothing."
_HOPELESS = 10.0 * ACCEPTABLE


def followed(numbers: Array, costs: Sequence[float]) -> bool:
    """Whether a fit may be used: finite numbers, and at least one response that the model goes along with."""
    return bool(np.all(np.isfinite(numbers))) and min(costs) <= _HOPELESS
