"""What of a vehicle's equations does not hold, at a state or along a flight, and the power that it takes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, local_to_body

_LOOKS = 40
_NOMINAL = "voltage_nominal"
_NEAR_NOMINAL = 0.25
"""Share of the nominal voltage, to either side, within which a card's drive train is believed; assumed."""


def doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> tuple[str, ...]:
    """What of the equations does not hold at a state, in words.

    Empty where they may be trusted. Of the battery every vehicle that has one is asked, of the rest those that know
    their limits (`Traits.doubts`).
    """
    return tuple(_by_kind(vehicle, x, u, environment).values())


def _by_kind(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    said = vehicle.traits.doubts
    doubted = {} if said is None else dict(said(vehicle, x, u, environment))
    fastest, speed = vehicle.card.fastest, _through_the_air(vehicle, x, environment)
    if fastest is not None and speed > fastest * _ROUNDING:
        doubted["speed"] = f"its air speed is {speed:.1f} m/s: the card may be trusted up to {fastest:g} m/s"
    nominal = nominal_voltage(vehicle)
    if nominal is not None and abs(environment.voltage / nominal - 1.0) > _NEAR_NOMINAL:
        doubted["battery"] = (
            f"the battery gives {environment.voltage:.3g} V: the card's drive train holds about {nominal:.4g} V, and "
            "is a guess so far away"
        )
    return doubted


def _through_the_air(vehicle: Vehicle, x: Array, environment: Environment) -> float:
    """Air speed [m/s] at a state; 0 for a vehicle without a rigid body's states."""
    if not {*_SPEEDS, *_ANGLES} <= {*vehicle.state_names}:
        return 0.0
    moving, angles = (x[[vehicle.index(name) for name in names]] for names in (_SPEEDS, _ANGLES))
    wind = local_to_body(Vector(*map(float, environment[:3])), Euler(*map(float, angles)), FloatBackend())
    return float(np.linalg.norm(moving - np.array(wind)))


_SPEEDS, _ANGLES = ("u", "v", "w"), ("phi", "theta", "psi")
_ROUNDING = 1.0 + 1e-6


def nominal_voltage(vehicle: Vehicle) -> float | None:
    """Voltage [V] about which the card's drive train holds; None for a vehicle that flies on no battery."""
    return float(vehicle.card.values()[_NOMINAL]) if _NOMINAL in vehicle.parameter_names else None


def doubts_along(vehicle: Vehicle, time: Array, x: Array, u: Array, wind: Array, voltage: Array) -> tuple[str, ...]:
    """What of the equations does not hold somewhere along a flight, each with when that is first seen.

    Args:
        time: stamps [s], shape (n,). Looked at are `_LOOKS` of them and those where a state is largest or smallest.
        x, u, wind: states (n, n_states), inputs (n, n_inputs) and wind (n, 3) by sample.
        voltage: of the battery by sample [V], shape (n,).
    """
    complete = np.flatnonzero(np.all(np.isfinite(np.column_stack([x, u, wind, voltage])), axis=1))
    if not complete.size:
        return ()
    usual, first = environment_of(vehicle), dict[str, str]()
    evenly = np.linspace(0, complete.size - 1, min(_LOOKS, complete.size)).astype(int)
    for k in complete[np.unique(np.concatenate([evenly, x[complete].argmax(axis=0), x[complete].argmin(axis=0)]))]:
        blowing = dict(zip(Environment._fields[:3], map(float, wind[k]), strict=True))
        around = usual._replace(**blowing, voltage=float(voltage[k]))
        with suppress(ArithmeticError, ValueError):  # a flight that diverges is told of by others
            for kind, doubt in _by_kind(vehicle, x[k], u[k], around).items():
                first.setdefault(kind, f"At {time[k]:.1f} s {doubt}")
    return tuple(first.values())


def envelope(vehicle: Vehicle, flight: Flight) -> tuple[str, ...]:
    """Where a flight, simulated or logged, leaves what the vehicle's numbers and equations hold for, in words.

    Inputs beyond the vehicle's limits, air speed beyond its card's, and where all states are there `doubts_along`
    (inflow, stall, flapping, battery); of a log the battery alone.
    """
    beyond = [text for name in vehicle.input_names for text in _beyond(vehicle, flight, name)]
    if all(name in flight for name in (*vehicle.state_names, *vehicle.input_names, *_AROUND)):
        x, u, wind = (flight.array(names) for names in (vehicle.state_names, vehicle.input_names, _AROUND[:3]))
        along = flight.time(vehicle.state_names[0])
        return (*beyond, *doubts_along(vehicle, along, x, u, wind, flight.values("voltage")))
    fastest = vehicle.card.fastest
    time, speed = _ground_speed(flight)
    if fastest is not None and np.any(fast := speed > fastest * _ROUNDING):
        beyond.append(
            f"At {time[np.argmax(fast)]:.1f} s it moves faster than {fastest:g} m/s, up to which the card is trusted: "
            f"{np.nanmax(speed):.1f} m/s at most"
        )
    nominal = nominal_voltage(vehicle)
    if nominal is not None and "voltage" in flight:
        mean = float(np.nanmean(flight.values("voltage"))) if np.any(np.isfinite(flight.values("voltage"))) else nominal
        if abs(mean / nominal - 1.0) > _NEAR_NOMINAL:
            beyond.append(
                f"Its battery gave {mean:.3g} V in the mean, and the card's drive train holds about {nominal:.4g}"
            )
    return tuple(beyond)


def monitored(flight: Flight, vehicle: Vehicle) -> Flight:
    """A flight that says in its notes where it leaves what the vehicle's numbers and equations hold for."""
    said = tuple(doubt for doubt in envelope(vehicle, flight) if doubt not in flight.provenance.notes)
    if not said:
        return flight
    return replace(flight, provenance=replace(flight.provenance, notes=(*flight.provenance.notes, *said)))


_AROUND = (*Environment._fields[:3], "voltage")
_OVER = 1e-3
"""Share of an input's range beyond its limit that is noise."""


def _beyond(vehicle: Vehicle, flight: Flight, name: str) -> Iterator[str]:
    """What an input was told beyond its limits."""
    if name not in flight:
        return
    low, high = vehicle.input_limits[vehicle.input_names.index(name)]
    values, slack = flight.values(name), _OVER * (high - low)
    with np.errstate(invalid="ignore"):
        over = (values < low - slack) | (values > high + slack)
    if over.any():
        k = int(np.argmax(over))
        yield f"At {flight.time(name)[k]:.1f} s {name} is told {values[k]:.4g}, beyond its limits {low:g} to {high:g}"


def _ground_speed(flight: Flight) -> tuple[Array, Array]:
    """Stamps [s] and speed [m/s] of a log; the place's over a second where no speed was logged, 0 for neither."""
    if all(name in flight for name in _SPEEDS):
        parts = [np.interp(flight.time("u"), flight.time(name), flight.values(name)) for name in _SPEEDS]
        return flight.time("u"), np.linalg.norm(parts, axis=0)
    if all(name in flight for name in _PLACE) and flight.duration > 1.0:
        time = flight.time("x")
        place = [np.interp(time, flight.time(name), flight.values(name)) for name in _PLACE]
        before = [np.interp(time - 1.0, time, row) for row in place]
        later = time - time[0] >= 1.0
        return time[later], np.linalg.norm(np.subtract(place, before), axis=0)[later]
    return np.zeros(1), np.zeros(1)


_PLACE = ("x", "y", "z")


def shaft_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float | None:
    """Power [W] that the rotors take from the engine at a state; None for a model without one."""
    power = vehicle.traits.power
    return None if power is None else power(vehicle, x, u, environment)
