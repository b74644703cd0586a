"""One controller on many aircraft in many gusts, and the worst flight kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.api.asking import flight_limits, turbulence
from swashplate.api.controllers import flown_by
from swashplate.api.fly_maneuver import save_flight
from swashplate.arrays import Array
from swashplate.control.draws.spread import Spread, spread
from swashplate.control.draws.variations import (
    SENSOR_NOISE,
    bounds_of,
    draw_delays,
    draw_models,
    draw_numbers,
    entries_of,
    load_them,
    tolerances_of,
    vary_parameters,
)
from swashplate.control.kinds import kind_of
from swashplate.control.lateness import lateness
from swashplate.engine.law import REFERENCES
from swashplate.errors import DivergenceError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import parse as parse_maneuver
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.monte_carlo import compose_monte_carlo
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.closed_loop_batch import Batch, simulate_closed_loops
from swashplate.simulation.trim import Trim, trim
from swashplate.simulation.wind import dryden

if TYPE_CHECKING:
    from swashplate.api.verbs.simulate import FlyMany

_LEAD, _TAIL = 3.0, 3.0  # s of hover before and after, as `simulate_maneuver` has them
_PHYSICS = 500.0  # Hz at least
_KEPT = 20.0  # Hz of the samples that the summary sees


@dataclass(frozen=True, repr=False)
class MonteCarlo(Shown):
    """Many flights of one controller.

    Attributes:
        vehicle, controller: what flew, and what it is called.
        spread: what they did, and which were lost.
        worst: the flight with the number `spread.worst`, up to where it diverged.
        flights: all of them, 20 samples a second.
        drawn: numbers of the aircraft that differ, by name, shape (flights,).
        late: how late commands were, in words.
        remarks: what may surprise.
    """

    vehicle: Vehicle
    controller: str
    spread: Spread
    worst: Flight
    flights: Batch
    drawn: Mapping[str, Array]
    late: str
    remarks: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def lost(self) -> int:
        """Flights that were beyond a limit or diverged."""
        return self.spread.lost

    def flight(self, number: int) -> Flight:
        """One of the flights, up to where it diverged."""
        return _up_to_divergence(self.flights, number)

    def save(self, path: str | Path) -> tuple[Path, ...]:
        """Write the worst flight: .nc (nothing lost) or .csv."""
        return save_flight(self.worst, path)

    def to_document(self) -> dict[str, object]:
        """The summary as what becomes JSON."""
        return {
            "kind": "monte-carlo",
            "vehicle": self.vehicle.name,
            "model": self.vehicle.card.title,
            "controller": self.controller,
            "late": self.late,
            "settings": dict(self.settings),
            **self.spread.to_document(),
            "worst_drawn": {name: float(values[self.spread.worst]) for name, values in self.drawn.items()},
            "remarks": list(self.remarks),
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes: the distribution and the worst flight."""
        return compose_monte_carlo(
            self.vehicle,
            self.spread,
            self.worst,
            title=title or f"{self.spread.flights} flights of {self.controller} on {self.vehicle.name}",
            late=self.late,
            drawn={name: float(values[self.spread.worst]) for name, values in self.drawn.items()},
            remarks=self.remarks,
        )

    def __repr__(self) -> str:
        careful = [f"Careful: {words}" for words in self.remarks]
        return "\n".join((f"late: {self.late}", *careful, repr(self.spread)))


def fly_many(asked: FlyMany, vehicle: Vehicle) -> MonteCarlo:
    """The flights that were asked for, of a vehicle with its changes."""
    maneuver, count, seed, battery = asked.maneuver, asked.count, asked.seed, asked.battery
    excitation = parse_maneuver(maneuver) if isinstance(maneuver, str) else maneuver
    if battery is not None and not 0.0 < battery[1] <= battery[0]:
        raise SwashError(f"'{battery[0]:g}-{battery[1]:g}' does not fall.", channel="battery")
    gusts, sag, delay, bits = turbulence(asked.gusts), asked.sag, asked.delay, asked.command_bits
    model = vehicle.structure
    if model is not None:
        _only_what_is_linear(model, gusts=gusts is not None, payload=asked.payload > 0.0, battery=bool(battery or sag))
    draws = _linear_draws if model is not None else _draws
    drawn = draws(model or vehicle, asked)
    nominal = vehicle.card.values().get("voltage_nominal") if asked.voltage is None else asked.voltage
    hover = trim(vehicle, voltage=nominal if battery is None else battery[0])
    pilot, name = flown_by(asked.controller, vehicle, hover, seed=seed)
    kind = kind_of(pilot)
    followed = [axis for axis in excitation.axes if axis in _ASKED]
    strange = [axis for axis in excitation.axes if kind.takes_stick and axis not in ("roll", "pitch", *followed)]
    if strange:
        raise SwashError(
            f"moves {', '.join(strange)}; with many flights a maneuver is a pilot's roll or pitch, or asks for "
            f"{', '.join(_ASKED)}.",
            channel="maneuver",
        )
    further = f", and up to {1e3 * delay:g} ms more" if delay else ""
    duration = _LEAD + excitation.duration + _TAIL
    samples = round(duration * pilot.rate)
    time = np.arange(samples) / pilot.rate
    fall = sag if battery is None else (battery[0] - battery[1]) / duration
    late = draw_delays(most=delay, count=count, seed=seed + 3_000_003)
    blowing = None if gusts is None else dryden(gusts, samples=samples, rate=pilot.rate, seed=seed, count=count)
    at_start, signals = hover.states(), excitation.signals(time - _LEAD)
    flown = simulate_closed_loops(
        vehicle,
        pilot,
        duration=duration,
        size=count,
        parameters=drawn or None,
        reference={n: at_start.get(n, 0.0) * (n not in _SPEEDS) + s for n, s in signals.items() if n in REFERENCES}
        if kind.takes_stick or followed
        else None,
        excitation=None
        if kind.takes_stick
        else excitation.offsets(time - _LEAD, inputs=vehicle.input_names, axes=vehicle.stick_axes, without=followed),
        wind=blowing,
        voltage=float(hover.environment.voltage) - fall * time,
        noise=None if kind.own_sensors else SENSOR_NOISE,
        delay=late,
        bits=bits,
        seed=seed,
        start=hover,
        rate=pilot.rate * max(1, round(_PHYSICS / pilot.rate)),
        keep=max(1, round(pilot.rate / _KEPT)),
    )
    moves_on = any(axis in _SPEEDS for axis in followed)
    judged = flight_limits(asked.limit)
    outcome = spread(flown, hover, limits=replace(judged, place=math.inf) if moves_on else judged)
    worst = _up_to_divergence(flown, outcome.worst)
    own = {name: float(values[outcome.worst]) for name, values in drawn.items()}
    remarks: tuple[str, ...] = (_NO_STICK,) if not kind.takes_stick and set(excitation.axes) - set(followed) else ()
    remarks += (_MOVES_ON,) if moves_on else ()
    remarks += not_followed(flown, hover, {n: signals[n] for n in followed}, time - _LEAD)
    worst = worst.done("drawn", seed=seed, number=outcome.worst, delay=float(late[outcome.worst]), parameters=own)
    settings = {
        "count": count,
        "seed": seed,
        "payload": asked.payload,
        "delay": delay,
        "voltage_fall": fall,
        "bits": bits,
    }
    told = lateness(vehicle, pilot, given=None) + further
    return MonteCarlo(vehicle, name, outcome, worst, flown, drawn, told, remarks, settings)


def _up_to_divergence(flown: Batch, number: int) -> Flight:
    try:
        return flown.flight(number)
    except DivergenceError as error:
        if not isinstance(error.flight, Flight):
            raise
        return error.flight


def not_followed(flown: Batch, start: Trim, asked: Mapping[str, Array], time: Array) -> tuple[str, ...]:
    """What was asked for and not reached by half of the flights, in words.

    Args:
        flown: all flights.
        start: where they started.
        asked: changes by axis [m, rad, m/s], shape (n,).
        time: of these, from the maneuver's start [s], shape (n,).
    """
    remarks = []
    for name, signal in asked.items():
        last = int(np.flatnonzero(signal)[-1])
        state = {"ahead": "u", "right": "v"}.get(name, name)
        at = int(np.searchsorted(flown.time, time[last] + _LEAD, side="right")) - 1
        reached = float(np.nanmedian(flown[state][at] - start.states()[state]))
        if not abs(reached - signal[last]) < 0.5 * abs(signal[last]):
            remarks.append(
                f"{name} was asked to change by {signal[last]:g}, and half of the flights reached {reached:.2g}."
            )
    return tuple(remarks)


_SPEEDS = ("ahead", "right")
_ASKED = ("x", "y", "z", "psi", *_SPEEDS)
"""Axes of a maneuver that are asked of the controller, as changes from the start."""
_MOVES_ON = "a speed is asked for: the place is not judged."
_NO_STICK = "this controller takes no pilot's command; the maneuver moves its inputs."


def _draws(vehicle: Any, asked: FlyMany) -> dict[str, Array]:
    """Numbers of the card of every aircraft, those that differ. Every source of randomness has its own seed, so that
    adding one leaves the others as they were."""
    count, seed = asked.count, asked.seed
    drawn = {} if asked.fit is None else draw_models(vehicle, asked.fit, count=count, seed=seed)
    known = tolerances_of(vehicle) if asked.tolerances else {}
    sigmas = {name: value for name, value in known.items() if name not in drawn}
    sigmas |= _varied({name: p.value for name, p in vehicle.card.parameters.items()}, asked.vary)
    drawn = draw_numbers(vehicle, sigmas, count=count, seed=seed + 1_000_003, about=drawn)
    if asked.payload:
        drawn = load_them(vehicle, drawn, most=asked.payload, count=count, seed=seed + 2_000_003)
    return drawn


def _linear_draws(model: Any, asked: FlyMany) -> dict[str, Array]:
    """Entries of A and B of every aircraft."""
    count, seed = asked.count, asked.seed
    drawn = {} if asked.fit is None else draw_models(model, asked.fit, count=count, seed=seed)
    known = bounds_of(model) if asked.tolerances else {}
    sigmas = {name: value for name, value in known.items() if name not in drawn}
    sigmas |= _varied({name: p.value for name, p in model.parameters.items()}, asked.vary)
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


def _varied(values: Mapping[str, float], wanted: Mapping[str, float | str] | None) -> dict[str, float]:
    """Sigmas in the parameters' units, of numbers or of texts such as "5%"."""
    sigmas = {}
    for name, given in (wanted or {}).items():
        if not isinstance(given, str):
            sigmas[name] = float(given)
            continue
        try:
            number = float(given.removesuffix("%"))
        except ValueError:
            raise SwashError(f"{name} varies by '{given}', expected a number or 5%.", channel="vary") from None
        share = name in values and given.endswith("%")
        sigmas[name] = abs(values[name]) * number / 100.0 if share else number
    return sigmas
