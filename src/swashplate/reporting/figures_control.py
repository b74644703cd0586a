"""Figures of a controller's check: loops, sensitivities, attitude responses and steps."""

from __future__ import annotations

import numpy as np

from swashplate.control.analysis.check import ControlCheck
from swashplate.flights.schema import channel
from swashplate.reporting.structure import Figure, Key
from swashplate.reporting.theme import (
    GREY,
    MODEL,
    PUBLISHED,
    VERMILION,
    axis,
    axis_number,
    axis_title,
    base_layout,
    dots,
    grid,
    line,
    over_frequency,
    style,
)

ATTITUDE_WORDS = {"phi": "roll", "theta": "pitch", "psi": "yaw"}


def loops_figure(check: ControlCheck) -> Figure:
    """Every loop opened at its input, the others closed: gain and phase."""
    layout = over_frequency(["gain [dB]", "phase [deg]"])
    layout["yaxis2"] |= {"tick0": 0, "dtick": 90}
    traces, keys = [], []
    m = len(check.vehicle.input_names)
    inverse = np.linalg.inv(np.eye(m) + check.opened)
    for i, name in enumerate(check.vehicle.input_names):
        single = 1.0 / inverse[:, i, i] - 1.0
        if np.max(np.abs(single)) < 1e-9:
            continue
        color, dash = style(i)
        hover = f"{name}<br>%{{x:.3g}} rad/s, %{{y:.3g}}"
        gain, phase = 20.0 * np.log10(np.abs(single)), np.degrees(np.unwrap(np.angle(single)))
        phase -= 360.0 * np.round(np.median(phase + 180.0) / 360.0)
        traces += [
            line(check.omega, gain, name=name, color=color, dash=dash, hover=hover),
            line(check.omega, phase, name=name, color=color, dash=dash, hover=hover, axis="2"),
        ]
        keys.append(Key(name, color, dash))
    ends = check.omega[[0, -1]]
    traces.append(line(ends, [0.0, 0.0], name="0 dB", color=GREY, width=1.0, hover="0 dB"))
    traces.append(line(ends, [-180.0, -180.0], name="-180", color=GREY, width=1.0, hover="-180 deg", axis="2"))
    return Figure(
        identifier="loops-bode",
        spec={"data": traces, "layout": layout},
        caption="One loop opened at its input, the others closed. The margins are read where the gain is 0 dB and "
        "where the phase is -180 degrees.",
        alt="Bode diagram of each broken loop.",
        keys=tuple(keys),
    )


def rejection_figure(check: ControlCheck) -> Figure:
    """What is left of a disturbance on each state that is held."""
    layout = over_frequency(["|S| [dB]"], height=280)
    layout["yaxis"]["range"] = [-40, 12]
    traces, keys = [], []
    for i, r in enumerate(check.rejections):
        color, dash = style(i)
        hover = f"{r.state}<br>%{{x:.3g}} rad/s, %{{y:.2f}} dB"
        traces.append(line(r.omega, 20.0 * np.log10(r.size), name=r.state, color=color, dash=dash, hover=hover))
        keys.append(Key(r.state, color, dash))
    ends = check.rejections[0].omega[[0, -1]]
    for level, label in ((-3.0, "-3 dB: bandwidth"), (5.0, "5 dB: Level 1 peak")):
        traces.append(line(ends, [level, level], name=label, color=GREY, dash="dot", hover=label))
    keys.append(Key("-3 dB (bandwidth) and 5 dB (peak)", GREY, "dot"))
    return Figure(
        identifier="rejection-curves",
        spec={"data": traces, "layout": layout},
        caption="What the closed loop leaves of a disturbance added to a measured state. Far below 0 dB it is "
        "rejected, above 0 dB the loop makes it larger.",
        alt="Sensitivity of each held state over frequency.",
        keys=tuple(keys),
    )


def attitude_figure(check: ControlCheck) -> Figure:
    """Responses of the attitudes to the pilot's commands, with the bandwidths."""
    layout = over_frequency(["gain [dB]", "phase [deg]"])
    layout["yaxis2"] |= {"tick0": 0, "dtick": 90}
    traces, keys = [], []
    for i, a in enumerate(check.attitudes):
        color, dash = style(i)
        gain, phase = 20.0 * np.log10(np.abs(a.response)), np.degrees(np.unwrap(np.angle(a.response)))
        if a.handling:
            at = a.handling.omega_180.value
            phase -= 360.0 * np.round((np.interp(at, a.omega, phase) + 180.0) / 360.0)
        hover = f"{a.state} of {a.reference}<br>%{{x:.3g}} rad/s, %{{y:.3g}}"
        name = f"{a.state} of {a.reference}"
        traces += [
            line(a.omega, gain, name=name, color=color, dash=dash, hover=hover),
            line(a.omega, phase, name=name, color=color, dash=dash, hover=hover, axis="2"),
        ]
        keys.append(Key(name, color, dash))
        if a.handling and np.isfinite(a.handling.bandwidth.value):
            bandwidth = a.handling.bandwidth.value
            lag = float(np.interp(bandwidth, a.omega, phase))
            marker = {"color": color, "size": 9, "symbol": "circle"}
            hover = f"bandwidth {a.state}<br>%{{x:.3g}} rad/s"
            traces.append(dots([bandwidth], [lag], marker, name="bandwidth", hover=hover, axis="2"))
    keys.append(Key("bandwidth", GREY, "circle"))
    for level in (-135.0, -180.0):
        ends = check.omega[[0, -1]]
        traces.append(line(ends, [level] * 2, name="", color=GREY, dash="dot", hover=f"{level:g} deg", axis="2"))
    return Figure(
        identifier="attitude-bode",
        spec={"data": traces, "layout": layout},
        caption="Attitude over the pilot's command, all loops closed; -135 and -180 degrees are dotted.",
        alt="Bode diagram of the attitude responses with their bandwidths.",
        keys=tuple(keys),
    )


def steps_figure(check: ControlCheck) -> Figure:
    """Every step, the wanted value dotted."""
    titles = [f"{s.reference}: {axis_title(s.state)}" for s in check.steps]
    layout = grid(titles, columns=2, height=190, x_title="time [s]")
    traces = []
    for i, s in enumerate(check.steps):
        number = axis_number(i)
        factor = channel(s.state).shown_factor
        t, values = s.flight.time(s.state), s.flight.values(s.state) * factor
        every = max(1, t.size // 1500)
        traces.append(line(t[::every], values[::every], name=s.state, color=MODEL, axis=number))
        if s.reference not in ("roll", "pitch"):
            goal = (values[0] + s.size * factor,) * 2
            traces.append(line(t[[0, -1]], goal, name="wanted", color=PUBLISHED, dash="dot", axis=number))
    return Figure(
        identifier="step-responses",
        spec={"data": traces, "layout": layout},
        caption="Steps flown on the nonlinear vehicle, half a second after the start. Roll and pitch are a pilot's "
        "step of a tenth of the stick, which outer loops cancel where they hold speed or place.",
        alt="Time histories of the responses to steps.",
        keys=(Key("response", MODEL), Key("wanted", PUBLISHED, "dot")),
    )


def modes_figure(check: ControlCheck) -> Figure:
    """The closed loop's modes."""
    layout = base_layout(300)
    layout["xaxis"], layout["yaxis"] = axis("real part [1/s]", zeroline=True), axis("imaginary part [rad/s]")
    bad = [complex(m) for m in check.modes if m.real > 1e-6]
    good = [complex(m) for m in check.modes if m.real <= 1e-6]
    traces = [
        dots(
            [m.real for m in group],
            [m.imag for m in group],
            {"color": color, "symbol": "x", "size": 8},
            name=label,
            hover="%{x:.3g} %{y:+.3g}j 1/s",
        )
        for group, label, color in ((good, "dies out", MODEL), (bad, "grows", VERMILION))
        if group
    ]
    return Figure(
        identifier="modes-plane",
        spec={"data": traces, "layout": layout},
        caption="Modes of the closed loop including the controller's sampling.",
        alt=f"{len(check.modes)} modes in the complex plane, {len(bad)} of them growing.",
        keys=(Key("dies out", MODEL, "x"), *((Key("grows", VERMILION, "x"),) if bad else ())),
    )
