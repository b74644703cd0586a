"""A page about one height-velocity diagram."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.reporting.structure import Figure, Key, Points, Report, Section
from swashplate.reporting.theme import GREY, VERMILION, axis, base_layout, line
from swashplate.reporting.versions import date, versions
from swashplate.simulation.height_velocity import HeightVelocity

_AVOID = "rgba(213,94,0,0.35)"


def compose_height_velocity(diagram: HeightVelocity, *, title: str | None = None) -> Report:
    """The page's structure: the diagram, its numbers and what it stands on."""
    heading = title or f"Height-velocity diagram of {diagram.vehicle.card.title}"
    return Report(
        title=heading,
        banners=(),
        summary=(
            ("Hover", hover_words(diagram), "plain"),
            ("Where to trust it", diagram.vehicle.card.trust or "the card does not say", "plain"),
        ),
        picture=None,
        sections=(section_of_height_velocity(diagram),),
        made=f"swashplate {versions()['swashplate']}, {date()}",
    )


def hover_words(diagram: HeightVelocity) -> str:
    """The heights that a hover avoids, in words."""
    spans = ", ".join(f"{low:.2g} to {high:.3g} m" for low, high in diagram.hover_to_avoid)
    return f"an engine failure cannot be landed from {spans}" if spans else "an engine failure can always be landed"


def section_of_height_velocity(diagram: HeightVelocity) -> Section:
    """The diagram and its assumptions."""
    return Section(
        "engine-failure",
        "Where an engine failure cannot be landed",
        (_diagram(diagram), Points(diagram.assumptions, title="What this assumes")),
    )


def _edges(at: Array) -> Array:
    """Borders of cells round points that ascend."""
    middle = 0.5 * (at[1:] + at[:-1])
    return np.concatenate([[at[0]], middle, [at[-1]]])


def _diagram(diagram: HeightVelocity) -> Figure:
    v, h = _edges(diagram.speeds), np.exp(_edges(np.log(diagram.heights)))
    x: list[float | None] = []
    y: list[float | None] = []
    for i, k in zip(*np.nonzero(~diagram.safe), strict=True):
        low, high, left, right = h[i], h[i + 1], v[k], v[k + 1]
        x += [left, right, right, left, left, None]
        y += [low, low, high, high, low, None]
    avoid = line(x, y, name="avoid", color=VERMILION, width=0.0)
    traces = [avoid | {"fill": "toself", "fillcolor": _AVOID, "hoverinfo": "skip", "hovertemplate": None}]
    for edges in diagram.hover_to_avoid:
        for height in edges:
            told = f"hover: {height:.3g} m"
            traces.append(
                line([v[0], v[-1]], [height] * 2, name="hover", color=GREY, dash="dash", width=1.0, hover=told)
            )
    layout = base_layout(420) | {
        "xaxis": axis("speed [m/s]", range=[float(v[0]), float(v[-1])]),
        "yaxis": axis("height [m]", type="log", range=[float(np.log10(h[0])), float(np.log10(h[-1]))]),
    }
    return Figure(
        "height-velocity",
        {"data": traces, "layout": layout},
        420,
        f"From the coloured heights and speeds no way to land that was tried ended within the limits, with a pilot who "
        f"acts {diagram.delay:g} s after the engine has stopped. Dashed: the ends of what a hover avoids.",
        f"Height over speed; {hover_words(diagram)}.",
        (Key("avoid", VERMILION, "band"), Key("hover heights", GREY, "dash")),
    )
