"""Estimates along a stream, as a page: each over time in its band, the last ones in a table, and where they stood."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.identification.recursive.tracked import Tracked
from swashplate.reporting.structure import Figure, Key, Points, Report, Section, Table, Text, tabulate
from swashplate.reporting.theme import BAND, MODEL, VERMILION, axis_number, line, quantity, shade, stacked

_MOST = 12
"""Stretches that are listed one by one."""
_HEIGHT = 130


def compose_tracking(
    source: str, tracks: Sequence[Tracked], notes: Sequence[str], *, simulated: bool, title: str | None
) -> Report:
    """The report's structure, a section for each equation."""
    known = sum(one.final is not None for one in tracks)
    banners = (("caution", "SIMULATED FLIGHT: no aircraft flew for these numbers."),) if simulated else ()
    missing = [one.text for one in tracks if one.final is None]
    if missing:
        banners = (("bad", f"Not separated by this stream: {'; '.join(missing)}."), *banners)
    return Report(
        title=title or f"Identification in flight: {source}",
        banners=banners,
        summary=(
            ("Estimated", f"{known} of {len(tracks)} at the end", "plain" if known == len(tracks) else "bad"),
            ("Stood still", _stood(tracks), "caution" if any(one.frozen for one in tracks) else "plain"),
        ),
        picture=None,
        sections=tuple(Section(f"equation-{k}", one.text, _blocks(one, k, source)) for k, one in enumerate(tracks))
        + ((Section("notes", "Notes", (Points(tuple(notes)),)),) if notes else ()),
    )


def _stood(tracks: Sequence[Tracked]) -> str:
    times = max((len(one.frozen) for one in tracks), default=0)
    often = "once" if times == 1 else f"{times} times"
    return f"{often}, see below" if times else "never: no gap, no value that is no number"


def _blocks(one: Tracked, k: int, source: str) -> tuple[Text | Points | Table | Figure, ...]:
    final = one.final
    rows = tuple(
        (
            name,
            "-" if final is None else f"{final.values[i]:.5g}",
            "-" if final is None else f"{final.sigmas[i]:.2g}",
            one.units[i] or "unknown",
        )
        for i, name in enumerate(one.names)
    )
    caption = f"At the end, after {one.counted:.1f} s that counted."
    note = "Standard errors count residuals that are not independent; see the how-to."
    blocks: list[Text | Points | Table | Figure] = [
        *(Text(remark, tone="caution") for remark in one.notes),
        _figure(one, k, source),
        tabulate(caption, ("unknown", "value", "standard error", "unit"), rows, note=note),
    ]
    if one.frozen:
        items = [f"{s.start:.2f} to {s.stop:.2f} s: {s.why}" for s in one.frozen[:_MOST]]
        more = len(one.frozen) - len(items)
        blocks.append(Points((*items, *([f"and {more} more"] if more else [])), "Where the estimate stood still"))
    return tuple(blocks)


def _figure(one: Tracked, k: int, source: str) -> Figure:
    layout = stacked([quantity(name, unit) for name, unit in zip(one.names, one.units, strict=True)], height=_HEIGHT)
    layout["margin"] = {**layout["margin"], "l": 78}  # converged estimates have long numbers at their axes
    traces = []
    for i, name in enumerate(one.names):
        number = axis_number(i)
        value, sigma = one.values[:, i], one.sigmas[:, i]
        known = np.isfinite(value)
        ends = (value + 2.0 * sigma)[known], (value - 2.0 * sigma)[known]
        around = np.concatenate([one.time[known], one.time[known][::-1]])
        traces.append(shade(around, np.concatenate([ends[0], ends[1][::-1]]), name="", color=BAND, axis=number))
        traces.append(line(one.time, value, name=name, color=MODEL, axis=number))
        settled = known & (one.time > one.time[0] + 0.25 * np.ptp(one.time))
        if np.any(settled):  # the first seconds' bounds would hide all the rest
            low, high = (value - 3.0 * sigma)[settled].min(), (value + 3.0 * sigma)[settled].max()
            layout[f"yaxis{number}"]["range"] = [float(low), float(high)]
    layout["shapes"] = [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": s.start,
            "x1": s.stop,
            "y0": 0,
            "y1": 1,
            "fillcolor": VERMILION,
            "opacity": 0.25,
            "line": {"width": 0},
        }
        for s in one.frozen
    ]
    keys = (Key("estimate", MODEL), Key("±2 standard errors", BAND, "band"))
    stood = (Key("stood still", VERMILION, "band"),) if one.frozen else ()
    return Figure(
        f"track-{k}",
        {"data": traces, "layout": layout},
        f"Estimates of '{one.text}' over time, {source}.",
        f"Coefficients {', '.join(one.names)} over time with two standard errors to each side.",
        keys=(*keys, *stood),
    )
