"""Closed loop: a controller at its own rate in the same compiled loop as the vehicle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, parameter_row
from swashplate.engine.fly import FlightPlan, Steering, fly
from swashplate.engine.law import REFERENCES
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.flights.maneuvers.series import parse as parse_maneuver
from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.controller import Controller
from swashplate.simulation.record import check_divergence, quantum_of, simulated_flight, steps_late
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start, trim


def flown_delays(
    vehicle: Vehicle, controller: Controller, *, delays: Mapping[str, float] | float | None = None
) -> Array:
    """By how much commands are late in flight, by input [s], shape (inputs,).

    What is given counts first, then what the vehicle's card knows, then what the controller was designed for.
    """
    if delays is None and controller.at_once:
        delays = 0.0
    if delays is None:
        delays = input_delays(vehicle) or dict(controller.delays)
    return np.array(list(complete_delays(vehicle, delays).values()))


def simulate_closed_loop(
    vehicle: Vehicle,
    controller: Controller,
    *,
    duration: float,
    reference: Mapping[str, ArrayLike] | None = None,
    excitation: Mapping[str, ArrayLike] | None = None,
    voltage: ArrayLike | None = None,
    wind: Mapping[str, ArrayLike] | None = None,
    delays: Mapping[str, float] | float | None = None,
    start: Trim | Mapping[str, float] | None = None,
    rate: float = 100.0,
    environment: Environment | None = None,
) -> Flight:
    """Fly a vehicle under a controller, with an excitation added to what the controller commands.

    A flight that pitches beyond 80 degrees is integrated with a quaternion, as by `simulate_open_loop`.

    Args:
        vehicle, start, rate, environment: as in `simulate_open_loop`; inputs are held over a step.
        controller: see `Controller`.
        duration: [s].
        reference: numbers or series (n,) of `REFERENCES`; a place or heading that is not given stays at the start's
            value, a speed or command at zero.
        excitation: series (n,) by input name, added to the commands before the limits.
        voltage: battery voltage [V], a number or series (n,).
        wind: "wind_north", "wind_east", "wind_down" [m/s], numbers or series (n,).
        delays: from command to actuator [s], one for all or by input, rounded up to the simulation's steps; where not
            given those of `flown_delays`. Until the first command arrives the actuators get those of the start.

    Returns:
        The true flight; its inputs are what the actuators got: command and excitation, limited, late.

    Raises:
        DivergenceError: with the time, the state that went first and the flight up to there.
    """
    every = rate / controller.rate
    if every < 1.0 or abs(every - round(every)) > 1e-9:
        raise SwashError(
            f"the simulation runs at {rate:g} Hz, expected a multiple of the controller's {controller.rate:g} Hz.",
            channel="rate",
            hint=f"Give {max(round(every), 1) * controller.rate:g} Hz.",
        )
    n = round(duration * rate) + 1
    if n < 2:
        raise SwashError(f"duration is {duration} s, expected at least one step of {1.0 / rate:g} s.")
    surroundings = surroundings_of_start(vehicle, start, environment)
    given = {**(wind or {}), **({} if voltage is None else {"voltage": voltage})}
    around = _table(SURROUNDINGS, given, n, [getattr(surroundings, name) for name in SURROUNDINGS])
    x0 = start_row(vehicle, start, surroundings._replace(**dict(zip(SURROUNDINGS, around[0], strict=True))))
    at_start = dict(zip(vehicle.state_names, x0, strict=True))
    wanted = _table(REFERENCES, reference or {}, n, [at_start.get(name, 0.0) for name in REFERENCES])
    added = _table(vehicle.input_names, excitation or {}, n, [0.0] * len(vehicle.input_names))
    steps_behind = steps_late(flown_delays(vehicle, controller, delays=delays), rate)
    law = controller.law(vehicle)
    first = np.zeros(len(vehicle.input_names))
    if steps_behind.any() or law.feels:
        first = _inputs_before(vehicle, start, surroundings)
    every = round(every)
    steering = Steering(
        law,
        controller.memory_of_law()[:, None],
        every,
        wanted[:, :, None],
        added[:, :, None],
        limits_of(vehicle),
        steps_behind[:, None],
        first,
        controller.draws(-(-n // every))[:, :, None],
    )
    numbers = parameter_row(vehicle, surroundings)[:, None]
    plan = FlightPlan(x0[:, None], numbers, around[:, :, None], 1.0 / rate, steering=steering)
    states, inputs = (table[:, :, 0] for table in fly(vehicle, plan))
    time, rows = np.arange(n) / rate, np.concatenate([inputs, around], axis=1)
    details = {"rate": rate, "controller_rate": controller.rate, "gravity": float(surroundings.gravity)}
    flight = simulated_flight(vehicle, time, states, rows, details=details)
    check_divergence(vehicle, time, states, flight)
    return flight


def _inputs_before(vehicle: Vehicle, start: Trim | Mapping[str, float] | None, around: Environment) -> Array:
    """What the actuators get before the first command arrives: the trim's."""
    return np.asarray((start if isinstance(start, Trim) else trim(vehicle, environment=around)).inputs)


def limits_of(vehicle: Vehicle, bits: int | None = None) -> Array:
    """Lowest, highest and whole step (0: none) of each input, shape (3, inputs)."""
    ranges = np.array(vehicle.input_limits, dtype=np.float64)
    return np.stack([*ranges.T, quantum_of(ranges, bits)])


def _table(names: tuple[str, ...], given: Mapping[str, ArrayLike], n: int, default: list[Any]) -> Array:
    for name, values in given.items():
        if name not in names:
            raise SwashError(f"is not known here; expected {', '.join(names)}.", channel=name)
        if np.ndim(values) and np.shape(values) != (n,):
            raise SwashError(f"has shape {np.shape(values)}, expected ({n},).", channel=name)
    return np.stack(
        [np.broadcast_to(np.asarray(given.get(k, d), float), (n,)) for k, d in zip(names, default, strict=True)], 1
    )


def simulate_maneuver(
    vehicle: Vehicle,
    maneuver: Maneuver | str,
    *,
    controller: Callable[[Vehicle, Trim], Controller],
    lead: float = 3.0,
    tail: float = 3.0,
    pilot: bool = False,
    voltage: float | None = None,
    sag: float = 0.0,
    speed: float = 0.0,
    rate: float = 100.0,
    wind: Mapping[str, ArrayLike] | None = None,
    environment: Environment | None = None,
) -> Flight:
    """A maneuver flown from hover or steady flight with a controller that keeps the vehicle there.

    Args:
        vehicle: what flies.
        maneuver: a `Maneuver` or its description, e.g. "sweep:pitch,0.5-8Hz,60s".
        controller: makes the controller for the vehicle and its trim, e.g. `swashplate.control.laws.hold.hover_hold`.
        lead, tail: hover before and after [s].
        pilot: True sends roll and pitch to the controller as a pilot's commands; otherwise every axis is added to what
            the controller commands.
        voltage: battery voltage at the start [V].
        sag: how much the voltage falls per second [V/s].
        speed: speed ahead that it begins at [m/s].
        rate: samples per second [Hz].
        wind, environment: as in `simulate_closed_loop`.
    """
    excitation = parse_maneuver(maneuver) if isinstance(maneuver, str) else maneuver
    if excitation.band is not None and excitation.band[1] > 0.5 * rate:
        raise SwashError(
            f"{rate:g} samples a second hold no more than {0.5 * rate:g} Hz, and the maneuver goes to "
            f"{excitation.band[1]:g} Hz.",
            channel="maneuver",
            hint=f"Give a lower band, or --rate {100.0 * np.ceil(0.25 * excitation.band[1]):g} (in Python rate=...).",
        )
    duration = lead + excitation.duration + tail
    time = np.arange(round(duration * rate) + 1) / rate
    start = trim(vehicle, speed=speed, voltage=voltage, environment=environment)
    level = float(start.environment.voltage) - sag * time
    if not level.min() > 0.0:
        raise SwashError(
            f"starts at {level[0]:g} V and falls to {level.min():.3g} V within {duration:g} s, expected more than 0.",
            channel="voltage",
            hint="Give a smaller sag or a shorter maneuver.",
        )
    commanded = [axis for axis in excitation.axes if pilot and axis in REFERENCES]
    signals = excitation.signals(time - lead)
    return simulate_closed_loop(
        vehicle,
        controller(vehicle, start),
        duration=duration,
        reference={axis: signals[axis] for axis in commanded},
        excitation=excitation.offsets(
            time - lead, inputs=vehicle.input_names, axes=vehicle.stick_axes, without=commanded
        ),
        voltage=level,
        wind=wind,
        start=start,
        rate=rate,
        environment=environment,
    )
