"""Responses of records by windows of several lengths, joined, in two passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.identification.responses.composite import composite
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.multi_input import Conditioned, condition_spectra, own_shares, random_error
from swashplate.identification.responses.resolution import TWICED, first_guess, without
from swashplate.identification.responses.shared_errors import SharedErrors
from swashplate.identification.responses.spectra import Signals, SpectralMatrix, runs, spectral_matrix

PERIODS = 4.0
"""Periods that a window must hold for it to count beside longer ones. The book trusts it from one period on; measured
on an R-50 in hover, it is off by 3 dB at two periods and by 0.1 dB at four. Only the longest goes down to one."""
_METHODS = ("direct", "joint")


@dataclass(frozen=True)
class ResponseQuestion:
    """What is asked of records: names, how many references stand behind the outputs, lines per decade.

    `tracked`: the sweeps are their own references.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    references: int
    lines: int
    tracked: bool = False


class Beside(NamedTuple):
    """What need not be held still.

    Attributes:
        reference_of: the place among the references of each input that may be let go, by the input's place.
        loops: places of the outputs that are loops broken at an input.
    """

    reference_of: Mapping[int, int] = {}
    loops: Sequence[int] = ()


class EstimateBeside(NamedTuple):
    """Responses of records.

    Attributes:
        omega: frequencies [rad/s]. matrices: the spectra of every window. notes: in words.
        blurred, sharpened: responses as the windows blur them, and sharpened.
        direct: without the references, as the windows blur it; None where there are none.
        held: which inputs are held still where the others act, shape (n_f, n_inputs).
    """

    omega: Array
    matrices: list[SpectralMatrix]
    notes: list[str]
    blurred: FrequencyResponse
    sharpened: FrequencyResponse
    direct: FrequencyResponse | None
    held: NDArray[np.bool_]


def estimate_responses(
    pieces: Sequence[Signals],
    lengths: tuple[float, ...],
    overlap: float,
    limits: tuple[float | None, float],
    question: ResponseQuestion,
) -> EstimateBeside:
    """Responses in two passes, as the windows blur them and sharpened."""
    # What a loop makes of gusts rules below the sweep: unasked, the book's two periods; asked, down to one.
    lowest = 2.0 / lengths[0] if limits[0] is None else max(limits[0], 1.0 / lengths[0])
    highest = limits[1]
    if lowest >= highest:
        raise FlightError(
            f"the records tell nothing below {1.0 / lengths[0]:.3g} Hz, and {highest:.3g} Hz was asked as the "
            f"highest frequency.",
            where=", ".join(piece.name for piece in pieces),
            hint="Give longer records or a higher band.",
        )
    omega = TWO_PI * np.geomspace(lowest, highest, max(8, round(question.lines * np.log10(highest / lowest))))
    matrices, notes = _matrices(pieces, omega, lengths, overlap)
    shares: list[Array | None] = [None] * len(matrices)
    if not question.references or question.tracked:
        shares = own_shares(pieces, matrices, omega, inputs=len(question.inputs), overlap=overlap)
    blurred = composed(matrices, omega, question, shares)
    guess = first_guess(blurred)
    rest, _ = _matrices(without(pieces, omega, guess), omega, lengths, overlap)
    sharpened = composed(matrices, omega, question, shares, guess=guess, rest=rest)
    direct = None
    if question.references:
        direct = composed(matrices, omega, replace(question, references=0), [None] * len(matrices))
    held = np.ones((omega.size, len(question.inputs)), dtype=bool)
    return EstimateBeside(omega, matrices, notes, blurred, sharpened, direct, held)


def estimate_beside(
    pieces: Sequence[Signals],
    lengths: tuple[float, ...],
    overlap: float,
    limits: tuple[float | None, float],
    question: ResponseQuestion,
    beside: Beside,
) -> EstimateBeside:
    """As `estimate_responses`, with some inputs held still only where their own sweeps move them, and not for loops.

    Where an input only answers the others' sweeps, it cannot be told from them; there the responses of the others are
    those with the loop that moves it. So is a loop that is broken at one input: the others stay closed. Stretches in
    which what is not held still was swept are left out.
    """
    estimate = estimate_responses(pieces, lengths, overlap, limits, question)
    n_in = len(question.inputs)
    n = n_in + len(question.outputs)
    weight = np.stack([_window_weight(matrix) for matrix in estimate.matrices])
    spectra = _mean(weight, np.stack([matrix.values for matrix in estimate.matrices]))
    held = estimate.held.copy()
    for i, reference in beside.reference_of.items():
        held[:, i] = _led(spectra[:, n:, i], spectra[:, n:, n:], reference)
    alone = np.array([i not in beside.reference_of for i in range(n_in)])
    patterns = {tuple(map(bool, row)) for row in held} | ({tuple(map(bool, alone))} if beside.loops else set())
    for pattern in sorted(patterns):
        if all(pattern):
            continue
        kept = [i for i in range(n_in) if pattern[i]]
        let_go = [beside.reference_of[i] for i in range(n_in) if not pattern[i]]
        part = _without(pieces, lengths, overlap, limits, question, kept, let_go)
        lines = np.all(held == np.array(pattern), axis=1)
        places = np.zeros((lines.size, n - n_in), dtype=bool)
        places[lines] = True
        places[:, list(beside.loops)] = pattern == tuple(alone)
        estimate = estimate._replace(
            blurred=_with_places(estimate.blurred, part.blurred, places, kept),
            sharpened=_with_places(estimate.sharpened, part.sharpened, places, kept),
            direct=None
            if estimate.direct is None or part.direct is None
            else _with_places(estimate.direct, part.direct, places, kept),
        )
    return estimate._replace(held=held)


def _without(
    pieces: Sequence[Signals],
    lengths: tuple[float, ...],
    overlap: float,
    limits: tuple[float | None, float],
    question: ResponseQuestion,
    kept: Sequence[int],
    let_go: Sequence[int],
) -> EstimateBeside:
    """The estimate with a part of the inputs, from the stretches in which the references `let_go` are silent."""
    n_in, n = len(question.inputs), len(question.inputs) + len(question.outputs)
    references = [n + k for k in range(question.references) if k not in let_go]
    columns = [*kept, *range(n_in, n), *references]
    cut = [
        replace(piece, values=piece.values[run].take(columns, axis=1), start=piece.start + run.start * piece.dt)
        for piece in pieces
        for run in runs(~np.any(piece.values[:, [n + k for k in let_go]], axis=1))
        if np.any(piece.values[run][:, references])
    ]
    asked = replace(question, inputs=tuple(question.inputs[i] for i in kept), references=len(references))
    return estimate_responses(cut, lengths, overlap, limits, asked)


def _led(cross: Complex, auto: Complex, reference: int) -> NDArray[np.bool_]:
    """From the first to the last line where an input follows its own reference more than all others, shape (n_f,).

    Args:
        cross: from references to the input, shape (n_f, n_references). auto: of the references, (n_f, n, n).
        reference: place of its own reference.
    """
    power = np.diagonal(auto, axis1=1, axis2=2).real
    part = np.where(power > 0.0, np.abs(cross) ** 2 / np.where(power > 0.0, power, 1.0), 0.0)
    lead = np.flatnonzero(2.0 * part[:, reference] >= part.sum(axis=1))
    inside = np.zeros(len(part), dtype=bool)
    if lead.size:
        inside[lead[0] : lead[-1] + 1] = True
    return inside


def _with_places(
    full: FrequencyResponse, part: FrequencyResponse, places: NDArray[np.bool_], kept: Sequence[int]
) -> FrequencyResponse:
    """Responses that are at some lines of some outputs those of a part of the inputs; the others have none there.

    Args:
        places: which, shape (n_f, n_outputs). kept: places of the part's inputs.
    """
    arrays = {name: getattr(full, name).copy() for name in ("response", "coherence", "error")}
    for name, values in arrays.items():
        values[places] = np.nan
        for k, i in enumerate(kept):
            values[:, :, i][places] = getattr(part, name)[:, :, k][places]
    return replace(full, **arrays, multiple=np.where(places, part.multiple, full.multiple))


def _matrices(
    pieces: Sequence[Signals], omega: Array, lengths: Sequence[float], overlap: float
) -> tuple[list[SpectralMatrix], list[str]]:
    matrices: list[SpectralMatrix] = []
    notes: list[str] = []
    for length in lengths:
        periods = PERIODS if matrices else 1.0
        matrix = spectral_matrix(pieces, omega, window=length, overlap=overlap, periods=periods)
        if matrix is None:
            notes.append(f"no record is as long as the window of {length:.3g} s; it was left out.")
            continue
        short = [piece.name for piece in pieces if piece.name not in matrix.used]
        if short:
            notes.append(f"shorter than the window of {length:.3g} s and left out of it: {', '.join(short)}.")
        matrices.append(matrix)
    if not matrices:
        longest = max(piece.duration for piece in pieces)
        raise FlightError(
            f"the longest record has {longest:.3g} s, the shortest window {min(lengths):.3g} s.",
            where=", ".join(piece.name for piece in pieces),
            hint="Give shorter windows (--settings windows=...), or fly longer: a record holds two of them.",
        )
    return matrices, notes


def composed(
    matrices: Sequence[SpectralMatrix],
    omega: Array,
    question: ResponseQuestion,
    shares: Sequence[Array | None],
    *,
    guess: Complex | None = None,
    rest: Sequence[SpectralMatrix] | None = None,
) -> FrequencyResponse:
    """The composite of the conditioned spectra of every window, of what a guess leaves of the outputs where given."""
    n_in, n = len(question.inputs), len(question.inputs) + len(question.outputs)
    parts = []
    for matrix, left, share in zip(matrices, matrices if rest is None else rest, shares, strict=True):
        power = None if rest is None else np.diagonal(matrix.values, axis1=1, axis2=2).real[:, n_in:n]
        parts.append(
            condition_spectra(
                left.values[:, : n + question.references, : n + question.references],
                n_in,
                averages=matrix.averages,
                removed=guess,
                total=power,
                share=share,
                references=question.references,
            )
        )
    response, coherence, error = _joined(parts, [m.averages for m in matrices], n_in)
    weight = np.stack([_window_weight(matrix) for matrix in matrices])
    values = [m.values for m in matrices]
    auto = _mean(weight, np.stack([np.diagonal(v, axis1=1, axis2=2).real for v in values]))
    gxx = _mean(weight, np.stack([v[:, :n_in, :n_in] for v in values]))
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.abs(gxx) ** 2 / (auto[:, :n_in, None] * auto[:, None, :n_in])
    return FrequencyResponse(
        omega=omega,
        inputs=question.inputs,
        outputs=question.outputs,
        response=response,
        coherence=coherence,
        multiple=_mean(weight, np.stack([part.multiple for part in parts])),
        error=error if rest is None else TWICED * error,
        input_power=auto[:, :n_in],
        output_power=auto[:, n_in:n],
        input_coherence=between.real,
        method="along sweeps" if question.tracked and question.references else _METHODS[bool(question.references)],
        windows=tuple(m.window for m in matrices),
        shared=SharedErrors.of(
            _mean(weight, np.stack([part.noise for part in parts])),
            _mean(weight, np.stack([part.inverse for part in parts])),
            _mean(weight, np.stack([np.full(omega.size, m.window) for m in matrices])),
        ),
    )


def _joined(parts: Sequence[Conditioned], averages: Sequence[float], inputs: int) -> tuple[Complex, Array, Array]:
    if len(parts) == 1:
        return parts[0].response, parts[0].coherence, parts[0].error
    shape = parts[0].response.shape
    powers = np.stack([np.broadcast_to(part.input_power[:, None, :], shape) for part in parts])
    powers = np.where(np.isfinite(np.stack([part.response for part in parts])), powers, np.nan)
    errors = np.stack([part.error for part in parts])
    gxx, gyy, gxy = composite(
        powers, np.stack([part.output_power for part in parts]), np.stack([part.cross for part in parts]), errors
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        response, coherence = gxy / gxx, np.abs(gxy) ** 2 / (gxx * gyy)
        weight = np.where(np.isfinite(powers), np.maximum(errors, 1e-9) ** -4.0, 0.0)
        many = np.sum(weight * np.reshape(averages, (-1, 1, 1, 1)), axis=0) / np.sum(weight, axis=0)
    effective = np.maximum(many - (inputs - 1), 1.0)
    return response, coherence, random_error(coherence, 1.0) / np.sqrt(effective)


def _window_weight(matrix: SpectralMatrix) -> Array:
    """How much one window's matrix counts for figures that belong to no pair, shape (n_f,)."""
    known = np.isfinite(matrix.values[:, 0, 0])
    return np.where(known, matrix.averages**2, 0.0)


def _mean(weight: Array, values: NDArray[Any]) -> NDArray[Any]:
    shaped = weight.reshape(weight.shape + (1,) * (values.ndim - 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        total = np.sum(np.where(shaped > 0.0, shaped * np.nan_to_num(values), 0.0), axis=0)
        return np.asarray(total / shaped.sum(axis=0))
