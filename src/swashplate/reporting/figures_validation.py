"""Figures of a validation: how much of the motion each predictor explains."""

from __future__ import annotations

from collections.abc import Sequence

from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    PREDICTOR_STYLE,
    PREDICTOR_WORDS,
    FigurePart,
    axis,
    axis_number,
    base_layout,
    grid,
    line,
    numbers,
)
from swashplate.reporting.words import listed
from swashplate.validation.validation import PREDICTORS, Score, Validation

JUDGED = ("phi", "theta", "psi", "p", "q", "r", "u", "v", "w", "x", "y", "z")
"""Channels in the order in which people look at them."""

_FLOOR = -60.0
"""Fit % below which a mark is drawn on the edge: beyond it, worse is just wrong."""


def _channels(validation: Validation) -> list[str]:
    present = {score.channel for score in validation.scores}
    return [name for name in JUDGED if name in present] + sorted(present - set(JUDGED))


def horizons(validation: Validation) -> list[float]:
    """The horizons that were judged [s], short ones first."""
    return sorted({score.horizon for score in validation.scores})


def middle_horizon(validation: Validation) -> float:
    """The horizon nearest to one second: about one period of a small helicopter's attitude motion."""
    return min(horizons(validation), key=lambda h: abs(h - 1.0))


def key_picture(validation: Validation) -> Figure:
    """Fit % of every predictor on every channel, one second ahead: the model's marks should lie furthest right."""
    horizon = middle_horizon(validation)
    names = [name for name in _channels(validation) if name not in ("x", "y", "z")]
    scores = {(s.channel, s.predictor): s for s in validation.scores if s.horizon == horizon}
    height = 26 * len(names) + 60
    layout = base_layout(height, left=52)
    layout["xaxis"] = axis(
        f"fit, {horizon:g} s ahead [%]", range=[_FLOOR - 4, 104], zeroline=True, zerolinecolor="#333", zerolinewidth=1.5
    )
    layout["yaxis"] = axis(
        "", type="category", categoryarray=names[::-1], categoryorder="array", range=[-0.6, len(names) - 0.4]
    )
    traces: list[FigurePart] = []
    for predictor in reversed([p for p in PREDICTORS if p != "hold"]):
        rows = [scores[name, predictor] for name in names if (name, predictor) in scores]
        color, _, symbol = PREDICTOR_STYLE[predictor]
        label = PREDICTOR_WORDS[predictor]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": numbers([max(s.fit, _FLOOR) for s in rows]),
                "y": [s.channel for s in rows],
                "customdata": numbers([s.fit for s in rows]),
                "name": label,
                "marker": {
                    "color": color,
                    "size": 12 if predictor == "model" else 10,
                    "symbol": [symbol if s.fit >= _FLOOR else "triangle-left-open" for s in rows],
                    "line": {"width": 2, "color": color},
                },
                "cliponaxis": False,
                "hovertemplate": f"%{{y}}, {label}<br>fit %{{customdata:.1f}} %<extra></extra>",
            }
        )
    best = [
        name
        for name in names
        if (name, "model") in scores
        and all(scores[name, "model"].fit > s.fit for (c, p), s in scores.items() if c == name and p != "model")
    ]
    return Figure(
        identifier="key-picture",
        spec={"data": traces, "layout": layout},
        caption=f"Prediction of {_sources(validation)}, {horizon:g} s ahead. 100 % is perfect, 0 % is as good as "
        f"holding the last value; triangles on the left edge lie below {_FLOOR:g} %. The model is best in "
        f"{len(best)} of {len(names)} channels{': ' + ', '.join(best) if best else ''}.",
        alt=f"Fit in percent at {horizon:g} s per channel: "
        + "; ".join(
            f"{name} "
            + ", ".join(f"{PREDICTOR_WORDS[p]} {scores[name, p].fit:.0f}" for p in PREDICTORS if (name, p) in scores)
            for name in names
        ),
        keys=tuple(
            [Key(PREDICTOR_WORDS[p], PREDICTOR_STYLE[p][0], PREDICTOR_STYLE[p][2]) for p in PREDICTORS if p != "hold"]
            + [Key("hold the last value (0 %)", "#333", "line")]
        ),
    )


def _sources(validation: Validation) -> str:
    return listed(dict.fromkeys(one.name or "an unnamed flight" for one in validation.data))


def fit_over_horizon(validation: Validation) -> Figure:
    """Fit % against the horizon, one small panel per channel."""
    names = _channels(validation)
    layout = grid(names, columns=3, height=118, x_title="ahead [s]", y_title="fit [%]")
    traces: list[FigurePart] = []
    for i, name in enumerate(names):
        number = axis_number(i)
        for predictor in reversed(PREDICTORS):
            rows = sorted(_of(validation.scores, name, predictor), key=lambda s: s.horizon)
            color, dash, _ = PREDICTOR_STYLE[predictor]
            traces.append(
                line(
                    [s.horizon for s in rows],
                    [s.fit for s in rows],
                    name=PREDICTOR_WORDS[predictor],
                    color=color,
                    dash=dash,
                    width=2.2 if predictor == "model" else 1.5,
                    axis=number,
                    hover=f"{name}, {PREDICTOR_WORDS[predictor]}<br>%{{x:g}} s: %{{y:.1f}} %",
                )
            )
        layout[f"yaxis{number}"].update(range=[_FLOOR, 104], tickvals=[-50, 0, 50, 100])
        layout[f"xaxis{number}"].update(range=[0, 1.05 * max(horizons(validation))])
    return Figure(
        identifier="fit-over-horizon",
        spec={"data": traces, "layout": layout},
        caption=f"Fit [%] against how far ahead the prediction looks. Lines that leave a panel below {_FLOOR:g} % "
        "are worse than useless there.",
        alt=f"Fit in percent against horizon for {', '.join(names)} and each predictor; the tables below have "
        "the numbers.",
        keys=tuple(Key(PREDICTOR_WORDS[p], PREDICTOR_STYLE[p][0], PREDICTOR_STYLE[p][1]) for p in PREDICTORS),
    )


def _of(scores: Sequence[Score], name: str, predictor: str) -> list[Score]:
    return [score for score in scores if (score.channel, score.predictor) == (name, predictor)]
