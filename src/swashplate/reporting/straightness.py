"""The paper's Fig. 10 for any model: the path on a longitudinal step with and without the decoupling."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from swashplate.control.analysis.straightness import StepRun
from swashplate.flights.schema import channel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Block, Figure, Key, Points, Report, Row, Section, Text, tabulate
from swashplate.reporting.theme import (
    CONSTANT,
    GREY,
    MODEL,
    PUBLISHED,
    FigurePart,
    axis,
    axis_number,
    axis_title,
    base_layout,
    line,
    stacked,
)
from swashplate.reporting.versions import card_hash, versions

_STYLES = {"without": (PUBLISHED, "dash"), "by the paper": (CONSTANT, "dot"), "with": (MODEL, "solid")}
_FAINT = {"without": "rgba(213,94,0,0.22)", "by the paper": "rgba(0,0,0,0.12)", "with": "rgba(0,114,178,0.22)"}
_WORDS = {
    "without": "without the decoupling",
    "by the paper": "decoupled with the rotor's own lag, as in the paper",
    "with": "with the decoupling",
}
_SHOWN = ("u", "v", "psi", "z", "phi", "theta", "servo_roll", "servo_pitch", "motor_lower", "motor_upper")
_PERCENTILES = (5.0, 50.0, 95.0)
_STRAIGHT = 0.15
"""m at the end of the step; what the law promises with the constant lag that absorbs the bar's misalignment too."""


def compose_straightness(
    vehicle: Vehicle,
    runs: Mapping[str, StepRun],
    *,
    command: float,
    lag: float,
    many: str = "",
    nearer_than: Mapping[str, tuple[int, int]] | None = None,
    title: str | None = None,
) -> Report:
    """The report's structure.

    Args:
        vehicle: what flew.
        runs: "without" and "with" the decoupling, from `step_run`; "by the paper" where the lag was chosen by flying.
        command: the step of the pitch command.
        lag: that the law takes out at hover [deg].
        many: what the many flights are, in words.
        nearer_than: on how many of the same drawn flights the law ends nearer to straight ahead, from `nearer`.
        title: heading.
    """
    bare, law = runs["without"], runs["with"]
    drift = [float(run.path.drift[0]) for run in (bare, law)]
    speeds = [float(run.path.speed[0]) for run in (bare, law)]
    turned = [_largest(run, "psi") for run in (bare, law)]
    lost = [_largest(run, "z") for run in (bare, law)]
    used = max(_largest(law, name) for name in ("servo_roll", "servo_pitch"))
    summary = [
        ("Step", f"pitch command {command:.3g} from hover; fastest {speeds[0]:.2f} m/s without the law, "
         f"{speeds[1]:.2f} m/s with it.", "plain"),
        ("Drift", f"at the end {drift[0]:+.2f} m to the right without, {drift[1]:+.2f} m with it.",
         "good" if abs(drift[1]) < _STRAIGHT else "caution"),
        ("Heading", f"held within {turned[0]:.2g}° without, {turned[1]:.2g}° with it; height within "
         f"{100 * lost[0]:.2g} and {100 * lost[1]:.2g} cm.", "plain"),
        ("Inputs", f"largest servo command with the law {used:.2f} of 1.", "caution" if used >= 0.999 else "good"),
        ("Models", *_models(runs, many)),
        *(("Against", *_against(name, *counts)) for name, counts in (nearer_than or {}).items())
    ]  # fmt: skip
    return Report(
        title=title or f"{vehicle.name}: the path on a step of the pitch command",
        banners=(("caution", "SIMULATED FLIGHT: no aircraft flew for these numbers."),),
        summary=tuple(summary),
        picture=_path_figure(runs, many),
        sections=(_numbers(runs, lag), _time(runs), _provenance(vehicle)),
    )


def _largest(run: StepRun, name: str) -> float:
    """Largest change from the start, in the unit that people expect."""
    values = run.flight.values(name) * channel(name).shown_factor
    return float(np.max(np.abs(values - values[0] if name in ("z", "psi") else values)))


def _models(runs: Mapping[str, StepRun], many: str) -> tuple[str, str]:
    drawn = {name: run.drawn for name, run in runs.items() if run.drawn is not None}
    if not drawn:
        return "flown on the model that the law was made from, where it must work; see --fit.", "caution"
    lines = []
    for name, paths in drawn.items():
        low, middle, high = np.nanpercentile(paths.drift, _PERCENTILES)
        lines.append(f"{name} {middle:+.2f} m ({low:+.2f} to {high:+.2f} m)")
    size = len(next(iter(drawn.values())).drift)
    return f"{size} {many}; drift, median (5 to 95 %): {'; '.join(lines)}.", "plain"


def _against(name: str, wins: int, of: int) -> tuple[str, str]:
    """Good where the law wins by two standard deviations of a tossed coin."""
    ahead = wins - 0.5 * of > math.sqrt(of)
    verdict = "" if ahead else " No more than chance: on these flights the law is not shown to be better."
    text = f"on {wins} of {of} flights the law ends nearer to straight ahead than {_WORDS[name]}.{verdict}"
    return text, "good" if ahead else "caution"


def _path_figure(runs: Mapping[str, StepRun], many: str) -> Figure:
    layout = base_layout(380)
    layout["xaxis"] = axis("ahead [m]")
    layout["yaxis"] = axis("to the right [m]", autorange="reversed", zeroline=True, zerolinecolor=GREY)
    traces: list[FigurePart] = []
    keys = []
    hover = "%{x:.2f} m ahead, %{y:+.2f} m right"
    for name, run in runs.items():
        for x, y in run.tracks:
            every = max(1, x.size // 60)
            thin = line(x[::every], y[::every], name="drawn", color=_FAINT[name], width=0.8)
            traces.append({**thin, "hoverinfo": "skip", "hovertemplate": None})
    for name, run in runs.items():
        color, dash = _STYLES[name]
        x, y = run.flight.values("x"), run.flight.values("y")
        label = _WORDS[name]
        traces.append(line(x, y, name=label, color=color, dash=dash, width=2.4, hover=f"{label}<br>{hover}"))
        keys.append(Key(label, color, dash))
    if any(run.tracks for run in runs.values()):
        keys.append(Key(f"thin: {many}", GREY))
    return Figure(
        identifier="key-picture",
        spec={"data": traces, "layout": layout},
        caption="Seen from above, from hover at 0 m until the distance is covered; right is down (as in Fig. 10).",
        alt="Path of the step with and without the decoupling.",
        keys=tuple(keys),
    )


def _numbers(runs: Mapping[str, StepRun], lag: float) -> Section:
    rows = []
    for name, run in runs.items():
        of_model = [float(getattr(run.path, key)[0]) for key in ("drift", "leftmost", "rightmost", "speed", "time")]
        rows.append(_row(name, "this one", of_model))
        if run.drawn is not None:
            for percent in _PERCENTILES:
                values = [
                    float(np.nanpercentile(getattr(run.drawn, key), percent))
                    for key in ("drift", "leftmost", "rightmost", "speed", "time")
                ]
                arrived = int(np.sum(np.isfinite(run.drawn.drift)))
                rows.append(_row(name, f"{percent:g} % of {arrived} that arrived", values))
    columns = ("decoupling", "models", "drift [m]", "leftmost [m]", "rightmost [m]", "fastest [m/s]", "time [s]")
    blocks: list[Block] = [
        tabulate("The path", columns, rows, note="Offsets to the right of the first heading."),
        Text(
            f"The law turns the commands back by a lag of {lag:.1f}° at hover and cancels what speed does to the lower "
            "rotor's disc. The stabilizer bar and the delays are not in its equations. With the rotor's own lag "
            "they bend the path; a lag that was chosen in flights of the model allows for them."
        ),
    ]
    return Section("path", "The path in numbers", tuple(blocks))


def _row(name: str, models: str, values: list[float]) -> Row:
    shown = [f"{v:+.2f}" if math.isfinite(v) else "–" for v in values[:3]] + [f"{v:.2f}" for v in values[3:]]
    return (name, models, *shown)


def _time(runs: Mapping[str, StepRun]) -> Section:
    present = [name for name in _SHOWN if all(name in run.flight for run in runs.values())]
    layout = stacked(["z [cm]" if name == "z" else axis_title(name) for name in present], height=105)
    traces, keys = [], []
    for kind, run in runs.items():
        color, dash = _STYLES[kind]
        keys.append(Key(_WORDS[kind], color, dash))
        for i, name in enumerate(present):
            number = axis_number(i)
            values = run.flight.values(name) * (100.0 if name == "z" else channel(name).shown_factor)
            traces.append(line(run.flight.time(name), values, name=name, color=color, dash=dash, axis=number))
    figure = Figure(
        identifier="step-time",
        spec={"data": traces, "layout": layout},
        caption="Speeds, heading, height (down positive), lean and inputs; all panels zoom in time together.",
        alt=f"{', '.join(present)} against time, with and without the decoupling.",
        keys=tuple(keys),
    )
    return Section("time", "What do heading, height and inputs do?", (figure,), folded=True)


def _provenance(vehicle: Vehicle) -> Section:
    lines = [f"{name} {version}" for name, version in versions().items()]
    lines.append(f"card of {vehicle.name}, SHA-256 {card_hash(vehicle.card)}")
    return Section("made-with", "How was this made?", (Points(tuple(lines)),), folded=True)
