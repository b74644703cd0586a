"""Figures of a fit: residuals, correlation of the estimates, cost, eigenvalues."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.schema import channel
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    BAND,
    BLACK,
    GREY,
    MODEL,
    PUBLISHED,
    FigurePart,
    axis,
    axis_number,
    base_layout,
    dots,
    grid,
    joined,
    kept,
    line,
    numbers,
    shade,
    stacked,
    unit_words,
)
from swashplate.simulation.linearize import Mode

LAGS = 50
"""Samples of autocorrelation that are drawn."""


def autocorrelation(pieces: Sequence[Array], *, lags: int = LAGS) -> tuple[Array, float]:
    """Autocorrelation of residuals over lags 0 to `lags`, products pooled over the pieces, and its 95 % bound.

    The bound 1.96 / sqrt(n) holds for white noise (Klein and Morelli 2006, sec. 6.2).
    """
    lags = min(lags, max(piece.size for piece in pieces) - 1)
    sums = np.zeros(lags + 1)
    mean = float(np.mean(np.concatenate(pieces)))
    for piece in pieces:
        row = piece - mean
        for lag in range(min(lags, row.size - 1) + 1):
            sums[lag] += float(row[: row.size - lag] @ row[lag:])
    total = sum(piece.size for piece in pieces)
    return sums / max(sums[0], np.finfo(float).tiny), 1.96 / float(np.sqrt(total))


def _finely(name: str, sigma: float) -> tuple[float, str]:
    """Factor and unit in which residuals of this standard deviation are read easily: millimetres, where m are many."""
    known = channel(name)
    fine = known.shown_unit in ("m", "m/s") and sigma < 0.01
    return (1e3, f"m{known.shown_unit}") if fine else (known.shown_factor, unit_words(known.shown_unit))


def residual_time(pieces: Mapping[str, Sequence[tuple[Array, Array]]], sigma: Mapping[str, float]) -> Figure:
    """Residuals against time with the +-2 sigma that the model promises.

    Args:
        pieces: per channel, time and residual of each piece; what the cost did not count is NaN.
        sigma: promised standard deviation per channel.
    """
    names = list(pieces)
    traces: list[FigurePart] = []
    finely = {name: _finely(name, sigma[name]) for name in names}
    for i, name in enumerate(names):
        number = axis_number(i)
        factor = finely[name][0]
        time, values = joined([(t, factor * r) for t, r in pieces[name]])
        places = kept(values)
        bound = 2.0 * sigma[name] * factor
        ends = [time[0], time[-1], time[-1], time[0]]
        traces.append(shade(ends, [bound, bound, -bound, -bound], name="±2σ", color=BAND, axis=number))
        traces.append(line(time[places], values[places], name=name, color=BLACK, width=0.9, axis=number))
    layout = stacked([f"{name} [{finely[name][1]}]" for name in names], height=96)
    return Figure(
        identifier="residual-time",
        spec={"data": traces, "layout": layout},
        caption="Residuals, flight minus model. Where they leave the shaded band for long, the model misses something "
        "that its noise does not cover.",
        alt=f"Residuals of {', '.join(names)} against time with their two-sigma bands.",
        keys=(Key("flight − model", BLACK), Key("±2σ that the model promises", BAND, "band")),
    )


def residual_correlation(pieces: Mapping[str, Sequence[Array]], dt: float) -> Figure:
    """Autocorrelation of the residuals with the bound of white noise."""
    names = list(pieces)
    layout = grid(names, columns=2, height=140, x_title="lag [s]", y_title="autocorrelation [-]")
    traces: list[FigurePart] = []
    outside = {}
    for i, name in enumerate(names):
        number = axis_number(i)
        rows, bound = autocorrelation(pieces[name])
        lag = np.arange(rows.size) * dt
        outside[name] = float(np.mean(np.abs(rows[1:]) > bound))
        traces.append(shade([0, lag[-1], lag[-1], 0], [bound, bound, -bound, -bound], name="", color=BAND, axis=number))
        traces.append(
            {
                "type": "bar",
                "x": numbers(lag),
                "y": numbers(rows),
                "marker": {"color": MODEL},
                "xaxis": f"x{number}",
                "yaxis": f"y{number}",
                "hovertemplate": f"{name}<br>lag %{{x:.2f}} s: %{{y:.2f}}<extra></extra>",
            }
        )
        layout[f"yaxis{number}"]["range"] = [min(-0.4, float(rows.min()) * 1.1), 1.05]
    layout["bargap"] = 0.25
    worst = max(outside, key=lambda name: outside[name])
    return Figure(
        identifier="residual-correlation",
        spec={"data": traces, "layout": layout},
        caption="Autocorrelation of the residuals. White noise stays inside the band at 95 % of the lags; the worst "
        f"here is {worst}, with {100.0 * outside[worst]:.0f} % of its lags outside. Coloured residuals make plain "
        "bounds too small, which is why the corrected bound is the one to use.",
        alt="Autocorrelation of the residuals per channel: "
        + ", ".join(f"{name} {100.0 * share:.0f} % of lags outside the bound" for name, share in outside.items()),
        keys=(Key("autocorrelation", MODEL, "bar"), Key("95 % bound of white noise", BAND, "band")),
    )


def correlation_matrix(names: Sequence[str], correlation: Array) -> Figure:
    """Correlation of the estimates as a picture."""
    n = len(names)
    size = 140 + max(160, 34 * n)
    layout = base_layout(size, left=140, bottom=130, top=10, right=84)
    layout["xaxis"] = axis("", tickangle=-60, ticks="", tickfont={"size": 11}, showgrid=False)
    layout["yaxis"] = axis("", autorange="reversed", ticks="", tickfont={"size": 11}, showgrid=False)
    shares = np.asarray(correlation, dtype=np.float64)
    hover = [
        [f"{value:.2f}".replace("0.", ".") if i != j else "" for j, value in enumerate(row)]
        for i, row in enumerate(shares)
    ]
    strongest = _strongest(names, shares)
    heat = {
        "type": "heatmap",
        "x": list(names),
        "y": list(names),
        "z": [numbers(row) for row in shares],
        "zmin": -1,
        "zmax": 1,
        "colorscale": [[0, "#B2182B"], [0.25, "#F4A582"], [0.5, "#FFFFFF"], [0.75, "#92C5DE"], [1, "#2166AC"]],
        "text": hover,
        "texttemplate": "%{text}" if n <= 20 else "",
        "textfont": {"size": 10},
        "xgap": 1,
        "ygap": 1,
        "colorbar": {
            "title": {"text": "correlation [-]"},
            "thickness": 10,
            "tickvals": [-1, -0.5, 0, 0.5, 1],
        },
        "hovertemplate": "%{y} with %{x}: %{z:.2f}<extra></extra>",
    }
    return Figure(
        identifier="correlation",
        spec={"data": [heat], "layout": layout},
        caption=f"Correlation of the estimates. {strongest}",
        alt=f"Correlation matrix of {n} parameters. {strongest}",
        min_width=size + 40,
    )


def _strongest(names: Sequence[str], shares: Array) -> str:
    if len(names) < 2:
        return "There is only one free parameter."
    apart = np.abs(np.triu(shares, 1))
    i, j = (int(place) for place in np.unravel_index(int(np.argmax(apart)), apart.shape))
    high = int(np.sum(apart > 0.9))
    pairs = f"{high} pair{'s' if high != 1 else ''} above 0.9 in size" if high else "no pair above 0.9 in size"
    return f"Strongest: {names[i]} with {names[j]}, {shares[i, j]:+.2f}; {pairs}."


def cost_history(history: Sequence[float]) -> Figure:
    """The cost after each iteration, above the least."""
    rows = np.asarray(history, dtype=np.float64)
    layout = base_layout(220, left=84)
    layout["xaxis"] = axis("iteration [-]", rangemode="tozero", tick0=0, dtick=max(1, rows.size // 10))
    layout["yaxis"] = axis("cost [-]", nticks=5)
    trace = {
        **line(np.arange(rows.size), rows, name="cost", color=MODEL, hover="iteration %{x}: %{y:.6g}"),
        "mode": "lines+markers",
        "marker": {"size": 5},
    }
    return Figure(
        identifier="cost",
        spec={"data": [trace], "layout": layout},
        caption="Negative log-likelihood, priors included, after each iteration.",
        alt=f"Cost over {rows.size} iterations, from {rows[0]:.6g} to {rows[-1]:.6g}.",
    )


_MARKS = {"published": (PUBLISHED, "square-open", 10), "identified": (MODEL, "circle", 8)}


def eigenvalues(modes: Mapping[str, Sequence[Mode]]) -> Figure:
    """Eigenvalues at hover in the complex plane, both of each pair."""
    layout = base_layout(380, left=58)
    layout["xaxis"] = axis(
        "real part [1/s]", zeroline=True, zerolinecolor="#444", zerolinewidth=1.2, rangemode="tozero"
    )
    layout["yaxis"] = axis("imaginary part [rad/s]", zeroline=True, zerolinecolor="#bbb")
    traces, keys = [], []
    for label, group in modes.items():
        color, symbol, size = _MARKS.get(label, (GREY, "diamond", 8))
        points = [p for m in group for p in {m.eigenvalue, m.eigenvalue.conjugate()}]
        points.sort(key=lambda p: (p.real, p.imag))
        marker = {"color": color, "symbol": symbol, "size": size, "line": {"width": 2, "color": color}}
        hover = f"{label}<br>%{{x:.3f}} %{{y:+.3f}}j"
        traces.append(dots([p.real for p in points], [p.imag for p in points], marker, name=label, hover=hover))
        keys.append(Key(label, color, symbol))
    unstable = {label: sum(m.eigenvalue.real > 1e-6 for m in group) for label, group in modes.items()}
    counts = ", ".join(f"{label} {count}" for label, count in unstable.items())
    return Figure(
        identifier="eigenvalues",
        spec={"data": traces, "layout": layout},
        caption=f"Eigenvalues at hover. Right of the vertical line a motion grows (growing motions: {counts}).",
        alt=f"Eigenvalues in the complex plane for {' and '.join(modes)}; growing motions: {counts}.",
        keys=tuple(keys),
    )
