"""Figures of what a flight without a sweep tells: step responses with their bands, noise before and behind filters."""

from __future__ import annotations

from swashplate.flights.review.noise import GyroNoise
from swashplate.flights.review.review import FlightReview, LoopReview
from swashplate.reporting.structure import Figure, Key, Section, Text
from swashplate.reporting.theme import BLUE, GREY, VERMILION, axis_number, line, over_frequency, stacked


def section_of_review(review: FlightReview) -> Section:
    """Step responses, spectra of the gyros, and all of it in words."""
    steps = [loop for loop in review.loops if loop.step is not None]
    figures = (*((_steps(steps),) if steps else ()), *((_noise(review.noise),) if review.noise else ()))
    texts = [
        Text(f"{heading[0].upper()}{heading[1:]}: {'; '.join(lines) or 'none'}") for heading, lines in review.lists()
    ]
    return Section("review", "What the flight tells without a sweep", (*figures, *texts))


def _steps(loops: list[LoopReview]) -> Figure:
    layout = stacked([f"{loop.axis} rate over target [-]" for loop in loops], height=150)
    traces = []
    for i, loop in enumerate(loops):
        step, number = loop.step, axis_number(i)
        if step is None:
            continue
        traces += [
            line(step.time, edge, name="95 % band", color=GREY, width=0.8, axis=number)
            for edge in (step.low, step.high)
        ]
        traces.append(line(step.time, step.response, name=loop.axis, color=BLUE, axis=number))
    summary_text = "; ".join(f"{loop.axis}: {loop.step}" for loop in loops)
    return Figure(
        "step responses",
        {"data": traces, "layout": layout},
        "The rate after a step of its target, deconvolved from the flight; grey: 95 % band over its windows.",
        f"Step responses of rate loops. {summary_text}.",
    )


def _noise(noise: tuple[GyroNoise, ...]) -> Figure:
    layout = over_frequency([f"{each.channel} [(deg/s)²/Hz]" for each in noise], height=150, unit="Hz")
    traces = []
    for i, each in enumerate(noise):
        number = axis_number(i)
        layout[f"yaxis{number}"] |= {"type": "log", "exponentformat": "power"}
        over = each.frequency[1:]
        traces.append(line(over, each.before[1:], name="before the filters", color=VERMILION, axis=number))
        traces.append(line(over, each.after[1:], name="behind the filters", color=BLUE, axis=number))
    return Figure(
        "gyro noise",
        {"data": traces, "layout": layout},
        "Power spectral density of the gyros before and behind the autopilot's filters.",
        f"Spectra of {'; '.join(map(str, noise))}.",
        keys=(Key("before the filters", VERMILION), Key("behind the filters", BLUE)),
    )
