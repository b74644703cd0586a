"""A controller in gusts, flown on the nonlinear vehicle: how far it strays from what it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.control.analysis.check_steps import LEAD, flying_rate
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.errors import DivergenceError
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.controller import Controller
from swashplate.simulation.wind import Gusts, dryden

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
