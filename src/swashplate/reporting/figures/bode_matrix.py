"""Bode diagrams side by side: outputs below each other, inputs beside each other, with coherence and fitted models."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.reading_accuracy import Answers, Fitted, answers
from swashplate.identification.responses.frequency_response import (
    LEAST_COHERENCE,
    TWO_PI,
    FrequencyResponse,
    decibel,
    unwrapped_degrees,
)
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    BLACK,
    FLIGHT,
    GREY,
    MODEL,
    FigurePart,
    axis,
    base_layout,
    line,
    phase_ticks,
    shade,
)
from swashplate.reporting.words import counted

_ERROR = "rgba(0,0,0,0.15)"
_BOUND = "rgba(0,114,178,0.18)"
_DB = 20.0 / np.log(10.0)
_HEIGHTS = (130, 110, 70)
"""Of magnitude, phase and coherence [px]."""
_HEAD, _FOOT, _BETWEEN = 26, 50, 14
_WIDE = 230
"""Pixels that a column needs."""
_ACROSS = 0.14


@dataclass(frozen=True)
class Pair:
    """One cell of the matrix: a measured response, and perhaps a model of it.

    Attributes:
        output, input: channels. omega: [rad/s], shape (n,). response, coherence: shape (n,).
        error: relative random error, shape (n,); None where it is not known.
        model: a fitted model's response.
    """

    output: str
    input: str
    omega: Array
    response: Complex
    coherence: Array
    error: Array | None = None
    model: Answers | None = None


def of_responses(
    responses: FrequencyResponse,
    pairs: Sequence[tuple[str, str]] | None = None,
    *,
    without: Container[tuple[str, str]] = (),
) -> Figure:
    """Measured responses.

    Args:
        responses: measured.
        pairs: (output, input) side by side; where None the matrix of all outputs and inputs that answer coherently.
        without: pairs whose place in the matrix stays empty.

    Raises:
        IdentificationError: a channel that is not in the responses.
    """
    if pairs is None:
        every = [(o, i) for o in responses.outputs for i in responses.inputs if (o, i) not in without]
        coherent = [pair for pair in every if responses.band(*pair) is not None] or every[:1]
        outputs, inputs = ({pair[k] for pair in coherent} for k in (0, 1))
        rows = [[(o, i) for i in responses.inputs if i in inputs] for o in responses.outputs if o in outputs]
    else:
        rows = [list(pairs)]

    def cell(output: str, input: str) -> Pair | None:
        if (output, input) in without:
            return None
        return Pair(output, input, responses.omega, *responses.pair(output, input))

    return bode_matrix([[cell(*pair) for pair in row] for row in rows])


def of_fit(fit: Fitted) -> Figure:
    """What a model was fitted to, and the model."""
    targets = {(t.output, t.input): t for t in fit.targets}
    outputs, inputs = (list(dict.fromkeys(pair[k] for pair in targets)) for k in (0, 1))
    rows = []
    for output in outputs:
        row: list[Pair | None] = []
        for name in inputs:
            t = targets.get((output, name))
            if t is None:
                row.append(None)
                continue
            omega = np.geomspace(t.omega[0], t.omega[-1], 100)
            row.append(Pair(output, name, t.omega, t.measured, t.coherence, t.error, answers(fit, output, name, omega)))
        rows.append(row)
    return bode_matrix(rows, identifier="fitted-responses")


def bode_matrix(rows: Sequence[Sequence[Pair | None]], *, identifier: str = "bode-matrix") -> Figure:
    """Magnitude, phase and coherence of each cell; outputs down, inputs across; all zoom in frequency together.

    Args:
        rows: cells; None leaves a place empty.
        identifier: of the figure.
    """
    across = max(len(row) for row in rows)
    block = _HEAD + sum(_HEIGHTS) + 2 * _BETWEEN
    total = len(rows) * block + _FOOT
    layout = base_layout(total, top=4, bottom=_FOOT)
    layout |= {"annotations": [], "meta": {"frequency": "Hz"}}
    width = (1.0 - _ACROSS * (across - 1) * (0.5 if across > 2 else 1.0)) / across
    gap = (1.0 - width * across) / max(across - 1, 1)
    inner = total - _FOOT - 4
    traces: list[FigurePart] = []
    number = 0
    for r, row in enumerate(rows):
        for c, pair in enumerate(row):
            if pair is None:
                continue
            top = inner - r * block - _HEAD
            left = c * (width + gap)
            lowest = all(r2 == r or c >= len(rows[r2]) or rows[r2][c] is None for r2 in range(r, len(rows)))
            numbers = []
            for k, (title, high) in enumerate(zip(_TITLES, _HEIGHTS, strict=True)):
                number += 1
                n = "" if number == 1 else str(number)
                numbers.append(n)
                last = k == 2
                layout[f"yaxis{n}"] = axis(
                    title if c == 0 else "",
                    domain=[max(0.0, (top - high) / inner), top / inner],
                    anchor=f"x{n}",
                    nticks=5,
                )
                layout[f"xaxis{n}"] = axis(
                    "frequency [Hz]" if last and lowest else "",
                    domain=[left, min(1.0, left + width)],
                    anchor=f"y{n}",
                    matches=None if number == 1 else "x",
                    showticklabels=last and lowest,
                    type="log",
                )
                top -= high + _BETWEEN
            upper = layout[f"yaxis{numbers[0]}"]["domain"][1]
            layout["annotations"].append(_heading(f"{pair.output} / {pair.input}", left, upper))
            layout[f"yaxis{numbers[1]}"] |= phase_ticks(_phase(pair))
            layout[f"yaxis{numbers[2]}"]["range"] = [0, 1.02]
            traces += _traces(pair, numbers)
    cells = [pair for row in rows for pair in row if pair is not None]
    return Figure(
        identifier,
        {"data": traces, "layout": layout},
        f"Magnitude, phase and coherence of {counted(len(cells), 'response')}; grey where the coherence is below "
        f"{LEAST_COHERENCE:g} and the response is not to be used.",
        f"Bode diagrams of {', '.join(f'{p.output} over {p.input}' for p in cells)}.",
        keys=_keys(cells),
        min_width=_WIDE * across if across > 2 else 0,
    )


def _heading(text: str, left: float, upper: float) -> FigurePart:
    """What stands over a cell."""
    return {
        "text": f"<b>{text}</b>",
        "xref": "paper",
        "yref": "paper",
        "x": left,
        "y": upper,
        "xanchor": "left",
        "yanchor": "bottom",
        "showarrow": False,
        "font": {"size": 12},
    }


_TITLES = ("magnitude [dB]", "phase [deg]", "coherence [-]")


def _keys(cells: Sequence[Pair]) -> tuple[Key, ...]:
    keys = [Key("flight", FLIGHT)]
    if any(np.any(p.coherence < LEAST_COHERENCE) for p in cells):
        keys.append(Key(f"coherence below {LEAST_COHERENCE:g}", GREY))
    if any(p.error is not None for p in cells):
        keys.append(Key("±2 random errors", _ERROR, "band"))
    if any(p.model is not None for p in cells):
        keys.append(Key("model", MODEL, "dash"))
    if any(p.model is not None and np.isfinite(p.model.gain).all() for p in cells):
        keys.append(Key("±2 σ of the model", _BOUND, "band"))
    return tuple(keys)


def beside_model(phase: Array, omega: Array, model_omega: Array, model_phase: Array) -> Array:
    """A flight's phase [deg] with the model's count of whole turns, line by line where the model is.

    At a notch a flight's phase may turn either way; beyond the model's lines the turns of its ends stay.
    """
    inside = (omega >= model_omega[0] * (1.0 - 1e-9)) & (omega <= model_omega[-1] * (1.0 + 1e-9))
    places = np.flatnonzero(inside & np.isfinite(phase))
    if places.size == 0:
        return phase
    reference = np.interp(omega, model_omega, model_phase)
    turns = np.round((reference - phase) / 360.0)
    nearest = places[np.clip(np.searchsorted(places, np.arange(phase.size)), 0, places.size - 1)]
    return np.asarray(phase + 360.0 * turns[nearest])


def _phase(pair: Pair) -> Array:
    """The flight's phase [deg] without jumps of whole turns, beside the model's where there is one."""
    phase = unwrapped_degrees(pair.response, coherent=pair.coherence >= LEAST_COHERENCE)
    if pair.model is None:
        return phase
    return beside_model(phase, pair.omega, pair.model.omega, unwrapped_degrees(pair.model.response))


def _traces(pair: Pair, numbers: Sequence[str]) -> list[FigurePart]:
    hertz = pair.omega / TWO_PI
    gain, phase = np.asarray(decibel(pair.response)), _phase(pair)
    good = pair.coherence >= LEAST_COHERENCE
    near = np.concatenate([[True], good, [True]])
    beside = ~good | ~near[:-2] | ~near[2:]  # grey lines reach the black ones and do not run below them
    name = f"{pair.output} / {pair.input}"
    hover = f"{name}<br>%{{x:.3g}} Hz, %{{y:.4g}}"
    traces = []
    if pair.error is not None:
        spread = np.minimum(pair.error, 3.0)
        up, down = 20.0 * np.log10(1.0 + 2.0 * spread), 20.0 * np.log10(np.maximum(1.0 - 2.0 * spread, 0.1))
        lag = np.degrees(2.0 * spread)
        for n, middle, above, below in ((numbers[0], gain, up, down), (numbers[1], phase, lag, -lag)):
            for run in _runs(good & np.isfinite(middle) & np.isfinite(spread)):
                edge = np.concatenate([(middle + above)[run], (middle + below)[run][::-1]])
                x = np.concatenate([hertz[run], hertz[run][::-1]])
                traces.append(shade(x, edge, name="±2 random errors", color=_ERROR, axis=n))
    for n, values in zip(numbers, (gain, phase, pair.coherence), strict=True):
        if not good.all():
            faint = np.where(beside, values, np.nan)
            traces.append(line(hertz, faint, name=name, color=GREY, width=0.9, axis=n, hover=hover))
        traces.append(line(hertz, np.where(good, values, np.nan), name=name, color=BLACK, axis=n, hover=hover))
    if pair.model is not None:
        omega, answer = pair.model.omega, pair.model.response
        middles = (np.asarray(decibel(answer)), unwrapped_degrees(answer))
        for n, values, half in zip(
            numbers, middles, (2.0 * _DB * pair.model.gain, np.degrees(2.0 * pair.model.phase)), strict=False
        ):
            if np.isfinite(half).all():
                x, edge = (np.concatenate([a, b[::-1]]) for a, b in ((omega, omega), (values + half, values - half)))
                traces.append(shade(x / TWO_PI, edge, name="±2 σ of the model", color=_BOUND, axis=n))
        for n, values in zip(numbers, middles, strict=False):
            traces.append(
                line(
                    omega / TWO_PI,
                    values,
                    name=f"{name}, model",
                    color=MODEL,
                    dash="dash",
                    width=1.8,
                    axis=n,
                    hover=hover,
                )
            )
    ends = hertz[[0, -1]]
    level = [LEAST_COHERENCE] * 2
    traces.append(line(ends, level, name=f"{LEAST_COHERENCE:g}", color=GREY, dash="dot", width=0.9, axis=numbers[2]))
    return traces


def _runs(good: Any) -> list[Any]:
    """Slices of the unbroken runs of True that are longer than one."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(int), [0]])))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
