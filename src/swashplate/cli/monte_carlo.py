"""`swash simulate --monte-carlo`: one controller on many aircraft in many gusts, and the worst flight kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from swashplate.errors import DivergenceError, SwashError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swashplate.control.robustness import Spread
    from swashplate.flights.flight import Flight
    from swashplate.flights.maneuvers import Maneuver
    from swashplate.identification.state_space import StateSpaceModel
    from swashplate.simulation.wind import Gusts
    from swashplate.vehicles.vehicle import Vehicle

_LEAD, _TAIL = 3.0, 3.0  # s of hover before and after, as `simulate_maneuver` has them
_PHYSICS = 500.0  # Hz at least
_KEPT = 20.0  # Hz of the samples that the summary sees


def fly(
    vehicle: Vehicle,
    maneuver: Maneuver,
    controller: Path,
    *,
    count: int,
    fit: Path | None,
    gusts: str,
    seed: int,
    voltage: float | None,
    sag: float,
    battery: str | None = None,
    tolerances: bool = False,
    vary: list[str] | None = None,
    payload: float = 0.0,
    delay: float = 0.0,
    model: StateSpaceModel | None = None,
) -> tuple[Spread, Flight]:
    """The summary of many flights, and the worst of them.

    Args:
        vehicle: the model; with `fit` the flights are of models drawn from its covariance.
        maneuver: a pilot's commands, only roll and pitch; of a controller that takes none, added to its inputs.
        controller: its file.
        count: how many flights.
        fit: a fit.json.
        gusts: "none", "indoor" or a mean wind [m/s].
        seed: of draws, gusts and sensor noise.
        voltage, sag: the battery's at the start [V] and its fall [V/s].
        battery: instead of both, its voltage at the start and at the end, "12.5-10.5".
        tolerances: draw the card's numbers from their sigmas too.
        vary: "NAME=SIGMA" or "NAME=PERCENT%" of the card's numbers.
        payload: the most that an aircraft carries [kg].
        delay: the longest of the commands to the actuators [s].
        model: what a linear vehicle was made of; its parameters are what is drawn.
    """
    import numpy as np

    import swashplate as sp
    from swashplate.cli.simulate import from_file
    from swashplate.control.lqg import Lqg
    from swashplate.control.robustness import SENSOR_NOISE, spread
    from swashplate.control.variations import draw_delays
    from swashplate.simulation.closed_loop_batch import simulate_closed_loops
    from swashplate.simulation.wind import dryden

    if model is not None:
        _only_what_is_linear(model, gusts=gusts != "none", payload=payload > 0.0, battery=bool(battery or sag))
    draws = _linear_draws if model is not None else _draws
    drawn = draws(model or vehicle, fit, count=count, seed=seed, tolerances=tolerances, vary=vary, payload=payload)
    ends = _battery(battery)
    hover = sp.trim(vehicle, voltage=voltage if ends is None else ends[0])
    pilot = from_file(controller, seed=seed)(vehicle, hover)
    piloted = not isinstance(pilot, Lqg)
    strange = [axis for axis in maneuver.axes if piloted and axis not in ("roll", "pitch")]
    if strange:
        raise SwashError(
            f"moves {', '.join(strange)}; with --monte-carlo a maneuver is a pilot's roll or pitch.",
            channel="--maneuver",
        )
    if not piloted:
        typer.echo("Careful: this controller takes no pilot's command; the maneuver moves its inputs.", err=True)
    duration = _LEAD + maneuver.duration + _TAIL
    keep = max(1, round(pilot.rate / _KEPT))
    samples = round(duration * pilot.rate)
    time = np.arange(samples) / pilot.rate
    setting = turbulence(gusts)
    fall = sag if ends is None else (ends[0] - ends[1]) / duration
    late = draw_delays(most=delay, count=count, seed=seed + 3_000_003)
    flown = simulate_closed_loops(
        vehicle,
        pilot,
        duration=duration,
        size=count,
        parameters=drawn or None,
        reference=maneuver.signals(time - _LEAD) if piloted else None,
        excitation=None if piloted else maneuver.offsets(time - _LEAD, inputs=vehicle.input_names),
        wind=None if setting is None else dryden(setting, samples=samples, rate=pilot.rate, seed=seed, count=count),
        voltage=float(hover.environment.voltage) - fall * time,
        noise=None if getattr(pilot.step, "feels", False) else SENSOR_NOISE,  # it brings its own sensors
        delay=late,
        seed=seed,
        start=hover,
        rate=pilot.rate * max(1, round(_PHYSICS / pilot.rate)),
        keep=keep,
    )
    found = spread(flown)
    try:
        worst = flown.flight(found.worst)
    except DivergenceError as error:
        if error.flight is None:
            raise
        worst = error.flight  # type: ignore[assignment]
    own = {name: float(values[found.worst]) for name, values in drawn.items()}
    return found, worst.done("drawn", seed=seed, number=found.worst, delay=float(late[found.worst]), parameters=own)


def _battery(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    from swashplate.cli.options import numbers

    try:
        ends = numbers(text.replace("-", ","), option="--battery", count=2)
    except SwashError:
        raise SwashError(
            f"is '{text}', expected the voltages at start and end.", channel="--battery", hint="Example: 12.5-10.5"
        ) from None
    if not 0.0 < ends[1] <= ends[0]:
        raise SwashError(f"'{text}' does not fall.", channel="--battery", hint="Example: --battery 12.5-10.5")
    return ends[0], ends[1]


def _draws(
    vehicle: Any, fit: Path | None, *, count: int, seed: int, tolerances: bool, vary: list[str] | None, payload: float
) -> dict[str, Any]:
    """Numbers of the card of every aircraft, those that differ. Every source of randomness has its own seed, so that
    adding one leaves the others as they were."""
    from swashplate.control.robustness import draw_models
    from swashplate.control.variations import draw_numbers, load_them, tolerances_of

    drawn = {} if fit is None else draw_models(vehicle, fit, count=count, seed=seed)
    known = tolerances_of(vehicle) if tolerances else {}
    sigmas = {name: value for name, value in known.items() if name not in drawn}
    sigmas |= _varied({name: p.value for name, p in vehicle.card.parameters.items()}, vary)
    drawn = draw_numbers(vehicle, sigmas, count=count, seed=seed + 1_000_003, about=drawn)
    if payload:
        drawn = load_them(vehicle, drawn, most=payload, count=count, seed=seed + 2_000_003)
    return drawn


def _linear_draws(
    model: Any, fit: Path | None, *, count: int, seed: int, tolerances: bool, vary: list[str] | None, payload: float
) -> dict[str, Any]:
    """Entries of A and B of every aircraft."""
    from swashplate.control.linear_draws import bounds_of, draw_parameters, entries_of, vary_parameters

    del payload
    drawn = {} if fit is None else draw_parameters(model, fit, count=count, seed=seed)
    known = bounds_of(model) if tolerances else {}
    sigmas = {name: value for name, value in known.items() if name not in drawn}
    sigmas |= _varied({name: p.value for name, p in model.parameters.items()}, vary)
    drawn = vary_parameters(model, sigmas, count=count, seed=seed + 1_000_003, about=drawn)
    return entries_of(model, drawn, count=count) if drawn else {}


def _only_what_is_linear(model: StateSpaceModel, **asked: bool) -> None:
    """Refuse what a linear model has no equation for; it would be flown as if nothing had been said."""
    absent = [f"--{name}" for name, wanted in asked.items() if wanted]
    if absent:
        raise SwashError(
            "a linear model has no equations for wind, mass or battery.",
            where=model.name,
            channel=", ".join(absent),
            hint="Vary its parameters (--vary Xu=10%, --fit, --tolerances), or fly the nonlinear vehicle.",
        )


def _varied(values: Mapping[str, float], texts: list[str] | None) -> dict[str, float]:
    """`NAME=SIGMA` and `NAME=PERCENT%` as standard deviations."""
    from swashplate.cli.options import assignments, numbers

    found = {}
    for name, text in assignments(texts, option="--vary").items():
        value = numbers(text.removesuffix("%"), option="--vary", count=1)[0]
        found[name] = abs(values[name]) * value / 100.0 if name in values and text.endswith("%") else value
    return found


def turbulence(gusts: str) -> Gusts | None:
    """What --gusts asks for."""
    from swashplate.cli.options import numbers
    from swashplate.simulation.wind import INDOOR, outdoor

    if gusts == "none":
        return None
    if gusts == "indoor":
        return INDOOR
    try:
        return outdoor(numbers(gusts, option="--gusts", count=1)[0])
    except SwashError as error:
        raise SwashError(
            f"is '{gusts}', expected none, indoor, or a mean wind in m/s ({error.problem}).", channel="--gusts"
        ) from None
