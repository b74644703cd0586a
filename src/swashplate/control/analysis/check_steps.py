"""A controller flown on the nonlinear vehicle: steps of its references and what is read off them, and gusts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.requirements import ATTITUDE_COUPLING
from swashplate.errors import DivergenceError
from swashplate.flights.flight import Flight
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.controller import Controller
from swashplate.simulation.wind import Gusts, dryden

_SETTLED = 0.05
"""Share of the step within which a response has settled."""
_TAIL = 0.1
"""Last share of the record whose mean is the final value where none is wanted."""


@dataclass(frozen=True)
class StepMetrics:
    """Times after the step [s]; NaN where the record does not show one.

    Attributes:
        rise: from 10 to 90 % of the step.
        overshoot: beyond the final value, as a share of the step.
        settling: from when on it stays within 5 % of the step.
        peak: largest change from the start [unit of the response].
        quickness: largest rate over largest change [1/s]; of an attitude ADS-33E's attitude quickness.
        error: last value less the wanted one, as a share of the step.
    """

    rise: float
    overshoot: float
    settling: float
    peak: float
    quickness: float
    error: float


def step_metrics(time: Array, values: Array, *, wanted: float | None = None, rates: Array | None = None) -> StepMetrics:
    """Metrics of a response that begins with the step.

    Args:
        time: from the step on [s], shape (n,).
        values: of the response, shape (n,); the first one is its rest.
        wanted: the change that was asked for; without it the last tenth of the record says where the response ends, and
            one that ends below a third of its peak (a command that an outer loop takes back) has no rise or settling.
        rates: measured derivative; differences of the values where not given.
    """
    change_of = np.asarray(values, dtype=np.float64) - values[0]
    t = np.asarray(time, dtype=np.float64) - time[0]
    largest = float(np.max(np.abs(change_of)))
    derivative = np.gradient(change_of, t) if rates is None else np.asarray(rates, dtype=np.float64)
    quickness = float(np.max(np.abs(derivative))) / largest if largest > 0.0 else float("nan")
    nothing = float("nan")
    final = wanted if wanted is not None else float(np.mean(change_of[-max(1, int(_TAIL * change_of.size)) :]))
    if largest == 0.0 or final == 0.0 or (wanted is None and abs(final) < largest / 3.0):
        return StepMetrics(nothing, nothing, nothing, largest, quickness, nothing)
    share = change_of / final
    low, high = (_first(t, share, level) for level in (0.1, 0.9))
    outside = np.flatnonzero(np.abs(share - 1.0) > _SETTLED)
    settled = 0.0 if not outside.size else nothing if outside[-1] == t.size - 1 else float(t[outside[-1] + 1])
    return StepMetrics(
        rise=high - low,
        overshoot=max(float(np.max(share)) - 1.0, 0.0),
        settling=settled,
        peak=largest,
        quickness=quickness,
        error=float(share[-1] - 1.0),
    )


def _first(t: Array, share: Array, level: float) -> float:
    """When the response first reaches a share of the step, straight between samples."""
    above = np.flatnonzero(share >= level)
    if not above.size:
        return float("nan")
    k = int(above[0])
    if k == 0:
        return float(t[0])
    part = (level - share[k - 1]) / (share[k] - share[k - 1])
    return float(t[k - 1] + part * (t[k] - t[k - 1]))


def cross_ratio(on_axis: Array, off_axis: Array) -> float:
    """Largest change of the off-axis response over that of the on-axis one."""
    on, off = (float(np.max(np.abs(values - values[0]))) for values in (on_axis, off_axis))
    return off / on if on > 0.0 else float("nan")


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


FLIGHTS = 4
"""Each in other gusts and, with sensors, with other noise."""
_SETTLING = 2.0
"""Seconds at the start of each that are not judged: it begins at rest."""


@dataclass(frozen=True)
class InGusts:
    """Root mean squares over flights in turbulence; NaN of what the controller does not hold.

    Attributes:
        gusts: the turbulence. flights, duration: how many, of how many seconds [s].
        place: distance from the place, level [m]. height: [m]. heading: [rad].
        speed: of the level speed's error, where a speed is held instead of a place [m/s].
        lean: of roll and pitch about the trim [rad].
    """

    gusts: Gusts
    flights: int
    duration: float
    place: float
    height: float
    heading: float
    speed: float
    lean: float


def fly_gusts(
    flying: Aircraft,
    controller: Controller,
    gusts: Gusts | None,
    held: Sequence[str],
    duration: float,
    problems: list[str],
    notes: list[str],
) -> InGusts | None:
    """Fly `FLIGHTS` times in turbulence about a trim.

    Args:
        flying, controller: who flies, where, how late.
        gusts: None flies none.
        held: references that the controller answers; without any it holds nothing, and is not flown.
        duration: of each flight, as long as a step's so that nothing is compiled anew [s].
        problems: a lost flight is told here.
        notes: why there is none.
    """
    if gusts is None or not held:
        return None
    vehicle, trim, delays = flying
    if not vehicle.traits.wind:
        notes.append("No gusts: the model has no equation for wind. Check it on the nonlinear vehicle.")
        return None
    rate = flying_rate(controller)
    samples = round((LEAD + duration) * rate) + 1
    start, squares = trim.states(), []
    for seed in range(FLIGHTS):
        wind = {n: series[:, 0] for n, series in dryden(gusts, samples=samples, rate=rate, seed=seed).items()}
        try:
            flight = simulate_closed_loop(
                vehicle,
                controller.with_seed(seed),
                duration=LEAD + duration,
                wind=wind,
                delays=delays,
                start=trim,
                rate=rate,
                environment=trim.environment,
            )
        except DivergenceError as error:
            problems.append(f"A flight in gusts was lost after {error.time:.2f} s ({error.state}).")
            return None
        judged = flight.time("x") >= _SETTLING
        away = {n: flight.values(n)[judged] - start[n] for n in ("x", "y", "z", "u", "v", "phi", "theta", "psi")}
        away["psi"] = np.arctan2(np.sin(away["psi"]), np.cos(away["psi"]))
        squares.append({name: float(np.mean(values**2)) for name, values in away.items()})

    def rms(*names: str, by: str) -> float:
        return float(np.sqrt(np.mean([sum(s[n] for n in names) for s in squares]))) if by in held else float("nan")

    return InGusts(
        gusts,
        FLIGHTS,
        duration,
        place=rms("x", "y", by="x"),
        height=rms("z", by="z"),
        heading=rms("psi", by="psi"),
        speed=rms("u", "v", by="ahead") if "x" not in held else float("nan"),
        lean=rms("phi", "theta", by=held[0]),
    )
