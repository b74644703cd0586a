"""Figures of frequency responses: Bode with coherence and error band, inputs, steps, verification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.flights.schema import channel
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    FLIGHT,
    INPUT_COLORS,
    MODEL,
    PUBLISHED,
    axis_title,
    inputs_title,
    kept,
    line,
    over_frequency,
    shown,
    stacked,
    style,
)
from swashplate.validation.verification import Trace


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
    number = 0
    for i, one in enumerate(responses.inputs):
        for j, other in enumerate(responses.inputs[:i]):
            color, dash = style(number)
            label = f"{other} with {one}"
            values = responses.input_coherence[:, i, j]
            traces.append(line(hertz, values, name=label, color=color, dash=dash, axis="2"))
            keys.append(Key(label, color, dash))
            number += 1
    return Figure(
        identifier="input-spectra",
        spec={"data": traces, "layout": layout},
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
        caption=f"{suggestion.axis}: the rate after a sudden step of its demand, and after a step of 0.1 of the "
        "command, on the model at 400 Hz." + (f" Unstable: {', '.join(wild)}." if wild else ""),
        alt="Time histories of the rate with the suggested and the flown gains.",
        keys=(*(keys[which] for which in answers), Key("demand", PUBLISHED, "dot")),
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
        caption=f"{trace.source}: flight and model along the recorded inputs, biases and shifts solved for.",
        alt=f"{', '.join(channel(n).name for n in outputs)} of flight and model over time.",
        keys=tuple(keys),
    )
