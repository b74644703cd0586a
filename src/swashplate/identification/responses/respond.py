"""`respond`: from conditioned flights to frequency responses, with everything a reader needs to trust them or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.flights.conditioning.uniform_records import renamed_channels, slowest_of
from swashplate.flights.consistency import refuse_inconsistent
from swashplate.flights.excitation import excitations, of_inputs
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.record_facts import (
    INJECTED,
    autopilot_gains,
    bystanders_of,
    means,
    unit_of,
)
from swashplate.identification.core.sources import hashes, sources_of
from swashplate.identification.responses import response_warnings
from swashplate.identification.responses.composite import composite
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.input_shares import own_shares
from swashplate.identification.responses.multi_input import (
    Conditioned,
    condition_spectra,
    random_error,
)
from swashplate.identification.responses.own_references import own_references
from swashplate.identification.responses.references import reference_columns, sweeps_of
from swashplate.identification.responses.resolution import LONGER, TWICED, blur, first_guess, without
from swashplate.identification.responses.spectra import Signals, SpectralMatrix, signals, spectral_matrix
from swashplate.identification.responses.window_lengths import Windows, choose_windows

LINES_PER_DECADE = 50
OVERLAP = 0.75
"""Hann windows that overlap so weigh every sample alike; less loses data, more only repeats."""
SLOW = 1.0 / 3.0
"""Share of a channel's own logging rate up to which it is used: beyond, samples fold and what is between is guessed."""
SHORTEST = 0.2
"""Pieces shorter than this share of the longest are left out: they would shorten all windows."""
PERIODS = 4.0
"""Periods that a window must hold for it to count beside longer ones. The book trusts it from one period on; measured
on an R-50 in hover, it is off by 3 dB at two periods and by 0.1 dB at four. Only the longest goes down to one."""


def respond(
    flights: Flight | Sequence[Flight],
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    references: Sequence[str] = (),
    band: tuple[float, float] | None = None,
    windows: Sequence[float] | None = None,
    overlap: float = OVERLAP,
    bystanders: Sequence[str] | None = None,
    lines: int = LINES_PER_DECADE,
    direct: bool = False,
) -> FrequencyResponse:
    """Frequency responses of outputs to inputs, all inputs conditioned on each other, composite over windows.

    A sweep is its own reference: without a recorded one, every sweep that the logs tell of or that is seen in the
    inputs is followed along its own frequency, and what follows it serves as the reference (`own_references`). The
    direct estimate is kept beside it, and where the two differ by more than their errors, a warning says so.

    Args:
        flights: conditioned to one rate; each unbroken piece is a record.
        inputs, outputs: channel names.
        references: excitations that no loop feeds back (an autopilot's injected sweep): the joint input-output estimate
            is made, and compared with the direct one. One reference that sweeps one axis after the other, in one flight
            or several, counts as one per axis (`sweeps_of`).
        band: lowest and highest frequency [Hz]; by default two periods of the longest window to a tenth of the rate. It
            ends where the slowest channel's own rate does not carry further.
        windows: lengths [s]; by the book's rules where None, with a longer one where those blur a clear response.
        overlap: of neighbouring windows.
        bystanders: commands left out of `inputs` that may have moved along; by default every other command (unit "1")
            in the flights. They only warn.
        lines: frequencies per decade.
        direct: the direct estimate alone, as one needs it where the sweeps are none of a pilot or program.

    Raises:
        FlightError: no channel or no record to work on, or a raw flight whose channels contradict each other; messages
            name them.
    """
    flights = as_flights(flights)
    inputs, outputs = tuple(inputs), tuple(outputs)
    doubled = set(inputs) & set(outputs)
    if not inputs or not outputs or doubled:
        raise FlightError(
            f"inputs are {', '.join(inputs) or 'none'}, outputs {', '.join(outputs) or 'none'}.",
            channel=", ".join(doubled) or None,
            hint="Name at least one of each, and no channel twice.",
        )
    if mixed := set(references) & {*inputs, *outputs}:
        raise FlightError(
            "is named as a reference, and as an input or output: a loop feeds it back.",
            channel=", ".join(sorted(mixed)),
            hint="A reference is what a program adds to a command, such as sid_target.",
        )
    for flight in flights:
        if not flight.history:  # as read; whatever conditions a flight checks it itself
            refuse_inconsistent(flight)
    others = bystanders_of(flights, (*inputs, *outputs, *references)) if bystanders is None else tuple(bystanders)
    pieces = signals(flights, (*inputs, *outputs, *references, *others))
    sweep = sweeps_of(flights)
    longest = max(piece.duration for piece in pieces)
    kept = [k for k, piece in enumerate(pieces) if piece.duration >= SHORTEST * longest]
    scraps = [piece.name for k, piece in enumerate(pieces) if k not in kept]
    tracked = None if references or direct else own_references(flights, pieces, inputs)
    swept = [name for name, seen in zip(inputs, tracked.swept, strict=True) if seen] if tracked else []
    moved = of_inputs(excitations(flights, inputs, outputs=outputs, references=references, swept=swept))
    pieces, sweep = [pieces[k] for k in kept], [sweep[k] for k in kept]
    n = len(inputs) + len(outputs)
    own = [replace(piece, values=piece.values[:, :n]) for piece in pieces]
    if references or tracked:
        columns = (
            [tracked.columns[k] for k in kept]
            if tracked
            else reference_columns(sweep, pieces, n, len(references), inputs)
        )
        own = [
            replace(piece, values=np.concatenate([piece.values, c], axis=1))
            for piece, c in zip(own, columns, strict=True)
        ]
    rate = 1.0 / pieces[0].dt
    highest = min(band[1], 0.499 * rate) if band else rate / 10.0
    slow, slowest = slowest_of(flights, (*inputs, *outputs, *references))
    slow_words = []
    if SLOW * slowest < highest:
        slow_words = [
            f"'{slow}' was logged {slowest:.3g} times a second: the band ends at {SLOW * slowest:.3g} Hz, not at "
            f"{highest:.3g} Hz. Log it faster for more."
        ]
        highest = SLOW * slowest
    chosen = choose_windows([piece.duration for piece in pieces], highest)
    if windows is not None:
        chosen = Windows(tuple(sorted((float(w) for w in windows), reverse=True)), ())
    question = _Question(inputs, outputs, own[0].values.shape[1] - n, lines, tracked is not None)
    limits = (band[0] if band else None, highest)
    estimate = _estimate(own, chosen.lengths, overlap, limits, question)
    half, words = min(piece.duration for piece in pieces) / 2.0, blur(estimate.blurred, estimate.made)
    blur_words: list[str] = []
    if words and half >= LONGER * chosen.lengths[0]:
        words = f"windows of up to {chosen.lengths[0]:.3g} s {words}"
        if windows is None:
            estimate = _estimate(own, (half, *chosen.lengths), overlap, limits, question)
            blur_words = [f"{words}; one of {half:.3g} s, half the shortest record, was added."]
        else:
            blur_words = [f"{words}: something of it may be left. Longer windows (--windows {half:.3g},...) help."]
    omega, matrices, notes, blurred, made = estimate
    if scraps:
        notes.append(f"too short beside the longest record, left out: {', '.join(scraps)}.")
    if band and band[1] > highest and not slow_words:
        notes.append(
            f"the band ends at half the rate, {highest:.4g} Hz, not at {band[1]:.4g} Hz; read the logs faster."
        )
    made = replace(made, sources=tuple(piece.name for piece in pieces))
    warnings, problems = [*slow_words, *chosen.warnings, *notes], response_warnings.damaged(sources_of(flights))
    problems += response_warnings.dead(flights, inputs, outputs)
    problems += [
        f"reference '{name}' never moves: nothing was injected, so the joint estimate has no number."
        for name in response_warnings.still(flights, references)
    ]
    problems += response_warnings.answers(moved)
    warnings += response_warnings.unsure(moved)
    if question.references:
        # Both as the windows blur them, so that only the loop tells them apart.
        beside = _composed(matrices, omega, replace(question, references=0), [None] * len(matrices))
        biased = response_warnings.biased_by_feedback(blurred, beside)
        warnings += response_warnings.bias_words(blurred, beside, biased)
        made = replace(made, direct=beside.response, direct_error=beside.error)
        if tracked:
            made, words_of_unswept = response_warnings.without_unswept(made, tracked.swept, biased)
            warnings += words_of_unswept
    # The window that was added counts only where its own error says so.
    warnings += response_warnings.few_averages(matrices[len(blur_words) if windows is None else 0 :])
    warnings += blur_words
    warnings += response_warnings.mixing_words(made)
    warnings += response_warnings.lead_words(made)
    unmoved = response_warnings.still(flights, (*inputs, *outputs))
    problems += response_warnings.correlated(made, dead=unmoved)
    warnings += response_warnings.untold(made, dead=unmoved)
    problems += response_warnings.incoherent(made)
    if not references:
        axes = len({int(k) for labels in sweep for k in np.unique(labels) if k >= 0})
        warnings += response_warnings.unused_references(flights, inputs, names=INJECTED, axes=axes)
    if others and not references and not all(name.startswith(INJECTED) for name in inputs):
        warnings += response_warnings.bystander_words(
            pieces,
            omega,
            inputs,
            outputs,
            others,
            window=chosen.lengths[len(chosen.lengths) // 2],
            overlap=overlap,
            incoherent=[o for o in outputs if all(made.band(o, name) is None for name in inputs)],
        )
    return replace(
        made,
        input_units=tuple(unit_of(flights[0], name) for name in inputs),
        output_units=tuple(unit_of(flights[0], name) for name in outputs),
        warnings=tuple(warnings),
        problems=tuple(problems),
        settings={
            "rate": rate,
            "band_hz": [float(omega[0] / TWO_PI), float(highest)],
            "overlap": overlap,
            "references": list(references),
            **({"sweeps": list(tracked.sweeps)} if tracked else {}),
            "excitation": {name: {"kind": one.kind, "words": one.words} for name, one in moved.items()},
            "averages": [m.averages for m in matrices],
            **({"channels": called} if (called := renamed_channels(flights, (*inputs, *outputs))) else {}),
            **autopilot_gains(flights),
            "hashes": hashes(flights),
            "means": means(flights, (*inputs, *outputs)),
        },
    )


_METHODS = ("direct", "joint")


@dataclass(frozen=True)
class _Question:
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    references: int
    lines: int
    tracked: bool = False


class _Estimate(NamedTuple):
    omega: Array
    matrices: list[SpectralMatrix]
    notes: list[str]
    blurred: FrequencyResponse
    made: FrequencyResponse


def _estimate(
    pieces: Sequence[Signals],
    lengths: tuple[float, ...],
    overlap: float,
    limits: tuple[float | None, float],
    question: _Question,
) -> _Estimate:
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
    blurred = _composed(matrices, omega, question, shares)
    guess = first_guess(blurred)
    rest, _ = _matrices(without(pieces, omega, guess), omega, lengths, overlap)
    sharpened = _composed(matrices, omega, question, shares, guess=guess, rest=rest)
    return _Estimate(omega, matrices, notes, blurred, sharpened)


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
            hint="Give shorter windows (--windows) or fly longer; a record should hold two of its longest windows.",
        )
    return matrices, notes


def _composed(
    matrices: Sequence[SpectralMatrix],
    omega: Array,
    question: _Question,
    shares: Sequence[Array | None],
    *,
    guess: Complex | None = None,
    rest: Sequence[SpectralMatrix] | None = None,
) -> FrequencyResponse:
    """The composite of the conditioned spectra of every window, of what a guess leaves of the outputs where given."""
    n_in, n = len(question.inputs), len(question.inputs) + len(question.outputs)
    parts = []
    for matrix, left, share in zip(matrices, matrices if rest is None else rest, shares, strict=True):
        whole = None if rest is None else np.diagonal(matrix.values, axis1=1, axis2=2).real[:, n_in:n]
        parts.append(
            condition_spectra(
                left.values[:, : n + question.references, : n + question.references],
                n_in,
                averages=matrix.averages,
                removed=guess,
                whole=whole,
                share=share,
                references=question.references,
            )
        )
    response, coherence, error = _joined(parts, [m.averages for m in matrices], n_in)
    weight = np.stack([_window_weight(matrix) for matrix in matrices])
    plain = [m.values for m in matrices]
    auto = _mean(weight, np.stack([np.diagonal(v, axis1=1, axis2=2).real for v in plain]))
    gxx = _mean(weight, np.stack([v[:, :n_in, :n_in] for v in plain]))
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
