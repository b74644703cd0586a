"""What the results of single verbs show of themselves: gains, maneuvers, spectra, sensors' errors, steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.maneuver_design import sampled
from swashplate.flights.schema import channel
from swashplate.flights.spectrum import Harmonics, Spectrogram, Spectrum
from swashplate.reporting.figures.of_flight import of_spectra, of_spectrograms, over_time
from swashplate.reporting.structure import Figure, Key, Report, Section, Table, Text, tabulate
from swashplate.reporting.theme import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    FigurePart,
    axis,
    axis_number,
    base_layout,
    dots,
    line,
    stacked,
    unit_words,
)

if TYPE_CHECKING:
    from swashplate.control.analysis.cascade_gains import LoopWorth
    from swashplate.control.analysis.rate_loop_steps import RateSteps
    from swashplate.flights.conditioning.reconstruction import Reconstruction
    from swashplate.flights.maneuvers.planned import PlannedManeuver
    from swashplate.flights.maneuvers.series import Maneuver
    from swashplate.identification.time.equation_error import EquationError


from swashplate.reporting.figures_fit import eigenvalues
from swashplate.reporting.speed_page import by_contributor, controls
from swashplate.reporting.structure import Block
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim_curve import TrimCurve

_ROW = 26
"""Height of one estimate [px]."""
_BOUNDS = 2.0
"""Standard errors on each side."""


def _table(caption: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    return tabulate(caption, head, rows)


# ---- numbers with bounds ---------------------------------------------------------------------------------------
def _estimates(panels: Mapping[str, Mapping[str, tuple[float, float]]], caption: str) -> Figure:
    """Values with two standard errors, a panel a unit.

    Args:
        panels: value and standard error by name, by the title of the panel's axis.
    """
    count = max(1, sum(map(len, panels.values())))
    gap = 64 / (_ROW * count + 64 * len(panels))
    layout = base_layout(_ROW * count + 64 * len(panels) + 20, left=110)
    traces, top = [], 1.0
    for i, (title, values) in enumerate(panels.items()):
        number = axis_number(i)
        low = max(0.0, top - (1.0 - gap * len(panels)) * len(values) / count)
        for place, (value, sigma) in enumerate(values.values()):
            ends = [value - _BOUNDS * sigma, value + _BOUNDS * sigma]
            color = BLUE if abs(value) > _BOUNDS * sigma else GREY
            traces.append(line(ends, [place, place], name=title, color=color, axis=number))
            traces.append(dots([value], [place], {"color": color, "size": 7}, name=title, axis=number))
        traces.append(line([0.0, 0.0], [-0.5, len(values) - 0.5], name="zero", color=BLACK, width=0.8, axis=number))
        ticks = {"tickvals": list(range(len(values))), "ticktext": list(values)}
        reach = [len(values) - 0.5, -0.5]
        layout[f"yaxis{number}"] = axis("", domain=[low, top], anchor=f"x{number}", range=reach, **ticks)
        layout[f"xaxis{number}"] = axis(title, anchor=f"y{number}")
        top = max(0.0, low - gap)
    return Figure(
        "estimates",
        {"data": traces, "layout": layout},
        f"{caption} Bars are two standard errors; grey ones hold zero.",
        f"Estimates with bounds: {', '.join(name for values in panels.values() for name in values)}.",
    )


def section_of_reconstruction(reconstruction: Reconstruction) -> Section:
    """Biases and scale factors of each channel with their bounds."""
    panels: dict[str, dict[str, tuple[float, float]]] = {}
    for name, estimate in reconstruction.biases.items():
        known = channel(name)
        values = panels.setdefault(f"bias [{unit_words(known.shown_unit) or '-'}]", {})
        values[name] = (known.shown_factor * estimate.value, known.shown_factor * estimate.sigma)
    if reconstruction.scales:
        panels["error of scale [%]"] = {n: (100.0 * e.value, 100.0 * e.sigma) for n, e in reconstruction.scales.items()}
    figure = (_estimates(panels, "Errors of the sensors."),) if panels else ()
    return Section("reconstruction", "Errors of the sensors", (*figure, Text(str(reconstruction))))


def section_of_equation(fit: EquationError) -> Section:
    """Coefficients with their bounds."""
    values = dict(zip(fit.names, zip(fit.values.tolist(), fit.sigmas.tolist(), strict=True), strict=True))
    figure = _estimates({"coefficient [own units]": values}, "Coefficients of the equation.")
    return Section("equation", f"Equation error: R² = {fit.determination:.4f}", (figure, Text(repr(fit))))


# ---- over frequency --------------------------------------------------------------------------------------------
def section_of_spectrum(curve: Spectrum) -> Section:
    """One channel's density over frequency."""
    return Section("spectrum", f"Spectrum of {curve.channel}", (of_spectra([{"": curve}], [""]), Text(str(curve))))


def section_of_spectrogram(spectrogram: Spectrogram) -> Section:
    """One channel's power over time and frequency."""
    return Section("spectrogram", f"Spectrogram of {spectrogram.channel}", (of_spectrograms([spectrogram]),))


def section_of_harmonics(harmonics: Harmonics) -> Section:
    """The channel's spectrum with the multiples of the rotor's speed marked, and the notches."""
    drawn = of_spectra([{harmonics.spectrum.channel: harmonics.spectrum}], [harmonics.spectrum.channel])
    density = harmonics.spectrum.density[1:]
    positive = density[density > 0.0]
    ends = [float(np.min(positive)), float(np.max(positive))] if positive.size else [1.0, 10.0]
    marks = [
        line([h.frequency, h.frequency], ends, name=f"{h.number} x", color=VERMILION, dash="dot", width=1.0)
        for h in harmonics.harmonics
    ]
    spec: FigurePart = {**drawn.spec, "data": [*marks, *drawn.spec["data"]]}
    keys = (Key(harmonics.spectrum.channel, BLUE), Key(f"multiples of {harmonics.rotor}", VERMILION, "dot"))
    caption = f"{drawn.caption} {harmonics.summary}"
    figure = Figure("harmonics", spec, caption, drawn.alt, keys=keys)
    return Section("harmonics", f"Rotor vibration in {harmonics.spectrum.channel}", (figure, Text(str(harmonics))))


# ---- over time -------------------------------------------------------------------------------------------------
def section_of_planned(planned: PlannedManeuver) -> Section:
    """What is flown over time, and its design rules."""
    series = sampled(planned.maneuver, rate=planned.rate, chirp=planned.chirp)
    figure = over_time([Flight({"maneuver": series})], channels=[str(name) for name in series.data_vars])
    return Section("maneuver", f"Maneuver: {planned.maneuver.kind}", (figure, _table("Design rules", *planned.rows())))


def section_of_pieces(pieces: Sequence[Maneuver], *, rate: float) -> Section:
    """Maneuvers that are flown one after the other, over time, sampled at a rate [Hz]."""
    drawn = []
    for number, piece in enumerate(pieces, 1):
        series = sampled(piece, rate=rate)
        one = over_time([Flight({"maneuver": series})], channels=[str(name) for name in series.data_vars])
        drawn.append(replace(one, identifier=f"piece-{number}", caption=f"{number}. {piece.kind}"))
    return Section("pieces", "What is flown", tuple(drawn))


def section_of_steps(steps: RateSteps) -> Section:
    """The rate after a step of its target, and after a disturbance."""
    layout = stacked(["over target [-]", "disturbed [own unit]"], height=150)
    traces = [
        line(steps.time, steps.step, name="step", color=BLUE),
        line(steps.time, steps.disturbance, name="disturbance", color=BLUE, axis="2"),
    ]
    verdict = "Stable" if steps.stable else "UNSTABLE: do not fly these gains"
    summary = f"{verdict}; overshoot {100.0 * steps.overshoot:.0f} %, settles at {steps.settled:.3g}."
    alt = "The rate over time, after a step of the target and after a disturbance of 0.1 of the command."
    figure = Figure("steps", {"data": traces, "layout": layout}, summary, alt)
    return Section("steps", "Steps of a rate loop", (figure, Text(summary, tone="plain" if steps.stable else "bad")))


# ---- autopilots ------------------------------------------------------------------------------------------------
def section_of_loops(loops: Sequence[LoopWorth]) -> Section:
    """Margins of an autopilot's loops beside those that are kept."""
    from swashplate.control.analysis.cascade_gains import GAIN_KEPT, PEAK_KEPT, PHASE_KEPT

    places, names = list(range(len(loops))), [loop.name for loop in loops]
    layout = base_layout(_ROW * len(loops) + 80, left=90)
    panels = (
        ("gain margin [dB]", [loop.gain for loop in loops], GAIN_KEPT),
        ("phase margin [deg]", [loop.phase for loop in loops], PHASE_KEPT),
        ("delay margin [ms]", [1e3 * loop.delay if np.isfinite(loop.delay) else None for loop in loops], None),
        ("largest sensitivity [-]", [loop.peak for loop in loops], PEAK_KEPT),
    )
    traces = []
    for i, (title, values, kept) in enumerate(panels):
        number = axis_number(i)
        ends = [-0.5, len(loops) - 0.5]
        traces.append(dots(values, places, {"color": BLUE, "size": 8}, name=title, axis=number))
        if kept is not None:
            traces.append(line([kept, kept], ends, name="limit", color=VERMILION, dash="dash", axis=number))
        ticks = {"tickvals": places, "ticktext": names}
        layout[f"yaxis{number}"] = axis("", anchor=f"x{number}", range=ends[::-1], **ticks)
        layout[f"xaxis{number}"] = axis(title, anchor=f"y{number}", domain=[0.27 * i, 0.27 * i + 0.19])
    figure = Figure(
        "margins",
        {"data": traces, "layout": layout},
        "Each loop broken with the others closed; margins lie right of their limit, the sensitivity left of it; the "
        "delay margin has none.",
        f"Margins of the loops {', '.join(names)}.",
        keys=(Key("found", BLUE, "circle"), Key("limit", VERMILION, "dash")),
    )
    return Section("loops", "Loops", (figure,))


def plain_page(
    title: str, *, summary: Mapping[str, str], sections: Sequence[Section] = (), problems: Sequence[str] = ()
) -> Report:
    """The page of a result of one verb: what is wrong first, then its numbers, then its figures."""
    lines = tuple((name, value, "plain") for name, value in summary.items())
    return Report(title, tuple(("bad", text) for text in problems), lines, None, tuple(sections))


def section_of_linear_model(model: LinearModel) -> Section:
    """Its modes, and itself in words."""
    return Section("modes", "Linear model", (eigenvalues({"model": model.modes()}), Text(repr(model))))


def section_of_trims(curve: TrimCurve) -> Section:
    """Controls over speed, and the trims as a table."""
    columns = curve.columns()
    rows = tuple(tuple(f"{v:.3f}" for v in row) for row in zip(*columns.values(), strict=True))
    remarks: tuple[Block, ...] = tuple(Text(text, tone="caution") for text in curve.remarks)
    title = f"Trims of {curve.vehicle.card.title}"
    return Section("trims", title, (*remarks, controls(curve), tabulate("Trims", columns, rows)))


def section_of_derivatives(derivatives: Derivatives, row: str = "M") -> Section:
    """What each part of the vehicle contributes, the wanted row first, and the table."""
    head, rows = derivatives.rows(derivatives.tables[0])
    title = f"Derivatives of {derivatives.vehicle.card.title} at {derivatives.trims[0].speed:g} m/s"
    table = tabulate("Derivatives", head, rows)
    others = tuple(by_contributor(derivatives, other) for other in "XYZLMN" if other != row)
    return Section("derivatives", title, (by_contributor(derivatives, row), *others, table))
