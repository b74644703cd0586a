"""What a reader of frequency responses must know: dead and doubled inputs, mixing, bias by feedback, bystanders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.excitation import CONTROLLER, FLY, UNKNOWN, Excitation
from swashplate.flights.flight import Flight
from swashplate.identification.core.sources import DataSource
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse
from swashplate.identification.responses.multi_input import SINGULAR, condition_spectra
from swashplate.identification.responses.spectra import Signals, SpectralMatrix, spectral_matrix

MIXED = 0.5
"""Coherence between two inputs above which the pilot (or a loop) mixed them (Tischler and Remple 2012, ch. 9)."""

MOST = 0.25
"""Share of the lines that need a number for the lack of coherence to be the thing to say."""

NEARLY_ONE = 0.9
"""Coherence between two inputs above which a tenth or less of one is its own: errors of a strong response go over."""

CLEAR, EXPLAINED = 0.8, 0.2
"""Partial coherence from which a bystander counts, and the share of the noise that it may leave over."""

SURE = 0.2
"""Random error below which two estimates are compared."""


def _hertz(omega: Array, where: NDArray[np.bool_]) -> str:
    inside = omega[where] / TWO_PI
    return f"{inside.min():.3g}-{inside.max():.3g} Hz"


def _logs(pairs: FrequencyResponse) -> str:
    """The records behind responses."""
    return ", ".join(pairs.sources) or "flight"


def still(flights: Sequence[Flight], names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in names if all(np.ptp(flight.values(name)) == 0.0 for flight in flights))


def dead(flights: Sequence[Flight], inputs: Sequence[str], outputs: Sequence[str]) -> list[str]:
    where = ", ".join(sorted({flight.provenance.source or "flight" for flight in flights}))
    return [
        f"{where}: {role} '{name}' never moves; there is no response for it."
        for role, names in (("input", inputs), ("output", outputs))
        for name in still(flights, names)
    ]


def answers(inputs: Mapping[str, Excitation]) -> list[str]:
    """Inputs that are a controller's answer."""
    return [
        f"{one.record}: input '{name}' is {one.why} Its responses are minus the controller's inverse, not the "
        f"aircraft's, however coherent. {FLY}"
        for name, one in inputs.items()
        if one.kind == CONTROLLER
    ]


def unsure(inputs: Mapping[str, Excitation]) -> list[str]:
    """Inputs of which nobody knows whether they are a controller's answer."""
    return [f"{one.record}: input '{name}': {one.why}" for name, one in inputs.items() if one.kind == UNKNOWN]


def damaged(logs: Sequence[DataSource]) -> list[str]:
    """What is broken in the logs themselves (cut off, bytes lost, clock set back): results are of what is left."""
    return [f"{log.name or 'flight'}: {'; '.join(log.damage)}; what was read is used." for log in logs if log.damage]


def correlated(pairs: FrequencyResponse, *, dead: Sequence[str]) -> list[str]:
    """Inputs that no frequency, or hardly one, tells apart."""
    alive = [o for o, name in enumerate(pairs.outputs) if name not in dead]
    together: dict[tuple[str, ...], list[str]] = {}
    for i, name in enumerate(pairs.inputs):
        lost = np.isnan(pairs.response[:, alive, i]).all(axis=1) & np.isfinite(pairs.input_power[:, i])
        if name in dead or not alive or len(pairs.inputs) < 2 or not lost.any():
            continue
        mean = np.nan_to_num(pairs.input_coherence[lost, i, :]).mean(axis=0)
        mean[i] = -1.0
        if pairs.method != "direct" and mean.max() < MIXED:
            continue  # it is not that inputs move together: references tell too little (`untold`)
        pair = tuple(sorted((name, pairs.inputs[int(np.argmax(mean))])))
        together.setdefault(pair, []).append(_hertz(pairs.omega, lost))
    return [
        f"{_logs(pairs)}: '{one}' and '{other}' move together at {' and '.join(dict.fromkeys(bands))}: less than "
        f"{100 * SINGULAR:g} % of one's power is its own. No number is given there; move the inputs "
        "independently, best in a sweep of each."
        for (one, other), bands in together.items()
    ]


def untold(pairs: FrequencyResponse, *, dead: Sequence[str]) -> list[str]:
    """Inputs of which references tell too little somewhere inside the band that they tell."""
    lines = []
    for i, name in enumerate(pairs.inputs):
        known = np.isfinite(pairs.response[:, :, i]).any(axis=1)
        lost = ~known & np.isfinite(pairs.input_power[:, i])
        if pairs.method == "direct" or name in dead or not lost.any():
            continue
        weak = "the references are" if pairs.method == "joint" else "its sweep is"
        lines.append(
            f"{weak} too weak in '{name}' at {_bands(pairs.omega, lost)}, where a loop's response to gusts dominates: "
            "no number is given there. Sweep slower or larger."
        )
    return lines


def incoherent(pairs: FrequencyResponse) -> list[str]:
    lines = []
    for output in pairs.outputs:
        o = pairs.outputs.index(output)
        # Where the inputs could not be told apart nearly everywhere, that is what is said.
        if np.isfinite(pairs.response[:, o, :]).any(axis=1).mean() < MOST:
            continue
        if all(pairs.band(output, name) is None for name in pairs.inputs):
            best = float(np.nanmax(pairs.coherence[:, o, :]))
            lines.append(
                f"{_logs(pairs)}: no input reaches a coherence of {LEAST_COHERENCE:g} with output '{output}' over a "
                f"quarter of an octave (largest single value {best:.2f}): do not use its responses."
            )
    return lines


def few_averages(matrices: Sequence[SpectralMatrix]) -> list[str]:
    fewest = min(matrix.averages for matrix in matrices)
    if fewest >= 4.95:
        return []
    return [f"the longest window fits {fewest:.1f} times into the records, expected at least 5: errors are large."]


def mixing_words(pairs: FrequencyResponse, *, named: int) -> list[str]:
    """Pairs of inputs that moved together, over the whole band or nearly as one in a part of it.

    Args:
        pairs: responses to all inputs, those that were asked for first. named: how many these are.
    """
    lines = []
    for i, one in enumerate(pairs.inputs):
        for j, other in enumerate(pairs.inputs[: min(i, named)]):
            mixed = np.nan_to_num(pairs.input_coherence[:, i, j])
            known = np.all(np.any(np.isfinite(pairs.response[:, :, [i, j]]), axis=1), axis=1)
            mean = float(np.mean(mixed[known])) if known.any() else 0.0
            if mean > MIXED:
                lines.append(
                    f"'{other}' and '{one}' moved together (mean coherence {mean:.2f}, over {MIXED:g}): "
                    "conditioning tells them apart, with larger errors."
                )
            nearly = known & (mixed > NEARLY_ONE)
            if nearly.any() and pairs.omega[nearly].max() >= pairs.omega[nearly].min() * 2.0**0.25:
                lines.append(
                    f"'{other}' and '{one}' were nearly one at {_hertz(pairs.omega, nearly)} (coherence up to "
                    f"{mixed[nearly].max():.2f}): what windows blur counts many times over there. Do not trust weak "
                    "responses to either, however coherent; fly one log per axis."
                )
    return lines


def biased_by_feedback(free: FrequencyResponse, direct: FrequencyResponse) -> NDArray[np.bool_]:
    """Where the loop makes the direct estimate another one than one that no loop biases, shape of the responses.

    Beyond three times the errors of both and 1 dB, and at three lines in a row or more.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(np.log(direct.response / free.response))
        bound = np.maximum(3.0 * np.hypot(free.error, direct.error), np.log(10.0) / 20.0)
        off = apart > bound
    inner = np.zeros_like(off)
    inner[1:-1] = off[1:-1] & off[:-2] & off[2:]
    wide = inner.copy()
    wide[1:] |= inner[:-1]
    wide[:-1] |= inner[1:]
    return np.asarray(wide)


def bias_words(free: FrequencyResponse, direct: FrequencyResponse, biased: NDArray[np.bool_]) -> list[str]:
    """For every response, the bands in which the loop makes the direct estimate another one."""
    lines = []
    given = {"joint": "the joint estimate"}.get(free.method, "the estimate along the sweep")
    for o, output in enumerate(free.outputs):
        for i, name in enumerate(free.inputs):
            off = biased[:, o, i]
            if off.any():
                apart = np.abs(np.log(direct.response[off, o, i] / free.response[off, o, i]))
                lines.append(
                    f"{output} / {name}: feedback biases the direct estimate by up to "
                    f"{20 / np.log(10.0) * np.nanmax(apart):.1f} dB at {_bands(free.omega, off)}; {given} is given."
                )
    return lines


def _bands(omega: Array, where: NDArray[np.bool_]) -> str:
    """Runs of lines, those less than a third of an octave apart taken together."""
    hertz = omega[where] / TWO_PI
    breaks = np.flatnonzero(hertz[1:] > hertz[:-1] * 2.0 ** (1.0 / 3.0))
    first, last = hertz[[0, *(breaks + 1)]], hertz[[*breaks, -1]]
    return " and ".join(f"{low:.3g}-{high:.3g} Hz" for low, high in zip(first, last, strict=True))


def without_unswept(
    pairs: FrequencyResponse, swept: Sequence[bool], biased: NDArray[np.bool_]
) -> tuple[FrequencyResponse, list[str]]:
    """The responses less those that feedback spoils: of inputs without a sweep, up to where it biases the others'."""
    unswept = [i for i, known in enumerate(swept) if not known]
    names = ", ".join(f"'{pairs.inputs[i]}'" for i in unswept)
    lines = np.flatnonzero(biased.any(axis=(1, 2)))
    if not unswept:
        return pairs, []
    if not lines.size:
        return pairs, [f"no sweep of {names} was found: these responses are direct, and a loop may bias them."]
    response = pairs.response.copy()
    response[: lines[-1] + 1][:, :, unswept] = np.nan
    low, high = pairs.omega[lines[[0, -1]]] / TWO_PI
    return replace(pairs, response=response), [
        f"no sweep of {names} was found, and at {low:.3g}-{high:.3g} Hz feedback biases the direct estimates of the "
        "other inputs: no number is given for it up to there. Name its excitation with --references; --direct gives "
        "the direct estimate."
    ]


def unused_references(
    flights: Sequence[Flight], inputs: Sequence[str], *, names: tuple[str, ...], axes: int
) -> list[str]:
    """Injected excitations in the logs that would make the joint estimate, where the loop may bias the direct one.

    One that swept several axes in turn counts once for each.
    """
    shared = set.intersection(*(set(map(str, f.streams[f.stream_of(inputs[0])].data_vars)) for f in flights))
    moving = sorted(n for n in shared - set(inputs) if n.startswith(names) and n not in still(flights, (n,)))
    spare = [n for n in moving if flights[0][n].attrs.get("units") != "Hz"]  # not the sweep's own frequency
    enough = len(spare) >= len(inputs) or (len(spare) == 1 and axes >= len(inputs))
    if not enough or any(name.startswith(names) for name in inputs):
        return []
    return [
        f"the logs hold {', '.join(spare)}: --references {','.join(spare)} makes the estimate that no loop biases, "
        "above all where little was swept."
    ]


def bystander_words(
    pieces: Sequence[Signals],
    omega: Array,
    inputs: Sequence[str],
    outputs: Sequence[str],
    others: Sequence[str],
    *,
    named: int,
    closed: Sequence[str],
    window: float,
    overlap: float,
    incoherent: Sequence[str] = (),
) -> list[str]:
    """Commands left out that change the answer to a named input: compared in one window, with and without them.

    A middle window: enough averages to be sure of a difference, long enough to see the low end. The pieces hold
    inputs (the `named` first), outputs and the others, in this order. A loop that is broken at an input (the outputs
    `closed`) has the others closed: there they move along rightly.
    Of outputs that the inputs do not move (`incoherent`), those are
    named that move them: before gusts are blamed, every command is asked.
    """
    n_in, n_out = len(inputs), len(outputs)
    first = pieces[0].values.shape[1] - len(others)
    lines: list[str] = []
    matrix = spectral_matrix(pieces, omega, window=window, overlap=overlap)
    if matrix is None:
        return []
    places = list(range(n_in, n_in + n_out))
    alone = condition_spectra(matrix.values[:, : n_in + n_out, : n_in + n_out], n_in, averages=matrix.averages)
    for k, name in enumerate(others):
        order = [*range(n_in), first + k, *places]
        both = condition_spectra(
            matrix.values[np.ix_(range(omega.size), order, order)], n_in + 1, averages=matrix.averages
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            # What it adds must be real: its own share, its own effect, and noise that it explains away.
            quieter = (1.0 - both.multiple) < EXPLAINED * (1.0 - alone.multiple)
        for o, output in enumerate(outputs):
            acts = quieter[:, o] & (both.coherence[:, o, n_in] >= CLEAR)
            before = len(lines)
            for i, mover in enumerate(inputs[:named] if output not in closed else ()):
                h, b = alone.response[:, o, i], both.response[:, o, i]
                with np.errstate(divide="ignore", invalid="ignore"):
                    apart = np.abs(np.log(h / b))
                bound = np.maximum(3.0 * both.error[:, o, i], np.log(10.0) / 40.0)
                off = (both.error[:, o, i] < SURE) & (apart > bound) & acts
                if off.sum() > max(2, 0.05 * np.isfinite(h).sum()):
                    lines.append(
                        f"{output} / {mover}: '{name}' moved along and acts on {output} too at {_hertz(omega, off)}; "
                        f"this single response is wrong there. Add '{name}' to the inputs, and logs that move each."
                    )
            if len(lines) == before and output in incoherent and acts.sum() > max(2, 0.05 * omega.size):
                lines.append(
                    f"{output}: '{name}' explains at {_hertz(omega, acts)} what the inputs leave. Add '{name}' to the "
                    "inputs."
                )
    return lines


RISING = 15.0
"""Degrees by which a phase may rise over the coherent band, while the gain does not, before it is said."""


def lead_words(pairs: FrequencyResponse) -> list[str]:
    """Outputs that run ahead of their input: phase that rises where the gain does not.

    A stable system's phase rises only with its gain (Bode 1945: 90 degrees for 20 dB per decade), and delays make it
    fall. What is left is a controller that answers the motion, a time skew, or an unstable aircraft.
    """
    lines = []
    for output in pairs.outputs:
        for name in pairs.inputs:
            h, _, error = pairs.pair(output, name)
            band = pairs.band(output, name)
            if band is None:
                continue
            inside = (pairs.omega >= band[0]) & (pairs.omega <= band[1]) & np.isfinite(h)
            decades = np.log10(pairs.omega[inside])
            if decades.size < 8 or decades[-1] - decades[0] < 0.5:
                continue
            weight = 1.0 / np.maximum(np.degrees(error[inside]), 1.0)
            phase, sigma = _weighted_slope(decades, np.degrees(np.unwrap(np.angle(h[inside]))), weight)
            gain, _ = _weighted_slope(decades, 20.0 * np.log10(np.abs(h[inside])), weight)
            ahead = phase * (decades[-1] - decades[0])
            if ahead > RISING and phase > 3.0 * sigma and gain < 1.0:
                lines.append(
                    f"{output} / {name}: the phase rises by {ahead:.0f} degrees over "
                    f"{_hertz(pairs.omega, inside)} while the gain does not: the output runs ahead of the input. A "
                    "controller that answers the motion looks like this, and so do channels skewed in time or an "
                    "unstable aircraft; do not take it for the aircraft unless an injected sweep (--references) agrees."
                )
    return lines


def _weighted_slope(x: Array, y: Array, weight: Array) -> tuple[float, float]:
    """Slope of a weighted straight line and its standard deviation from the scatter about it."""
    middle = float(np.average(x, weights=weight**2))
    level = float(np.average(y, weights=weight**2))
    spread = float(weight**2 @ (x - middle) ** 2)
    slope = float(weight**2 @ ((x - middle) * (y - level))) / spread
    scatter = weight * (y - level - slope * (x - middle))
    return slope, float(np.sqrt(scatter @ scatter / max(x.size - 2, 1) / spread))
