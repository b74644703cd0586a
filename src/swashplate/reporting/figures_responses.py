"""Figures of frequency responses: Bode with coherence and error band, inputs, mismatch envelopes, verification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.flights.schema import channel
from swashplate.identification.frequency.reading_accuracy import Answers
from swashplate.identification.frequency.unnoticeable_dynamics import Mismatch, envelopes
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse, decibel, unwrapped_degrees
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
    unit_words,
)
from swashplate.validation.verification import Trace

_ERROR = "rgba(0,0,0,0.15)"
_BOUND = "rgba(0,114,178,0.18)"
_DB = 20.0 / np.log(10.0)
_COLORS = (MODEL, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)


def bode(responses: FrequencyResponse, output: str, input: str, *, model: Answers | None = None) -> Figure:
    """Magnitude, phase and coherence of one pair with +-2 random errors; a model with +-2 sigma beside it.

    Args:
        responses: measured.
        output, input: the pair.
        model: a fitted model's response.
    """
    h, coherence, error = responses.pair(output, input)
    hertz = responses.omega / TWO_PI
    gain, phase = np.asarray(decibel(h)), unwrapped_degrees(h, coherent=coherence >= 0.6)
    if model is not None:  # where the model is, the flight's count of turns is the model's
        phase = beside_model(phase, responses.omega, model.omega, unwrapped_degrees(model.response))
    spread = np.minimum(error, 3.0)
    layout = over_frequency([f"{output}/{input} [dB]", "phase [deg]", "coherence [-]"], height=140, unit="Hz")
    layout["yaxis2"] |= phase_ticks(phase)
    layout["yaxis3"]["range"] = [0, 1.02]
    known = np.isfinite(gain)
    traces: list[dict[str, Any]] = []
    up, down = 20.0 * np.log10(1.0 + 2.0 * spread), 20.0 * np.log10(np.maximum(1.0 - 2.0 * spread, 0.1))
    lag = np.degrees(2.0 * spread)
    for number, middle, above, below in (("", gain, up, down), ("2", phase, lag, -lag)):
        edges = (middle + below)[known], (middle + above)[known]
        traces.append(_band(hertz[known], *edges, color=_ERROR, name="±2ε", axis=number))
    hover = "%{x:.3g} Hz, %{y:.4g}"
    traces += [
        line(hertz, gain, name="flight", color=FLIGHT, hover=hover),
        line(hertz, phase, name="flight", color=FLIGHT, hover=hover, axis="2"),
        line(hertz, coherence, name="coherence", color=FLIGHT, hover=hover, axis="3"),
        line(hertz[[0, -1]], [0.6, 0.6], name="0.6", color=GREY, dash="dot", axis="3"),
    ]
    keys = [Key("flight", FLIGHT), Key("±2 random errors", _ERROR, "band")]
    if model is not None:
        omega, answer = model.omega, model.response
        turned = unwrapped_degrees(answer)
        wide = [(2.0 * _DB * model.gain, decibel(answer), ""), (np.degrees(2.0 * model.phase), turned, "2")]
        for half, middle, number in wide:
            if np.isfinite(half).all():
                edges = middle - half, middle + half
                traces.append(_band(omega / TWO_PI, *edges, color=_BOUND, name="±2 σ", axis=number))
        traces += [
            line(omega / TWO_PI, decibel(answer), name="model", color=MODEL, dash="dash", width=2.0, hover=hover),
            line(omega / TWO_PI, turned, name="model", color=MODEL, dash="dash", width=2.0, hover=hover, axis="2"),
        ]
        keys.insert(1, Key("model", MODEL, "dash"))
        if np.isfinite(model.gain).all():
            keys.append(Key("±2 σ of the model", _BOUND, "band"))
    band_found = responses.band(output, input)
    told = (
        "no coherent band" if band_found is None else f"coherent from {_hz(band_found[0])} to {_hz(band_found[1])} Hz"
    )
    return Figure(
        identifier=f"bode-{_plain(output)}-{_plain(input)}",
        spec={"data": traces, "layout": layout},
        height=int(layout["height"]),
        caption=f"Response of {output} to {input}: {told}. {_zero_words(responses, output, input)}Below a coherence of "
        "0.6 the response is not to be used.",
        alt=f"Bode diagram of {output} over {input} with coherence; {told}.",
        keys=tuple(keys),
    )


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


def _band(x: Array, below: Array, above: Array, *, color: str, name: str, axis: str) -> dict[str, Any]:
    """A filled band between two curves."""
    edges = np.concatenate([above, below[::-1]])
    band = line(np.concatenate([x, x[::-1]]), edges, name=name, color=color, width=0, axis=axis)
    return {**band, "fill": "toself", "fillcolor": color, "hoverinfo": "skip", "hovertemplate": None}


def _zero_words(responses: FrequencyResponse, output: str, input: str) -> str:
    """What 0 dB are."""
    if not (responses.output_units and responses.input_units):
        return ""
    o, i = responses.place(output, input)
    above, below = unit_words(responses.output_units[o]), unit_words(responses.input_units[i])
    return f"0 dB are 1 {above} for {f'1 {below}' if below else f'a {input} of 1'}. "


def _hz(omega: float) -> str:
    return f"{omega / TWO_PI:.3g}"


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name)


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
            words = f"{other} with {one}"
            values = responses.input_coherence[:, i, j]
            traces.append(line(hertz, values, name=words, color=color, dash=style, axis="2"))
            keys.append(Key(words, color, style))
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
