"""State-space models fitted to the Fourier transforms of records: output error in the frequency domain.

    (jw M - F) X = G U e^(-jw tau) + M (x(0) - x(T) e^(-jwT)),    Y = H0 X + H1 (jw X - x(0) + x(T) e^(-jwT)) + D U

(Klein and Morelli 2006, ch. 7; the ends' terms: Schoukens, Pintelon and Rolain 1998). Nothing is integrated, so that an
unstable aircraft is as easy as a stable one; drift and noise outside the band do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.accuracy import blind_directions, marginal_information, sandwich
from swashplate.identification.core.records import uniform_table
from swashplate.identification.core.result import Estimate, Result, correlation_of
from swashplate.identification.core.sources import scale_words, sources_of
from swashplate.identification.core.time_fit import TimeDetails
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

METHOD = "output error over frequencies"
_ROUNDS = 5
_NEIGHBOURS = 1
"""Lines whose errors may go together: the ends of a record leak into them."""


def fit_in_frequency(
    model: Vehicle | StateSpaceModel,
    flights: Flight | Sequence[Flight],
    *,
    band: tuple[float, float],
    outputs: Sequence[str] | None = None,
) -> Result[StateSpaceModel, TimeDetails]:
    """Fit a model's free parameters to the transforms of records over a band.

    Args:
        model: structure and start values.
        flights: conditioned; each unbroken piece is a record with its own states at both ends.
        band: lowest and highest frequency [Hz].
        outputs: channels to fit; all of the model's where None.

    Raises:
        IdentificationError: no line of a record inside the band, or no free parameter.
    """
    flights, model = as_flights(flights), structure_of(model)
    names = tuple(outputs or model.outputs)
    if not model.free:
        raise IdentificationError("has no free parameter.", channel=model.name)
    m, pieces, sources = len(model.inputs), [], []
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, (*model.inputs, *names), who=f"'{model.name}'")
            pieces.append(_transformed(time - time[0], table, band, m))
            sources.append(f"{piece.provenance.source or 'flight'} {time[0]:.2f}-{time[-1]:.2f} s")
    rows, k, n = [model.outputs.index(o) for o in names], len(model.free), len(model.states)
    low, high = (
        np.concatenate([[getattr(model.parameters[p], side) for p in model.free], np.full(2 * n * len(pieces), sign)])
        for side, sign in (("lower", -np.inf), ("upper", np.inf))
    )
    start = np.concatenate([[model.parameters[p].value for p in model.free], np.zeros(2 * n * len(pieces))])
    start = np.clip(start, low, high)
    sigma = np.sqrt(np.mean(np.concatenate([np.abs(y) ** 2 for _, _, _, y in pieces]), axis=0)) + 1e-300

    def errors(numbers: Array) -> Complex:
        trial = model.with_values(dict(zip(model.free, map(float, numbers[:k]), strict=True)))
        ends = numbers[k:].reshape(len(pieces), 2, n)
        parts = [_answer(trial, rows, names, piece, end) for piece, end in zip(pieces, ends, strict=True)]
        return np.concatenate([piece[3] - part for piece, part in zip(pieces, parts, strict=True)])

    def residuals(numbers: Array) -> Array:
        white = (errors(numbers) / sigma).ravel()
        return np.concatenate([white.real, white.imag])

    history, solved = [], None
    for _ in range(_ROUNDS):
        solved = least_squares(residuals, start, jac="3-point", bounds=(low, high), x_scale="jac", xtol=1e-10)
        start = solved.x
        left = errors(start)
        sigma = np.sqrt(np.mean(np.abs(left) ** 2, axis=0)) + 1e-300
        history.append(float(len(left) * np.sum(np.log(sigma))))
        if len(history) > 1 and history[-2] - history[-1] < 1e-3:
            break
    assert solved is not None
    # Unit variance of a complex error is one half in each part.
    jacobian = least_squares(residuals, start, jac="3-point", bounds=(low, high), x_scale="jac", max_nfev=1).jac
    information = 2.0 * jacobian.T @ jacobian
    covariance = np.linalg.pinv(information, hermitian=True)
    spread = np.sqrt(np.abs(np.diag(covariance)))
    corrected = _corrected(2.0 * covariance, residuals(start), jacobian, [len(piece[0]) for piece in pieces])[:k, :k]
    scale = np.array([abs(value) or 1.0 for value in start[:k]])
    alone = marginal_information(information, np.zeros_like(information), np.arange(k, dtype=np.int64))
    failed = not np.all(np.isfinite(spread[:k])) or not solved.success
    estimates = tuple(
        Estimate(
            p,
            model.parameters[p].unit,
            model.parameters[p].value,
            float(start[i]),
            sigma=float(spread[i]),
            sigma_corrected=float(np.sqrt(max(corrected[i, i], 0.0))),
            insensitivity=float(1.0 / np.sqrt(max(information[i, i], 1e-300))),
            at_bound=bool(start[i] <= low[i] or start[i] >= high[i]),
        )
        for i, p in enumerate(model.free)
    )
    data = sources_of(flights)
    return Result(
        method=METHOD,
        solution=model.with_values(dict(zip(model.free, map(float, start[:k]), strict=True))),
        start=model,
        estimates=estimates,
        names=model.free,
        covariance=covariance[:k, :k],
        covariance_corrected=corrected,
        correlation=correlation_of(covariance[:k, :k]),
        details=TimeDetails(np.diag(sigma**2)),
        history=tuple(history),
        converged=bool(solved.success),
        failed=failed,
        problems=(
            *(("the search has found no least cost: its numbers mean nothing.",) if failed else ()),
            *scale_words(data),
        ),
        directions=blind_directions(model.free, alone * np.outer(scale, scale)),
        data=data,
        settings={"band": list(band), "outputs": list(names), "records": sources},
    )


def _corrected(plain: Array, residual: Array, jacobian: Array, lines: Sequence[int]) -> Array:
    """`sandwich` over the lines of every record: noise need not be white over the band."""
    outputs, both = residual.size // (2 * sum(lines)), []
    for part in (residual, jacobian):
        real, imaginary = np.split(part.reshape(2 * sum(lines), outputs, -1), 2)
        both.append(np.split(np.concatenate([real, imaginary], axis=1), np.cumsum(lines)[:-1]))
    return sandwich(plain, [block[:, :, 0] for block in both[0]], both[1], lags=_NEIGHBOURS)


def _transformed(
    time: Array, table: Array, band: tuple[float, float], inputs: int
) -> tuple[Array, float, Complex, Complex]:
    """Lines [rad/s], length [s] and the transforms of inputs and outputs (trapezoids)."""
    length = float(time[-1])
    hertz = np.arange(np.ceil(band[0] * length), np.floor(band[1] * length) + 1.0) / length
    hertz = hertz[hertz > 0.0]
    if hertz.size < 3:
        raise IdentificationError(
            f"a record of {length:.3g} s has {hertz.size} lines between {band[0]:g} and {band[1]:g} Hz.",
            hint="Widen the band.",
        )
    omega = 2.0 * np.pi * hertz
    weight = np.full(time.size, time[1] - time[0])
    weight[[0, -1]] *= 0.5
    both = (np.exp(-1j * np.outer(omega, time)) * weight) @ table.astype(np.complex128)
    return omega, length, both[:, :inputs], both[:, inputs:]


def _answer(
    model: StateSpaceModel,
    rows: Sequence[int],
    names: Sequence[str],
    piece: tuple[Array, float, Complex, Complex],
    ends: Array,
) -> Complex:
    omega, length, u, _ = piece
    model, owner = model.wide
    u = u[:, owner]
    m, s = model.matrices(), 1j * omega[:, None, None]
    edge = ends[0] - ends[1] * np.exp(-1j * omega * length)[:, None]
    left = np.linalg.inv(s * m["M"] - m["F"])
    own = np.einsum("fij,fj->fi", left, edge @ m["M"].T)
    answer = own @ m["H0"][rows].T + (1j * omega[:, None] * own - edge) @ m["H1"][rows].T
    for i, name in enumerate(model.inputs):
        x = np.einsum("fij,j->fi", left, m["G"][:, i].astype(np.complex128))
        h = x @ m["H0"][rows].T + (1j * omega[:, None] * x) @ m["H1"][rows].T + m["D"][rows, i]
        lag = np.array([model.delay(o, name) for o in names])
        answer = answer + h * np.exp(-1j * omega[:, None] * lag) * u[:, i, None]
    return np.asarray(answer)


@dataclass(frozen=True)
class LinesEstimator:
    """`fit_in_frequency` as an estimator."""

    takes: frozenset[str] = frozenset({"outputs", "band"})

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if isinstance(data, FrequencyResponse):
            return "it fits records in time"
        return "" if isinstance(model, StateSpaceModel) else "it fits state-space models"

    def estimate(
        self, model: StateSpaceModel, data: tuple[Flight, ...], question: Question
    ) -> Result[StateSpaceModel, TimeDetails]:
        if question.band is None:
            raise IdentificationError("is not said, and this method needs it.", channel="band", hint="band=(0.1, 5.0)")
        return fit_in_frequency(model, data, band=question.band, outputs=question.outputs)


FREQUENCY_LINES = LinesEstimator()
