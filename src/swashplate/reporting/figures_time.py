"""Flight against model over time as in Figs 8 and 9 of Fankhauser et al.: inputs on top, flight solid, model dashed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.schema import channel
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    BAND,
    FLIGHT,
    INPUT_COLORS,
    MAX_POINTS,
    MODEL,
    axis_title,
    dots,
    inputs_title,
    joined,
    kept,
    line,
    numbers,
    shade,
    shown,
    stacked,
    unit_words,
)

PANEL = 96
"""Height of one panel [px]."""

_VERTICAL_INPUTS = ("motor", "collective", "pedal", "throttle")
_GROUPS = (
    ("tilt", "Roll and pitch", ("phi", "theta", "p", "q")),
    ("horizontal", "Horizontal motion", ("x", "y", "u", "v")),
    ("heave-yaw", "Heave and yaw", ("z", "w", "psi", "r")),
)
_PIECE = re.compile(r" -?\d+\.\d+--?\d+\.\d+ s$")


@dataclass(frozen=True)
class Series:
    """One channel of one unbroken piece: `sigma` is the standard deviation promised for the model, None for none."""

    time: Array
    flight: Array
    model: Array | None = None
    sigma: Array | None = None


@dataclass(frozen=True)
class Prediction:
    """One channel predicted from a start point."""

    time: Array
    model: Array
    sigma: Array


def flight_name(record: str) -> str:
    """The flight that a record is a piece of."""
    return _PIECE.sub("", record)


def inputs_of(group: str, names: Sequence[str]) -> list[int]:
    """Which inputs stand on top of a group of channels."""
    vertical = [i for i, name in enumerate(names) if name.startswith(_VERTICAL_INPUTS)]
    lateral = [i for i in range(len(names)) if i not in vertical]
    wanted = vertical if group == "heave-yaw" else lateral
    return wanted or list(range(len(names)))


def time_figures(
    channels: Mapping[str, Sequence[Series]],
    inputs: Sequence[tuple[Array, Array]],
    input_names: Sequence[str],
    *,
    identifier: str,
    source: str,
    model_words: str,
    flight_words: str = "flight",
    predictions: Mapping[str, Sequence[Prediction]] | None = None,
) -> tuple[Figure, ...]:
    """The figures of one flight, one per group of channels that it has.

    Args:
        channels: pieces of each channel, inside units.
        inputs: time (n,) and commands (n, n_inputs) of each piece.
        identifier: prefix of the figures' identifiers.
        source: the flight's name.
        model_words, flight_words: what the dashed and the solid lines are.
        predictions: pieces that begin at start points, drawn dashed with their band and a dot at the start.
    """
    figures: list[Figure] = []
    above: list[list[int]] = []
    grouped = {name for _, _, names in _GROUPS for name in names}
    rest = tuple(name for name in channels if name not in grouped)
    for group, title, names in (*_GROUPS, ("other", "Other channels", rest)):
        present = [name for name in names if name in channels]
        if not present:
            continue
        rows = inputs_of(group, input_names)
        rows = [] if rows in above else rows  # the figure before has them
        above.append(rows)
        traces = _input_traces(inputs, input_names, rows)
        for i, name in enumerate(present, start=2 if rows else 1):
            axis = "" if i == 1 else str(i)
            traces += _channel_traces(channels[name], name, axis=axis)
            traces += _prediction_traces((predictions or {}).get(name, ()), name, axis=axis)
        titles = [axis_title(name) for name in present]
        layout = stacked([inputs_title([input_names[row] for row in rows]), *titles] if rows else titles, height=PANEL)
        figures.append(
            Figure(
                identifier=f"{identifier}-{group}",
                spec={"data": traces, "layout": layout},
                caption=f"{title}, {source}. {'Inputs on top; a' if rows else 'A'}ll panels zoom in time together.",
                alt=f"{title} of {source} against time: {', '.join(present)}, {flight_words} and {model_words}"
                + (f", under the commands {', '.join(input_names[row] for row in rows)}." if rows else "."),
                keys=(
                    Key(flight_words, FLIGHT),
                    Key(model_words, MODEL, "dash"),
                    Key("±2σ that the model promises", BAND, "band"),
                    *(Key(input_names[row], INPUT_COLORS[k % 4]) for k, row in enumerate(rows)),
                ),
            )
        )
    return tuple(figures)


def _input_traces(
    inputs: Sequence[tuple[Array, Array]], names: Sequence[str], rows: Sequence[int]
) -> list[dict[str, object]]:
    traces = []
    for k, row in enumerate(rows):
        time, values = joined([(time, commands[:, row]) for time, commands in inputs])
        places = kept(values)
        traces.append(line(time[places], values[places], name=names[row], color=INPUT_COLORS[k % 4]))
    return traces


def _channel_traces(pieces: Sequence[Series], name: str, *, axis: str) -> list[dict[str, object]]:
    traces: list[dict[str, object]] = []
    modelled = [(p.time, shown(name, p.model)) for p in pieces if p.model is not None]
    promised = [
        (p.time, shown(name, p.model), shown(name, p.sigma))
        for p in pieces
        if p.model is not None and p.sigma is not None
    ]
    if promised:
        traces.append(_band(promised, axis=axis))
    time, values = joined([(p.time, shown(name, p.flight)) for p in pieces])
    places = kept(values)
    traces.append(
        line(time[places], values[places], name=f"{name}, flight", color=FLIGHT, axis=axis, hover=_hover(name))
    )
    if modelled:
        time, values = joined(modelled)
        places = kept(values)
        traces.append(
            line(
                time[places],
                values[places],
                name=f"{name}, model",
                color=MODEL,
                dash="dash",
                axis=axis,
                hover=_hover(f"{name}, model"),
            )
        )
    return traces


def _prediction_traces(pieces: Sequence[Prediction], name: str, *, axis: str) -> list[dict[str, object]]:
    if not pieces:
        return []
    drawn = [(p.time, shown(name, p.model), shown(name, p.sigma)) for p in pieces]
    time, values = joined([(t, m) for t, m, _ in drawn])
    places = kept(values)
    label = f"{name}, predicted"
    starts = [t[0] for t, _, _ in drawn], [m[0] for _, m, _ in drawn]
    marked = dots(*starts, {"size": 6, "color": MODEL}, name="start", axis=axis)
    return [
        _band(drawn, axis=axis),
        line(
            time[places],
            values[places],
            name=label,
            color=MODEL,
            dash="dash",
            width=1.8,
            axis=axis,
            hover=_hover(label),
        ),
        {**marked, "hoverinfo": "skip", "hovertemplate": None},
    ]


def _hover(name: str) -> str:
    unit = unit_words(channel(name.split(",")[0]).shown_unit)
    return f"{name}<br>%{{x:.2f}} s, %{{y:.4g}} {unit}".rstrip()


def _band(pieces: Sequence[tuple[Array, Array, Array]], *, axis: str) -> dict[str, object]:
    """The region model +-2 sigma, a closed shape per piece."""
    runs = [run for piece in pieces for run in _unbroken(*piece)]
    limit = max(8, MAX_POINTS // (2 * max(1, len(runs))) - 1)
    xs: list[float | None] = []
    ys: list[float | None] = []
    for time, values, sigma in runs:
        places = kept(values, limit=limit)
        spread = 2.0 * sigma[places]
        xs += [*numbers(time[places]), *numbers(time[places][::-1]), None]
        ys += [*numbers(values[places] + spread), *numbers((values[places] - spread)[::-1]), None]
    return shade(xs, ys, name="±2σ", color=BAND, axis=axis)


def _unbroken(time: Array, values: Array, sigma: Array) -> list[tuple[Array, Array, Array]]:
    """The runs of finite values, each with its own closed band: a gap inside a shape would fill it wrongly."""
    wide = np.broadcast_to(sigma, values.shape)
    finite = np.isfinite(values) & np.isfinite(wide)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    runs = zip(edges[::2], edges[1::2], strict=True)
    return [(time[a:b], values[a:b], wide[a:b]) for a, b in runs if b - a > 1]
