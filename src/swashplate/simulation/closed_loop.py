"""Closed loop: a controller at its own rate in the same compiled loop as the vehicle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.flights.maneuvers.series import parse as parse_maneuver
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.delays import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import QUICK_FLIGHT, lengthened, shared_length
from swashplate.simulation.dynamics import enable_double_precision, row_force, row_rates
from swashplate.simulation.late import steps_late
from swashplate.simulation.record import check_divergence, simulated_flight
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start, trim
from swashplate.simulation.tumbling import CarriedAttitude, steep, with_angles, with_quaternion

Step = Callable[[Any, Any, Any, Any, Any], tuple[Any, Any]]

_LEAST_WAITING = 32
"""Commands that are kept where any is late: one program flies all usual delays, no slower (measured)."""

REFERENCES = ("x", "y", "z", "psi", "ahead", "right", "roll", "pitch")
"""What a controller is asked for, in the order of the reference row: place [m] and heading [rad] to hold, speed ahead
and to the right [m/s], and a pilot's cyclic commands [-1 to 1] (right and nose down positive)."""


class Controller(Protocol):
    """Something that turns measured states into inputs.

    Attributes:
        rate: how often it runs [Hz]; a whole part of the simulation's rate.
        memory: its state at the start, a row of numbers.
        gains: its numbers, a row, so that other gains compile nothing anew.
        step: a module's function `(memory, time, measured, reference, gains) -> (memory, inputs)`; `measured` is the
            vehicle's state row and the battery voltage, `reference` the row of `REFERENCES`. JAX traces it. A step with
            an attribute `feels` that is true is given the specific force at the centre of gravity between the two; one
            with `stacks` that is true takes and gives columns of many vehicles too, shape (rows, vehicles).

    One that was designed for late commands may tell them as `delays`, seconds by input. One that only keeps an aircraft
    in the room for an experiment may say `at_once`: unless delays are given, none are flown under it.
    """

    @property
    def rate(self) -> float: ...
    @property
    def memory(self) -> Array: ...
    @property
    def gains(self) -> Array: ...
    @property
    def step(self) -> Step: ...


class LoopTables(NamedTuple):
    """What a flight under a controller is made of, sample by sample of the simulation.

    Attributes:
        start: state row (states,).
        around: `SURROUNDINGS`, shape (n, 4). wanted: `REFERENCES`, (n, 8). added: to the commands, (n, inputs).
        limits: lowest and highest of the inputs, shape (2, inputs).
        late: samples that the commands of each input are late, shape (inputs,).
        first: what the actuators get until the first command arrives, shape (inputs,).
        every: samples of the simulation to one of the controller.
        dt: of a sample [s].
        environment: the air and gravity of all of them.
    """

    start: Array
    around: Array
    wanted: Array
    added: Array
    limits: Array
    late: NDArray[np.int_]
    first: Array
    every: int
    dt: float
    environment: Environment


FlyLoop = Callable[[Controller, LoopTables], tuple[Array, Array]]
"""Flies a controller's samples: states (n, states) and what the actuators got (n, inputs)."""


def flown_delays(
    vehicle: Vehicle, controller: Controller, *, delays: Mapping[str, float] | float | None = None
) -> Array:
    """By how much commands are late in flight, by input [s], shape (inputs,).

    What is given counts first, then what the vehicle's card knows, then what the controller was designed for.
    """
    if delays is None and getattr(controller, "at_once", False):
        delays = 0.0
    if delays is None:
        delays = input_delays(vehicle) or getattr(controller, "delays", {})
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
    fly: FlyLoop | None = None,
) -> Flight:
    """Fly a vehicle under a controller, with an excitation added to what the controller commands.

    A flight that pitches beyond 80 degrees is integrated with a quaternion, as by `simulate`.

    Args:
        vehicle, start, rate, environment: as in `simulate`; inputs are held over a step.
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
    enable_double_precision()
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
    late = steps_late(flown_delays(vehicle, controller, delays=delays), rate)
    waiting = max(_LEAST_WAITING, 1 << (int(late.max()) - 1).bit_length()) if late.any() else 0
    first = _inputs_before(vehicle, start, surroundings) if waiting else np.zeros(len(vehicle.input_names))

    limits = np.array(vehicle.input_limits).T
    tables = LoopTables(x0, around, wanted, added, limits, late, first, round(every), 1.0 / rate, surroundings)

    def flown(as_carried: CarriedAttitude) -> tuple[Array, Array]:
        return _flown_by_xla(as_carried, controller, tables, waiting, parameter_row(vehicle, surroundings))

    states, inputs = flown(with_angles(vehicle, x0)) if fly is None else fly(controller, tables)
    if not vehicle.traits.linear and steep(states):
        states, inputs = flown(with_quaternion(vehicle, x0))
    time, rows = np.arange(n) / rate, np.concatenate([inputs, around], axis=1)
    details = {"rate": rate, "controller_rate": controller.rate, "gravity": float(surroundings.gravity)}
    flight = simulated_flight(vehicle, time, states, rows, details=details)
    check_divergence(vehicle, time, states, flight)
    return flight


def _flown_by_xla(
    as_carried: CarriedAttitude, controller: Controller, tables: LoopTables, waiting: int, p: Array
) -> tuple[Array, Array]:
    n = len(tables.around)
    longer = shared_length(n)
    states, inputs = _fly(
        equations_of(as_carried.vehicle),
        controller.step,
        waiting,
        as_carried.see,
        as_carried.start,
        as_carried.shown,
        jnp.asarray(controller.memory),
        jnp.asarray(controller.gains),
        tuple(lengthened(table, longer) for table in (tables.around, tables.wanted, tables.added)),
        p,
        tables.limits,
        tables.late,
        tables.first,
        tables.every,
        tables.dt,
    )
    return np.asarray(states)[:n], np.asarray(inputs)[:n]


def _inputs_before(vehicle: Vehicle, start: Trim | Mapping[str, float] | None, around: Environment) -> Array:
    """What the actuators get before the first command arrives: the trim's."""
    return np.asarray((start if isinstance(start, Trim) else trim(vehicle, environment=around)).inputs)


def _flying(
    equations: Equations,
    control: Step,
    waiting: int,
    see: Callable[[Any, Any], tuple[Any, Any]],
    x0: Float[jax.Array, " states"],
    shown: Float[jax.Array, " shown"],
    memory: Float[jax.Array, " memory"],
    gains: Float[jax.Array, " gains"],
    tables: tuple[Float[jax.Array, "samples ..."], ...],
    p: Float[jax.Array, " parameters"],
    limits: Float[jax.Array, "2 inputs"],
    late: Int[jax.Array, " inputs"],
    first: Float[jax.Array, " inputs"],
    every: Int[jax.Array, ""],
    dt: Float[jax.Array, ""],
) -> tuple[Any, Any]:
    rates = row_rates(equations, padded=True)
    around, wanted, added = tables

    def sample(carry: tuple[Any, ...], now: tuple[Any, Any, Any]) -> tuple[Any, Any]:
        x, shown, memory, command, sent, k = carry
        surroundings, reference, excitation = now
        acting = _arrived(sent, late) if waiting else jnp.clip(command, limits[0], limits[1])  # until now
        seen, shown = see(x, shown)
        measured = told(control, equations, x, acting, surroundings, p, seen=seen)
        due = k % every == 0

        def decided() -> tuple[Any, Any]:
            return control(memory, k * dt, measured, reference, gains)

        if getattr(control, "feels", False):  # too much work to be thrown away between its samples
            memory, command = jax.lax.cond(due, decided, lambda: (memory, command))
        else:
            fresh_memory, fresh = decided()
            memory, command = jnp.where(due, fresh_memory, memory), jnp.where(due, fresh, command)
        inputs = jnp.clip(command + excitation, limits[0], limits[1])
        if waiting:
            sent = jnp.concatenate([inputs[None], sent[:-1]])
            inputs = _arrived(sent, late)
        w = jnp.concatenate([inputs, surroundings])
        after = rk4_step(lambda x, w: rates(x, w, p), x, lambda _: w, dt, looped=True)
        return (after, shown, memory, command, sent, k + 1), (seen, inputs)

    nothing = jnp.zeros(added.shape[1])
    sent = jnp.broadcast_to(jnp.asarray(first), (waiting + 1, added.shape[1]))
    _, record = jax.lax.scan(
        sample, (jnp.asarray(x0), jnp.asarray(shown), memory, nothing, sent, 0), (around, wanted, added)
    )
    return record


def _arrived(sent: Float[jax.Array, "commands inputs"], late: Int[jax.Array, " inputs"]) -> Any:
    """Of each input the command of so many steps ago; `sent` has the newest first."""
    return jnp.take_along_axis(sent, late[None, :], axis=0)[0]


_fly = jit(static_argnums=(0, 1, 2, 3), compiler_options=QUICK_FLIGHT)(_flying)


def told(
    control: Step,
    equations: Equations,
    x: Float[jax.Array, " states"],
    inputs: Float[jax.Array, " inputs"],
    surroundings: Float[jax.Array, " surroundings"],
    p: Float[jax.Array, " parameters"],
    *,
    seen: Float[jax.Array, " seen"] | None = None,
) -> Any:
    """What a controller is given as `measured`: the state (as `seen`, with Euler angles, where `x` has others), the
    specific force if it feels it, the voltage."""
    shown = x if seen is None else seen
    if not getattr(control, "feels", False):
        return jnp.concatenate([shown, surroundings[-1:]])
    return jnp.concatenate(
        [shown, row_force(equations)(x, jnp.concatenate([inputs, surroundings]), p), surroundings[-1:]]
    )


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
