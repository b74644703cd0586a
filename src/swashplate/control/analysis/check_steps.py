"""Steps of a controller's references flown on the nonlinear vehicle, and what the other axes do meanwhile."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.requirements import ATTITUDE_COUPLING
from swashplate.control.analysis.step_response import StepMetrics, cross_ratio, step_metrics
from swashplate.errors import DivergenceError
from swashplate.flights.flight import Flight
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.controller import Controller

STEPS: Mapping[str, tuple[str, str, float]] = {
    "roll": ("phi", "p", 0.1),
    "pitch": ("theta", "q", 0.1),
    "psi": ("psi", "r", math.radians(30.0)),
    "z": ("z", "", -0.5),
    "x": ("x", "", 1.0),
    "y": ("y", "", 1.0),
    "ahead": ("u", "", 0.5),
    "right": ("v", "", 0.5),
}
"""Steps by reference: the state that answers, its measured rate, and the size [rad, m, m/s, share of the stick]."""
LEAD = 0.5
"""Seconds of rest before a step."""
_PHYSICS = 500.0
"""Least rate of the simulation [Hz]."""
COUPLING_WITHIN = 4.0
"""Seconds after the step in which couplings are read (as in ADS-33E-PRF, 3.3.9)."""


@dataclass(frozen=True)
class Step:
    """A step of one reference, flown on the nonlinear vehicle."""

    reference: str
    state: str
    size: float
    flight: Flight
    metrics: StepMetrics


@dataclass(frozen=True)
class Coupling:
    """What one axis does while another is commanded: `value` in `unit`, and its level where a standard has one."""

    name: str
    value: float
    unit: str
    level: int | None


def flying_rate(controller: Controller) -> float:
    """Rate of the simulation [Hz]: a whole multiple of the controller's."""
    return controller.rate * max(1, round(_PHYSICS / controller.rate))


def fly_steps(
    flying: Aircraft,
    controller: Controller,
    answered: Sequence[str],
    duration: float,
    problems: list[str],
) -> list[Step]:
    """Steps of those references that are answered, each from the trim.

    Args:
        flying, controller: who flies, where, how late.
        answered: references; a speed is left out where a place is held, which takes it back.
        duration: after the step [s].
        problems: a lost flight is told here.
    """
    vehicle, trim, delays = flying
    rate = flying_rate(controller)
    samples = round((LEAD + duration) * rate) + 1
    on = np.arange(samples) / rate >= LEAD
    at_rest = trim.states()
    steps = []
    for reference, (state, measured_rate, size) in STEPS.items():
        if reference not in answered or (reference in ("ahead", "right") and "x" in answered):
            continue  # a place that is held takes a speed back
        try:
            flight = simulate_closed_loop(
                vehicle,
                controller,
                duration=LEAD + duration,
                reference={reference: at_rest.get(reference, 0.0) + size * on},
                delays=delays,
                start=trim,
                rate=rate,
                environment=trim.environment,
            )
        except DivergenceError as error:
            problems.append(f"The step of {reference} was lost after {error.time:.2f} s ({error.state}).")
            continue
        after = slice(int(np.argmax(on)), None)
        metrics = step_metrics(
            flight.time(state)[after],
            flight.values(state)[after],
            wanted=None if reference in ("roll", "pitch") else size,
            rates=flight.values(measured_rate)[after] if measured_rate else None,
        )
        steps.append(Step(reference, state, size, flight, metrics))
    return steps


def couplings_of(steps: Mapping[str, Step]) -> list[Coupling]:
    """Largest change across over the largest along, of the steps by reference that were flown."""
    lateral, forward = (
        next((steps[r] for r in names if r in steps), None)
        for names in (("roll", "right", "y"), ("pitch", "ahead", "x"))
    )
    couplings = []
    for name, step, on, off, unit, factor in (
        ("pitch from roll", lateral, "phi", "theta", "deg/deg", 1.0),
        ("roll from pitch", forward, "theta", "phi", "deg/deg", 1.0),
        ("height from pitch", forward, "theta", "z", "m/rad", 1.0),
        ("yaw from collective", steps.get("z"), "z", "psi", "deg/m", math.degrees(1.0)),
    ):
        if step is None:
            continue
        t = step.flight.time(on)
        part = (t >= LEAD) & (t <= LEAD + COUPLING_WITHIN)
        value = factor * cross_ratio(step.flight.values(on)[part], step.flight.values(off)[part])
        level = ATTITUDE_COUPLING.level(value) if unit == "deg/deg" else None
        couplings.append(Coupling(f"{name} (step of {step.reference})", value, unit, level))
    return couplings
