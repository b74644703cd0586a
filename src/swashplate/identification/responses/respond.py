"""`respond`: from conditioned flights to frequency responses, with everything a reader needs to trust them or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.channel_names import renamed_channels, slowest_of
from swashplate.flights.checked import checked
from swashplate.flights.excitation import excitations, of_inputs
from swashplate.flights.flight import Flight, as_flights
from swashplate.identification.core.record_facts import (
    INJECTED,
    autopilot_facts,
    bystanders_of,
    means,
    unit_of,
)
from swashplate.identification.core.sources import hashes, problem_words, scale_words, sources_of
from swashplate.identification.responses import response_warnings
from swashplate.identification.responses.copies import (
    copies_of,
    copy_words,
    refuse_copied_references,
    without_copies,
)
from swashplate.identification.responses.estimate import Beside, ResponseQuestion, estimate_beside
from swashplate.identification.responses.excitations import answering_words, only_answering, told_sweeps
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.references import references_of
from swashplate.identification.responses.resolution import LONGER, blur
from swashplate.identification.responses.signs import sign_problems
from swashplate.identification.responses.spectra import signals

WINDOWS = 5


@dataclass(frozen=True)
class Windows:
    """Lengths [s] of the windows, longest first, with what was bent to get them."""

    lengths: tuple[float, ...]
    warnings: tuple[str, ...]


def choose_windows(durations: Sequence[float], highest: float, *, count: int = WINDOWS) -> Windows:
    """Window lengths by the book's rules (Tischler and Remple 2012, ch. 10).

    The longest is at most half the shortest record and a fifth of all; the shortest holds at least 20 periods of the
    highest frequency.

    Args:
        durations: of the records [s].
        highest: highest frequency [Hz].
        count: how many lengths, spread geometrically.
    """
    longest = min(min(durations) / 2.0, sum(durations) / 5.0)
    shortest = min(20.0 / highest, longest)
    warned: tuple[str, ...] = ()
    if 20.0 / highest > longest:
        warned = (
            f"the records are short: a window of {longest:.3g} s holds {longest * highest:.0f} periods of the highest "
            f"frequency ({highest:.3g} Hz), expected 20. Fly longer for a trustworthy response.",
        )
    shortest = max(shortest, longest / 10.0)
    number = count if longest > 1.2 * shortest else 1
    lengths = np.geomspace(longest, shortest, number) if number > 1 else np.array([longest])
    return Windows(tuple(float(length) for length in lengths), warned)


LINES_PER_DECADE = 50
OVERLAP = 0.75
"""Hann windows that overlap so weigh every sample alike; less loses data, more only repeats."""
SLOW = 1.0 / 3.0
"""Share of a channel's own logging rate up to which it is used: beyond, samples fold and what is between is guessed."""
SHORTEST = 0.2
"""Pieces shorter than this share of the longest are left out: they would shorten all windows."""


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
    commands is followed along its own frequency, and what follows it serves as the reference (`own_references`). The
    direct estimate is kept beside it, and where the two differ by more than their errors, a warning says so.

    Each input has its own sweeps only (`excitations`). What was swept but not named is held still where it can be told
    apart (`estimate_beside`). An output that is a copy of an input has no response to it (`copies`).

    Args:
        flights: conditioned to one rate; each unbroken piece is a record.
        inputs, outputs: channel names.
        references: excitations that no loop feeds back (an autopilot's injected sweep): the joint input-output estimate
            is made, and compared with the direct one. One reference that sweeps one axis after the other, in one flight
            or several, counts as one per axis.
        band: lowest and highest frequency [Hz]; by default two periods of the longest window to a tenth of the rate. It
            ends where the slowest channel's own rate does not carry further.
        windows: lengths [s]; by the book's rules where None, with a longer one where those blur a clear response.
        overlap: of neighbouring windows.
        bystanders: commands left out of `inputs` that may have been swept or have moved along; by default every other
            command (unit "1") in the flights.
        lines: frequencies per decade.
        direct: the direct estimate alone, as one needs it where the sweeps are none of a pilot or program.

    Raises:
        FlightError: no channel or no record to work on, inputs that no sweep moved while others were swept, a reference
            that is a copy of an input or output, or a raw flight whose channels contradict each other; messages name
            them.
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
    # What is as read is checked here; whatever conditions a flight checks it itself.
    named = {*inputs, *outputs, *references}
    flights = tuple(flight if flight.history else checked(flight, named) for flight in flights)
    others = bystanders_of(flights, (*inputs, *outputs, *references)) if bystanders is None else tuple(bystanders)
    pieces, logged = signals(flights, (*inputs, *outputs, *references, *others)), told_sweeps(flights)
    longest = max(piece.duration for piece in pieces)
    kept = [k for k, piece in enumerate(pieces) if piece.duration >= SHORTEST * longest]
    scraps = [piece.name for k, piece in enumerate(pieces) if k not in kept]
    pieces, logged = [pieces[k] for k in kept], [logged[k] for k in kept]
    place = {name: k for k, name in enumerate((*inputs, *outputs, *references, *others))}
    commands = {name: place[name] for name in (*inputs, *others)}
    recorded = {name: place[name] for name in references}
    fed = {name: place[name] for name in (*inputs, *outputs)}
    refuse_copied_references(pieces, recorded, fed)
    copies = copies_of(pieces, *({name: place[name] for name in names} for names in (inputs, outputs)))
    called, refs = renamed_channels(flights, commands), None
    if references or not direct:
        refs = references_of(pieces, logged, commands, len(inputs), recorded, called=called)
    swept = [name for name, is_swept in zip(inputs, refs.swept, strict=False) if is_swept] if refs else []
    motion = [name for name in outputs if all(name != copy.other for copy in copies)]
    excitation = of_inputs(excitations(flights, inputs, outputs=motion, references=references, swept=swept))
    answering = refs.answering if refs else only_answering(logged, inputs, called=called)
    # What was swept beside the named inputs is held still with them; the named ones are given.
    every = (*inputs, *(refs.beside if refs else ()))
    n = len(every) + len(outputs)
    channels = [place[name] for name in (*every, *outputs)]
    cut = [replace(piece, values=piece.values.take(channels, axis=1)) for piece in pieces]
    if refs:
        cut = [
            replace(piece, values=np.concatenate([piece.values, c], axis=1))
            for piece, c in zip(cut, refs.columns, strict=True)
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
    question = ResponseQuestion(every, outputs, cut[0].values.shape[1] - n, lines, refs is not None and refs.tracked)
    limits = (band[0] if band else None, highest)
    loops = refs.broken_loops(pieces, place, every, outputs) if refs else ()
    aside = {i: k for i, k in refs.reference_of.items() if i >= len(inputs)} if refs else {}
    beside = Beside(aside, [outputs.index(name) for name in loops])
    estimate = estimate_beside(cut, chosen.lengths, overlap, limits, question, beside)
    half = min(piece.duration for piece in pieces) / 2.0
    blurred_by = blur(*(each.select(outputs, inputs) for each in (estimate.blurred, estimate.sharpened)))
    blur_words: list[str] = []
    if blurred_by and half >= LONGER * chosen.lengths[0]:
        blurred_by = f"windows of up to {chosen.lengths[0]:.3g} s {blurred_by}"
        if windows is None:
            estimate = estimate_beside(cut, (half, *chosen.lengths), overlap, limits, question, beside)
            blur_words = [f"{blurred_by}; one of {half:.3g} s, half the shortest record, was added."]
        else:
            blur_words = [
                f"{blurred_by}: something of it may be left. Longer windows (--settings windows={half:.3g},...) help."
            ]
    omega, matrices, notes, blurred, result, free, held = estimate
    if scraps:
        notes.append(f"too short beside the longest record, left out: {', '.join(scraps)}.")
    if band and band[1] > highest and not slow_words:
        notes.append(
            f"the band ends at half the rate, {highest:.4g} Hz, not at {band[1]:.4g} Hz; read the logs faster."
        )
    result = replace(result, sources=tuple(piece.name for piece in pieces))
    data = sources_of(flights)
    warnings = [*slow_words, *chosen.warnings, *notes, *problem_words(data)]
    problems = [*response_warnings.damaged(data), *scale_words(data)]
    problems += response_warnings.dead(flights, inputs, outputs)
    problems += [
        f"reference '{name}' never moves: nothing was injected, so the joint estimate has no number."
        for name in response_warnings.still(flights, references)
    ]
    # Of inputs that no sweep moved while others were swept, `answering_words` tell.
    asked = {name: one for name, one in excitation.items() if name not in answering}
    problems += response_warnings.answers(asked)
    warnings += response_warnings.unsure(asked)
    if free is not None:
        # Both as the windows blur them, so that only the loop tells them apart.
        biased = response_warnings.biased_by_feedback(blurred, free)
        named = biased[:, :, : len(inputs)]
        warnings += response_warnings.bias_words(blurred.select(outputs, inputs), free, named)
        result = replace(result, direct=free.response, direct_error=free.error)
        if refs and refs.tracked:
            known = [has or name in answering for has, name in zip(refs.swept, every, strict=True)]
            result, words_of_unswept = response_warnings.without_unswept(result, known, biased)
            warnings += words_of_unswept
    result = without_copies(result, copies)
    if refs and answering:
        response = result.response.copy()
        response[:, :, [every.index(name) for name in answering]] = np.nan
        result = replace(result, response=response)
    # The window that was added counts only where its own error says so.
    warnings += response_warnings.few_averages(matrices[len(blur_words) if windows is None else 0 :])
    warnings += blur_words
    warnings += response_warnings.mixing_words(result, named=len(inputs))
    silent = response_warnings.still(flights, (*every, *outputs))
    silent = (*silent, *every[len(inputs) :], *(copy.other for copy in copies))
    lacking = [*copy_words(copies), *response_warnings.correlated(result, dead=silent)]
    lacking += [answering_words(logged, answering)] if answering else []
    unswept = [name for name, known in zip(every, refs.swept, strict=True) if not known] if refs else []
    lacking += response_warnings.untold(result, dead=(*silent, *unswept))
    result = result.select(outputs, inputs)
    warnings += response_warnings.lead_words(result)
    lacking += response_warnings.incoherent(result)
    # A response that cannot be given is an error only where nothing else is given.
    given = any(result.band(output, name) for output in outputs for name in inputs)
    warnings, problems = (warnings + lacking, problems) if given else (warnings, problems + lacking)
    if refs:
        warnings += refs.notes(omega / TWO_PI, held, outputs, loops)
    renamed = renamed_channels(flights, (*inputs, *outputs))
    problems += sign_problems(
        result.select(outputs, tuple(name for name in inputs if excitation[name].outside)), flights[0], called=renamed
    )
    if not references:
        axes = max(len({event.details["axis"] for one in logged for event in one.sweeps}), len(flights))
        warnings += response_warnings.unused_references(flights, every, names=INJECTED, axes=axes)
    rest = [name for name in others if name not in every]
    if rest and not all(name.startswith(INJECTED) for name in inputs):
        channels = [*channels, *(place[name] for name in rest)]
        warnings += response_warnings.bystander_words(
            [replace(piece, values=piece.values[:, channels]) for piece in pieces],
            omega,
            every,
            outputs,
            rest,
            named=len(inputs),
            closed=loops,
            window=chosen.lengths[len(chosen.lengths) // 2],
            overlap=overlap,
            incoherent=[o for o in outputs if all(result.band(o, name) is None for name in inputs)],
        )
    return replace(
        result,
        input_units=tuple(unit_of(flights[0], name) for name in inputs),
        output_units=tuple(unit_of(flights[0], name) for name in outputs),
        warnings=tuple(warnings),
        problems=tuple(problems),
        settings={
            "rate": rate,
            "band_hz": [float(omega[0] / TWO_PI), float(highest)],
            "overlap": overlap,
            "references": list(references),
            **({"sweeps": list(refs.sweeps)} if refs and refs.tracked else {}),
            **({"beside": list(refs.beside)} if refs and refs.beside else {}),
            "averages": [m.averages for m in matrices],
            **({"channels": renamed} if renamed else {}),
            "excitation": {name: {"kind": one.kind, "words": one.why} for name, one in excitation.items()},
            **autopilot_facts(flights),
            "hashes": hashes(flights),
            "means": means(flights, (*inputs, *outputs)),
        },
    )
