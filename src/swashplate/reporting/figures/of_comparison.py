"""Figures of models beside a flight: the lines, and the correlations of what is left."""

from __future__ import annotations

import numpy as np

from swashplate.flights.schema import channel
from swashplate.reporting.structure import Figure, Key, Section, Text, tabulate
from swashplate.reporting.theme import (
    BAND,
    BLUE,
    FLIGHT,
    GREEN,
    INPUT_COLORS,
    MODEL,
    ORANGE,
    PURPLE,
    VERMILION,
    axis_number,
    grid,
    inputs_title,
    joined,
    kept,
    line,
    numbers,
    quantity,
    shade,
    shown,
    stacked,
)
from swashplate.validation.along_inputs import ModelComparison
from swashplate.validation.residuals import Correlation, Residuals
from swashplate.validation.verification import Verification

_STYLES = ((BLUE, "dash"), (VERMILION, "dot"), (GREEN, "dashdot"), (PURPLE, "dash"), (ORANGE, "dot"))


def section_of_comparison(comparison: ModelComparison) -> Section:
    """The lines, and how close each model comes."""
    rows = tuple(
        (name, *(f"{fits[who]:.1f}" if who in fits else "-" for who in comparison.found))
        for name, fits in comparison.fits().items()
    )
    table = tabulate(
        "Fit [%]: 100 (1 - rms error / rms of the flight about its mean)", ("output", *comparison.found), rows
    )
    warnings = tuple(Text(f"{n}: {t}", tone="caution") for n, v in comparison.found.items() for t in v.warnings)
    return Section("comparison", "Models along the flight", (*warnings, _lines(comparison), table))


def _lines(comparison: ModelComparison) -> Figure:
    """Inputs, then flight and models of every output."""
    first = next(iter(comparison.found.values()))
    names = list(comparison.fits())
    units = first.units
    titles = [quantity(n, channel(n).shown_unit or units.get(n, "")) for n in names]
    layout = stacked([inputs_title(first.inputs, units), *titles], height=112)
    traces, keys = [], [Key("flight", FLIGHT)]
    for i, name in enumerate(first.inputs):
        time, values = joined([(t.time, t.inputs[:, i]) for t in first.traces])
        places, color = kept(values), INPUT_COLORS[i % len(INPUT_COLORS)]
        traces.append(line(time[places], values[places], name=name, color=color))
        keys.append(Key(name, color))
    for number, name in enumerate(names, start=2):
        measured = False
        for (who, v), (color, dash) in zip(comparison.found.items(), _STYLES * len(comparison.found), strict=False):
            if all(o.output != name for o in v.outputs):
                continue
            k = [o.output for o in v.outputs].index(name)
            rows = [("flight", FLIGHT, "solid", [(t.time, t.flight[:, k]) for t in v.traces])] if not measured else []
            rows.append((who, color, dash, [(t.time, t.model[:, k]) for t in v.traces]))
            measured = True
            for label, ink, style, pieces in rows:
                time, values = joined(pieces)
                places, values = kept(values), shown(name, values)
                traces.append(line(time[places], values[places], name=label, color=ink, dash=style, axis=str(number)))
    styled = zip(comparison.found, _STYLES * len(comparison.found), strict=False)
    keys += [Key(f"{who} ({_mean_fit(comparison.found[who]):.0f} %)", color, dash) for who, (color, dash) in styled]
    return Figure(
        "models",
        {"data": traces, "layout": layout},
        "Flight and models along the recorded inputs; in brackets the mean fit over the outputs. Biases and start "
        "states are solved for.",
        f"{', '.join(names)} of the flight and of {', '.join(comparison.found)} over time.",
        keys=tuple(keys),
    )


def _mean_fit(v: Verification) -> float:
    return float(np.mean([o.fit for o in v.outputs]))


def section_of_residuals(left: Residuals) -> Section:
    """The verdict, and the correlations with their bounds."""
    tone = "good" if left.complete else "bad"
    rows = tuple(
        (c.output, c.input, f"{c.worst[1]:+.3f}", f"{c.worst[0]:.3g}",
         f"{c.limit:.3f}")
        for c in left.cross
    )  # fmt: skip
    table = tabulate("Largest causal correlations", ("output", "input", "largest", "at [s]", "limit"), rows)
    title = f"Residuals of {left.verification.model.name}"
    cross = _correlations(
        left.cross,
        "cross-correlation",
        "Correlation of residuals with inputs; at positive lags the input comes first. Outside the band (99 % for each "
        "lag) the input explains what the model left; what is left of zero is feedback.",
    )
    auto = _correlations(
        left.auto, "autocorrelation", "Autocorrelation of the residuals; outside the band (99 % a lag) it is coloured."
    )
    return Section("residuals", title, (Text(left.headline, tone=tone), cross, auto, table))


def _correlations(correlations: tuple[Correlation, ...], identifier: str, caption: str) -> Figure:
    titles = [f"{c.output} / {c.input}" if c.input else c.output for c in correlations]
    columns = min(2, len(titles))
    layout = grid(titles, columns=columns, height=140, x_title="lag [s]", y_title="correlation [-]")
    traces = []
    for i, c in enumerate(correlations):
        number = axis_number(i)
        low, high = float(c.lags[0]), float(c.lags[-1])
        edge = [c.bound, c.bound, -c.bound, -c.bound]
        traces.append(shade([low, high, high, low], edge, name="99 %", color=BAND, axis=number))
        hover = f"{titles[i]}<br>lag %{{x:.3f}} s: %{{y:.3f}}"
        traces.append(line(numbers(c.lags), numbers(c.values), name=titles[i], color=MODEL, axis=number, hover=hover))
    return Figure(
        identifier,
        {"data": traces, "layout": layout},
        caption,
        f"{identifier} of {', '.join(titles)} over the lag.",
        keys=(Key("correlation", MODEL), Key("99 % bound of each lag", BAND, "band")),
    )
