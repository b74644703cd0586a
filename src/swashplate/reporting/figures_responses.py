"""Figures of frequency responses: Bode with coherence and error band, inputs, mismatch envelopes, verification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.flights.schema import channel
from swashplate.identification.frequency.unnoticeable_dynamics import Mismatch, envelopes
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.reporting.downsample import kept
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    BAND,
    BLACK,
    FLIGHT,
    GREEN,
    GREY,
    INPUT_COLORS,
    MODEL,
    ORANGE,
    PUBLISHED,
    PURPLE,
    SKY,
    VERMILION,
    axis_title,
    inputs_title,
    line,
    over_frequency,
    phase_ticks,
    shown,
    stacked,
)
from swashplate.validation.verification import Trace

_ERROR = "rgba(0,0,0,0.15)"
_BOUND = "rgba(0,114,178,0.18)"
_DB = 20.0 / np.log(10.0)
_COLORS = (MODEL, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)


def excitation(responses: FrequencyResponse) -> Figure:
    """Spectra of the inputs, and how far they moved together."""
    hertz = responses.omega / TWO_PI
    several = len(responses.inputs) > 1
    layout = over_frequency(["input power [dB]", "coherence [-]"][: 2 if several else 1], height=150, unit="Hz")
    if several:
        layout["yaxis2"]["range"] = [0, 1.02]
    traces, keys = [], []
    for i, name in enumerate(responses.inputs):
        color = INPUT_COLORS[i % len(INPUT_COLORS)]
        power = 10.0 * np.log10(np.maximum(responses.input_power[:, i], 1e-30))
        traces.append(line(hertz, power, name=name, color=color, hover=f"{name}<br>%{{x:.3g}} Hz, %{{y:.1f}} dB"))
        keys.append(Key(name, color))
    styles = ("solid", "dash", "dot", "dashdot")
    number = 0
    for i, one in enumerate(responses.inputs):
        for j, other in enumerate(responses.inputs[:i]):
            style, color = styles[number % 4], _COLORS[number % len(_COLORS)]
            label = f"{other} with {one}"
            values = responses.input_coherence[:, i, j]
            traces.append(line(hertz, values, name=label, color=color, dash=style, axis="2"))
            keys.append(Key(label, color, style))
            number += 1
    return Figure(
        identifier="input-spectra",
        spec={"data": traces, "layout": layout},
        height=int(layout["height"]),
        caption="What was excited (power density of each input, its unit²/Hz in dB)"
        + (
            ", and the coherence between inputs: above 0.5 the pilot or a loop mixed them, and only the conditioned "
            "responses can tell their effects apart."
            if several
            else "."
        ),
        alt=f"Input spectra of {', '.join(responses.inputs)}"
        + (" and the coherence between them." if several else "."),
        keys=tuple(keys),
    )


def rate_steps_figure(suggestion: Suggestion) -> Figure | None:
    """The rate after a step of its demand, and after a disturbance of the command, with both sets of gains."""
    answers = suggestion.steps()
    if not answers:
        return None
    layout = stacked(["rate / demand [1]", "disturbed rate [deg/s]"], height=150)
    keys = {"suggested": Key("suggested", MODEL), "flown": Key("flown", FLIGHT, "dash")}
    styles = {"suggested": "solid", "flown": "dash"}
    traces = []
    for which, answer in answers.items():
        key = keys[which]
        both = (answer.step, np.degrees(answer.disturbance))
        traces += [
            line(
                answer.time,
                values,
                name=which,
                color=key.color,
                dash=styles[which],
                axis=number,
            )
            for number, values in zip(("", "2"), both, strict=True)
        ]
    ends = next(iter(answers.values())).time[[0, -1]]
    traces.append(line(ends, [1.0, 1.0], name="demand", color=PUBLISHED, dash="dot"))
    wild = [which for which, answer in answers.items() if not answer.stable]
    return Figure(
        identifier=f"rate-steps-{suggestion.axis.lower()}",
        spec={"data": traces, "layout": layout},
        height=int(layout["height"]),
        caption=f"{suggestion.axis}: the rate after a sudden step of its demand, and after a step of 0.1 of the "
        "command, on the model at 400 Hz." + (f" Unstable: {', '.join(wild)}." if wild else ""),
        alt="Time histories of the rate with the suggested and the flown gains.",
        keys=(*(keys[which] for which in answers), Key("demand", PUBLISHED, "dot")),
    )


def mismatch_figure(misses: Sequence[Mismatch]) -> Figure:
    """Model over flight of every fitted response inside the envelopes of unnoticeable added dynamics."""
    low = min(m.target.omega[0] for m in misses)
    high = max(m.target.omega[-1] for m in misses)
    omega = np.geomspace(low, high, 80)
    bound = envelopes(omega)
    layout = over_frequency(["model/flight [dB]", "model/flight [deg]"], height=170, unit="Hz")
    layout["yaxis"]["range"], layout["yaxis2"]["range"] = [-15, 15], [-120, 120]
    layout["yaxis2"] |= phase_ticks([-90.0, 90.0])
    both = np.concatenate([omega, omega[::-1]]) / TWO_PI
    traces, keys = [], [Key("not noticed by a pilot", BAND, "band")]
    for number, kind in (("", "gain"), ("2", "phase")):
        edge = np.concatenate([bound[f"{kind}_high"], bound[f"{kind}_low"][::-1]])
        band = line(both, edge, name="envelope", color=BAND, width=0, axis=number)
        traces.append({**band, "fill": "toself", "fillcolor": BAND, "hoverinfo": "skip", "hovertemplate": None})
    for k, m in enumerate(misses):
        color, style = _COLORS[k % len(_COLORS)], ("solid", "dash", "dot")[(k // len(_COLORS)) % 3]
        hertz = m.target.omega / TWO_PI
        hover = f"{m.target.name}<br>%{{x:.3g}} Hz, %{{y:.3g}}"
        traces.append(line(hertz, m.gain, name=m.target.name, color=color, dash=style, hover=hover))
        traces.append(line(hertz, m.phase, name=m.target.name, color=color, dash=style, hover=hover, axis="2"))
        keys.append(Key(m.target.name, color, style))
    inside = float(np.mean([m.inside for m in misses]))
    return Figure(
        identifier="mismatch",
        spec={"data": traces, "layout": layout},
        height=int(layout["height"]),
        caption=f"Mismatch, model over flight: {100 * inside:.0f} % of the points lie inside the envelopes of maximum "
        "unnoticeable added dynamics (after MIL-HDBK-1797; coefficients as a second program has them, not verified "
        "against its text; found for the pitch of fighters: a measure, not a requirement).",
        alt=f"Mismatch of {len(misses)} responses in gain and phase; {100 * inside:.0f} % inside the envelopes.",
        keys=tuple(keys),
    )


def verification_figure(
    trace: Trace,
    outputs: Sequence[str],
    inputs: Sequence[str],
    *,
    number: int,
    units: Mapping[str, str] | None = None,
    rival: tuple[str, Trace, Sequence[str]] | None = None,
) -> Figure:
    """Inputs, then flight and model of every output over time, as in Figs 6 to 9 of Bhandari et al. (2005).

    Args:
        trace: flight and model. outputs, inputs: their columns.
        number: of the figure. units: of the inputs, by name.
        rival: another model's name, its trace of the same stretch and its outputs.
    """
    titles = [inputs_title(inputs, units), *(axis_title(name) for name in outputs)]
    layout = stacked(titles, height=104)
    places = kept(trace.flight[:, 0])
    time = trace.time[places]
    traces, keys = [], [Key("flight", FLIGHT), Key("model", MODEL, "dash")]
    for i, name in enumerate(inputs):
        color = INPUT_COLORS[i % len(INPUT_COLORS)]
        traces.append(line(time, trace.inputs[places, i], name=name, color=color))
        keys.append(Key(name, color))
    for k, name in enumerate(outputs):
        axis = str(k + 2)
        traces.append(line(time, shown(name, trace.flight[places, k]), name="flight", color=FLIGHT, axis=axis))
        model = shown(name, trace.model[places, k])
        traces.append(line(time, model, name="model", color=MODEL, dash="dash", axis=axis))
        if rival is not None and name in rival[2]:
            other = shown(name, rival[1].model[places, rival[2].index(name)])
            traces.append(line(time, other, name=rival[0], color=PUBLISHED, dash="dot", axis=axis))
    if rival is not None:
        keys.append(Key(rival[0], PUBLISHED, "dot"))
    return Figure(
        identifier=f"verification-{number}",
        spec={"data": traces, "layout": layout},
        height=int(layout["height"]),
        caption=f"{trace.source}: flight and model along the recorded inputs, biases and shifts solved for.",
        alt=f"{', '.join(channel(n).name for n in outputs)} of flight and model over time.",
        keys=tuple(keys),
    )
