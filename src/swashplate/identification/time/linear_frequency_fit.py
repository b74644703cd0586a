"""State-space models fitted to the Fourier transforms of records: output error in the frequency domain.

    (jw M - F) X = G U e^(-jw tau) + M (x(0) - x(T) e^(-jwT)),    Y = H0 X + H1 (jw X - x(0) + x(T) e^(-jwT)) + D U

(Klein and Morelli 2006, ch. 7; the ends' terms: Schoukens, Pintelon and Rolain 1998). Nothing is integrated, so that an
unstable aircraft is as easy as a stable one; drift and noise outside the band do not count. Gusts make errors that fall
with frequency and that all outputs share: each line is weighed by the spectral matrix of the errors around it (the
sample maximum likelihood estimator: Pintelon and Schoukens 2012, sec. 12.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.accuracy import blind_directions, marginal_information, sign_words
from swashplate.identification.core.records import uniform_table
from swashplate.identification.core.result import Estimate, Result, correlation_of
from swashplate.identification.core.sources import sources_of
from swashplate.identification.core.time_fit import TimeDetails
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

METHOD = "output error over frequencies"
_ROUNDS = 6
_AROUND = 8
"""Lines to either side that tell the noise of one; twice as many as there are outputs at least."""
_SETTLED = 0.02
"""Standard deviations by which no number moves any more when the weights are told again."""
_LEAST_FREE = 0.05
"""Part of a line's error that is taken to be left in its residual at least."""


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
    lines = [len(piece[0]) for piece in pieces]
    size = np.sqrt(np.mean(np.concatenate([np.abs(y) ** 2 for _, _, _, y in pieces]), axis=0)) + 1e-300
    white = np.tile(np.diag(1.0 / size).astype(np.complex128), (sum(lines), 1, 1))
    noise = np.tile(np.diag(size**2).astype(np.complex128), (sum(lines), 1, 1))

    def errors(numbers: Array) -> Complex:
        trial = model.with_values(dict(zip(model.free, map(float, numbers[:k]), strict=True)))
        ends = numbers[k:].reshape(len(pieces), 2, n)
        parts = [_answer(trial, rows, names, piece, end) for piece, end in zip(pieces, ends, strict=True)]
        return np.concatenate([piece[3] - part for piece, part in zip(pieces, parts, strict=True)])

    def residuals(numbers: Array) -> Array:
        parts = (white @ errors(numbers)[:, :, None]).ravel()
        return np.concatenate([parts.real, parts.imag])

    history: list[float] = []
    for _ in range(_ROUNDS):
        solved = least_squares(residuals, start, jac="3-point", bounds=(low, high), x_scale="jac", xtol=1e-10)
        moved, start = solved.x - start, solved.x
        plain = np.linalg.pinv(solved.jac.T @ solved.jac, hermitian=True)
        spread = np.sqrt(np.diag(plain)[:k] / 2.0)
        history.append(float(solved.cost + np.sum(np.linalg.slogdet(noise)[1])))
        if len(history) > 2 and np.all(np.abs(moved[:k]) < _SETTLED * spread):
            break
        noise = _noise(errors(start), _leverage(solved.jac, plain, sum(lines)), lines)
        white = np.linalg.inv(np.linalg.cholesky(noise))
    # Unit variance of a complex error is one half in each part.
    information = 2.0 * solved.jac.T @ solved.jac
    covariance = _scatter(plain, solved.fun, solved.jac, sum(lines))[:k, :k] * _of_told_weights(len(names), lines)
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.array([abs(value) or 1.0 for value in start[:k]])
    alone = marginal_information(information, np.zeros_like(information), np.arange(k, dtype=np.int64))
    failed = not np.all(np.isfinite(sigma)) or not solved.success
    estimates = tuple(
        Estimate(
            p,
            model.parameters[p].unit,
            model.parameters[p].value,
            float(start[i]),
            sigma=float(sigma[i]),
            insensitivity=float(1.0 / np.sqrt(max(information[i, i], 1e-300))),
            at_bound=bool(start[i] <= low[i] or start[i] >= high[i]),
        )
        for i, p in enumerate(model.free)
    )
    return Result(
        method=METHOD,
        solution=model.with_values(dict(zip(model.free, map(float, start[:k]), strict=True))).with_bounds(
            {e.name: (e.sigma, e.insensitivity) for e in estimates}
        ),
        start=model,
        estimates=estimates,
        names=model.free,
        covariance=covariance,
        covariance_corrected=np.full_like(covariance, np.nan),
        correlation=correlation_of(covariance),
        details=TimeDetails(noise.mean(axis=0).real),
        history=tuple(history),
        converged=bool(solved.success),
        failed=failed,
        problems=("the search has found no least cost: its numbers mean nothing.",) if failed else (),
        warnings=tuple(sign_words(estimates)),
        directions=blind_directions(model.free, alone * np.outer(scale, scale)),
        data=sources_of(flights),
        settings={"band": list(band), "outputs": list(names), "records": sources},
    )


def _leverage(jacobian: Array, plain: Array, lines: int) -> Array:
    """Part of each line that the fit runs through, (lines,)."""
    rows = np.einsum("np,pq,nq->n", jacobian, plain, jacobian)
    return np.asarray(rows.reshape(2, lines, -1).mean(axis=(0, 2)))


def _noise(errors: Complex, leverage: Array, lines: Sequence[int]) -> Complex:
    """Spectral matrix of the noise at every line of every record, from the errors around it, (n, m, m)."""
    m, made, first = errors.shape[1], [], 0
    left_out = errors / np.sqrt(np.maximum(1.0 - leverage, _LEAST_FREE))[:, None]
    for count in lines:
        own = left_out[first : first + count]
        products = own[:, :, None] * own[:, None, :].conj()
        around = max(_AROUND, 2 * m)
        if count <= around:  # too few to tell which outputs err together
            products = np.where(np.eye(m, dtype=bool), products, 0.0)
        total = np.concatenate([np.zeros((1, m, m)), np.cumsum(products, axis=0)])
        low = np.clip(np.arange(count) - around, 0, max(count - 2 * around - 1, 0))
        high = np.minimum(low + 2 * around + 1, count)
        made.append((total[high] - total[low]) / (high - low)[:, None, None])
        first += count
    every = np.concatenate(made)
    size = np.diagonal(every, axis1=1, axis2=2).real
    every[:, range(m), range(m)] += 1e-9 * size + 1e-300
    return every


def _of_told_weights(outputs: int, lines: Sequence[int]) -> float:
    """What it costs that the weights are told by the lines themselves, in variance.

    The inverse of a covariance that n lines tell is n / (n - m) too large on average, with m outputs (complex Wishart).
    The fit loses so much by weights that are off, and sees as much too little of it.
    """
    around = max(_AROUND, 2 * outputs)
    told = min(min(lines), 2 * around + 1)
    return (told / (told - outputs if told > around else told - 1.0)) ** 2


def _scatter(plain: Array, residual: Array, jacobian: Array, lines: int) -> Array:
    """Covariance by what the residuals are, whatever their size: M^-1 sum S_l' v_l v_l' S_l M^-1 over the lines l.

    Each residual counts as if its line had been left out of the fit (White 1980; MacKinnon and White 1985).
    """
    left_out = (
        residual.reshape(2, lines, -1) / np.maximum(1.0 - _leverage(jacobian, plain, lines), _LEAST_FREE)[:, None]
    )
    scores = np.einsum("cnm,cnmp->np", left_out, jacobian.reshape(2, lines, -1, jacobian.shape[1]))
    return np.asarray(plain @ (scores.T @ scores) @ plain)


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
