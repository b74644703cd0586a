"""Many closed loops at once: one controller on many vehicles, each in its own gusts, with its own sensor noise."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.errors import CardError, SwashError
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.batch import Batch
from swashplate.simulation.closed_loop import REFERENCES, Controller, Step, flown_delays
from swashplate.simulation.compilation import QUICK_FLIGHT, lengthened, shared_length
from swashplate.simulation.dynamics import enable_double_precision, row_force, row_rates
from swashplate.simulation.late import quantised, quantum_of, steps_late
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.trigonometry import vector_backend
from swashplate.simulation.trim import Trim, surroundings_of_start
from swashplate.simulation.trim import trim as find_trim
from swashplate.simulation.tumbling import CarriedAttitude, steep_at, with_angles, with_quaternion

LANES = 8
"""Vehicles that one compiled program flies side by side, or a whole multiple where the controller's step says so
(`block`): whatever their number, few programs fly them. A vehicle costs as much as in blocks of 256 (raptor50 under
ArduPilot's law 6.4 and 6.9 ms for 4 s, the CoaX under its autopilot 3.7 and 3.4 ms): its loop fits into a cache."""

Carry = Callable[[Vehicle, Array], CarriedAttitude]
_THETA = RigidBody._fields.index("theta")


def simulate_closed_loops(
    vehicle: Vehicle,
    controller: Controller,
    *,
    duration: float,
    size: int,
    parameters: Mapping[str, ArrayLike] | None = None,
    reference: Mapping[str, ArrayLike] | None = None,
    excitation: Mapping[str, ArrayLike] | None = None,
    wind: Mapping[str, ArrayLike] | None = None,
    voltage: ArrayLike | None = None,
    noise: Mapping[str, float] | None = None,
    delay: ArrayLike = 0.0,
    delays: Mapping[str, float] | float | None = None,
    seed: int = 0,
    start: Trim | None = None,
    rate: float = 500.0,
    keep: int = 1,
    environment: Environment | None = None,
    bits: int | None = None,
) -> Batch:
    """Fly one controller on many vehicles; without noise it agrees with `simulate_closed_loop` at the same rates.

    Args:
        vehicle: the equations and the numbers that `parameters` does not replace.
        controller: see `swashplate.simulation.closed_loop.Controller`; the same for all.
        duration: [s].
        size: number of vehicles.
        parameters: numbers of the card by name, shape (size,) each.
        reference: as in `simulate_closed_loop`, numbers or series (n,) at the controller's rate, the same for all.
        excitation: series (n,) by input name at the controller's rate, added to every vehicle's commands.
        wind, voltage: numbers, series (n,) or (n, size) at the controller's rate, held between samples.
        noise: standard deviation of the white noise on a measured state, by its name [its unit].
        delay: by how much more the commands of each vehicle are late [s], a number or shape (size,).
        delays: from command to actuator [s], one for all or by input; where not given those of `flown_delays`. The sum
            is rounded up to the steps of the physics. Before the first command arrives the actuators get those of the
            start.
        seed: of that noise.
        start: where all start; the hover of `vehicle` where it is not given.
        rate: of the physics [Hz], a whole multiple of the controller's.
        keep: every how many samples of the controller one is kept.
        environment: air, gravity, and wind and voltage where they are not given.
        bits: in which a command is told over the range of its input; None for exact commands.

    Returns:
        States, inputs and surroundings at the kept samples. A vehicle that is lost has numbers that are not finite.
        One that pitches beyond 80 degrees is integrated with a quaternion, as by `simulate`.
    """
    enable_double_precision()
    substeps = rate / controller.rate
    if substeps < 1.0 or abs(substeps - round(substeps)) > 1e-9:
        raise SwashError(
            f"the physics runs at {rate:g} Hz, expected a multiple of the controller's {controller.rate:g}."
        )
    samples = round(duration * controller.rate) // keep * keep
    if samples < 1 or size < 1:
        raise SwashError(f"{samples} samples of {size} vehicles, expected at least one of each.")
    begin = start or find_trim(vehicle, environment=environment)
    surroundings = surroundings_of_start(vehicle, begin, environment)
    given: dict[str, Any] = {**(wind or {}), **({} if voltage is None else {"voltage": voltage})}
    around = np.stack(
        [_series(name, given.get(name, getattr(surroundings, name)), samples, size) for name in SURROUNDINGS], 1
    )
    states = begin.states()
    wanted = np.stack(
        [_series(n, (reference or {}).get(n, states.get(n, 0.0)), samples, 1)[:, 0] for n in REFERENCES], 1
    )
    added = np.stack([_series(n, (excitation or {}).get(n, 0.0), samples, 1)[:, 0] for n in vehicle.input_names], 1)
    flown_for = _length(samples, size, keep)
    p = np.repeat(parameter_row(vehicle, surroundings)[:, None], size, axis=1)
    for name, values in (parameters or {}).items():
        if name not in vehicle.parameter_names:
            raise CardError("is not a parameter of the vehicle.", where=vehicle.name, channel=name)
        p[vehicle.parameter_names.index(name)] = values
    further = np.broadcast_to(np.asarray(delay, dtype=np.float64), (size,))
    if not np.all(further >= 0.0):
        raise SwashError("is negative or no number.", channel="delay")
    late = steps_late(flown_delays(vehicle, controller, delays=delays)[:, None] + further, rate)
    waiting = _shared_wait(int(np.ceil(late.max() / round(substeps))))
    sigma = np.zeros(len(vehicle.state_names))
    for name, value in (noise or {}).items():
        sigma[vehicle.index(name)] = value

    ranges = np.array(vehicle.input_limits, dtype=np.float64)
    told = np.stack([*ranges.T, quantum_of(ranges, bits)])[:, :, None]
    count = min(-(-size // LANES) * LANES, getattr(controller.step, "block", LANES))

    asked = lengthened(wanted, flown_for), lengthened(added, flown_for)

    def block(carry: Carry, members: NDArray[np.int64], first: int) -> tuple[Array, ...]:
        key = jax.random.fold_in(jax.random.key(seed), first)
        as_carried = carry(vehicle, np.repeat(begin.state[:, None], count, axis=1))
        series = _fly_many(
            equations_of(as_carried.vehicle),
            controller.step,
            round(substeps),
            keep,
            bool(np.any(sigma)),
            waiting,
            samples * size * round(substeps) < _MANY_STEPS,
            as_carried.see,
            as_carried.start,
            as_carried.shown,
            _memories(controller, seed + first + np.arange(count)),
            np.asarray(controller.gains),
            lengthened(around[:, :, members], flown_for),
            *asked,
            p[:, members],
            told,
            sigma[:, None],
            late[:, members],
            begin.inputs,
            key,
            1.0 / rate,
        )
        return tuple(np.asarray(part)[: samples // keep] for part in series)

    def flown_block(first: int) -> tuple[Array, ...]:
        members = np.minimum(first + np.arange(count), size - 1)  # of one size all, so that one program flies them
        states, inputs, pitched = block(with_angles, members, first)
        lost = steep_at(pitched) & ~vehicle.traits.linear
        if lost.any():
            again = block(with_quaternion, members, first)
            states, inputs = (np.where(lost, new, old) for new, old in zip(again, (states, inputs), strict=False))
        return states, inputs

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        parts = list(threads.map(flown_block, range(0, size, count)))
    flown, inputs = (np.concatenate([part[i] for part in parts], axis=2)[:, :, :size] for i in (0, 1))
    kept = np.broadcast_to(around[::keep], (inputs.shape[0], len(SURROUNDINGS), size))
    rows = np.concatenate([inputs, kept], axis=1)
    return Batch(vehicle, np.arange(flown.shape[0]) * keep / controller.rate, flown, rows)


_FEW = 5_000_000
"""Samples of all vehicles together, up to which a third more fly sooner (4 us each) than a loop is compiled (16 s)."""


_MANY_STEPS = 10_000_000
"""Steps of the physics of all vehicles together from which the four stages are written out instead of looped.

Written out, a CoaX compiles for 5.9 instead of 2.8 s, and a step takes 0.74 instead of 0.91 us; a helicopter compiles
for 9.8 instead of 4.6 s, and a step takes as long (4 us).
"""


def _length(samples: int, size: int, keep: int) -> int:
    """How many samples are flown: some more than asked where that spares compiling."""
    return samples if samples * size > _FEW else -(-shared_length(samples) // keep) * keep


def _shared_wait(samples: int) -> int:
    """For how many samples commands are kept: at least so many, a power of two, so that few programs are compiled."""
    return 1 << (samples - 1).bit_length() if samples else 0


def _memories(controller: Controller, seeds: NDArray[np.int64]) -> Array:
    """A column per vehicle; a controller that draws its sensors' biases and noise draws others for each."""
    if hasattr(controller, "memories"):
        return np.asarray(controller.memories(seeds))
    return np.repeat(np.asarray(controller.memory)[:, None], len(seeds), axis=1)


def _series(name: str, values: ArrayLike, samples: int, size: int) -> Array:
    """A series (samples, size or 1) from a number, (n,) or (n, size) with n at least the samples."""
    given = np.asarray(values, dtype=np.float64)
    if given.ndim == 0:
        return np.full((samples, 1 if size == 1 else size), float(given))
    table = given[:, None] if given.ndim == 1 else given
    if table.shape[0] < samples or table.shape[1] not in (1, size):
        raise SwashError(f"has shape {given.shape}, expected ({samples}, {size}) or ({samples},).", channel=name)
    return np.broadcast_to(table[:samples], (samples, size))


def _flying_many(
    equations: Equations,
    control: Step,
    substeps: int,
    keep: int,
    noisy: bool,
    waiting: int,
    looped: bool,
    see: Callable[[Any, Any], tuple[Any, Any]],
    x0: Float[jax.Array, "states vehicles"],
    shown: Float[jax.Array, "shown vehicles"],
    memory: Float[jax.Array, "memory vehicles"],
    gains: Float[jax.Array, " gains"],
    around: Float[jax.Array, "samples surroundings ..."],
    wanted: Float[jax.Array, "samples references"],
    added: Float[jax.Array, "samples inputs"],
    p: Float[jax.Array, "parameters vehicles"],
    told: Float[jax.Array, "3 inputs ..."],
    sigma: Float[jax.Array, ...],
    late: Int[jax.Array, "inputs vehicles"],
    first: Float[jax.Array, " inputs"],
    key: jax.Array,
    dt: Float[jax.Array, ""],
) -> tuple[Any, Any]:
    rates = row_rates(equations, padded=False, xp=vector_backend())
    flying: Any = jax.vmap(
        lambda x, w, p: rk4_step(lambda x, w: rates(x, w, p), x, lambda _: w, dt, looped=looped),
        in_axes=(1, 1, 1),
        out_axes=1,
    )
    deciding: Any = control
    if not getattr(control, "stacks", False):
        deciding = jax.vmap(control, in_axes=(1, None, 1, None, None), out_axes=1)
    voltage = SURROUNDINGS.index("voltage")

    feels = getattr(control, "feels", False)
    feeling: Any = jax.vmap(row_force(equations, xp=vector_backend()), in_axes=(1, 1, 1), out_axes=1)

    def arrived(sent: Float[jax.Array, "commands inputs vehicles"], j: Int[jax.Array, ""] | int) -> Any:
        """What the actuators get in step j of a sample: the command of so many samples ago."""
        ago = jnp.clip(-((j - late) // substeps), 0, waiting)
        return jnp.take_along_axis(sent, ago[None], axis=0)[0]

    def sample(carry: tuple[Any, ...], now: tuple[Any, Any, Any]) -> tuple[Any, Any]:
        x, shown, memory, sent, k = carry
        surroundings, reference, excited = now
        seen, shown = see(x, shown)
        measured = seen
        if noisy:
            measured = seen + sigma * jax.random.normal(jax.random.fold_in(key, k), seen.shape)
        acting = arrived(sent, substeps - 1) if waiting else sent[0]  # until now
        felt = [feeling(x, jnp.concatenate([acting, surroundings]), p)] if feels else []
        measured = jnp.concatenate([measured, *felt, surroundings[voltage][None]])
        memory, command = deciding(memory, k * dt * substeps, measured, reference, gains)
        low, high, quantum = told
        inputs = jnp.clip(quantised(command + excited[:, None], quantum), low, high)
        if not waiting:
            w = jnp.concatenate([inputs, surroundings])
            after, _ = jax.lax.scan(lambda x, _: (flying(x, w, p), None), x, None, length=substeps)
            return (after, shown, memory, inputs[None], k + 1), (seen, inputs)
        sent = jnp.concatenate([inputs[None], sent[:-1]])

        def step(x: Float[jax.Array, "states vehicles"], j: Int[jax.Array, ""]) -> tuple[Any, None]:
            return flying(x, jnp.concatenate([arrived(sent, j), surroundings]), p), None

        after, _ = jax.lax.scan(step, x, jnp.arange(substeps))
        return (after, shown, memory, sent, k + 1), (seen, arrived(sent, 0))

    def kept(carry: Any, now: Any) -> Any:
        carry, (x, inputs) = jax.lax.scan(sample, carry, now)
        return carry, (x[0], inputs[0], jnp.nanmax(jnp.abs(x[:, _THETA]), axis=0))

    tables = tuple(part.reshape(-1, keep, *part.shape[1:]) for part in (around, wanted, added))
    sent = jnp.broadcast_to(first[None, :, None], (waiting + 1, first.shape[0], x0.shape[1]))
    _, record = jax.lax.scan(kept, (jnp.asarray(x0), jnp.asarray(shown), jnp.asarray(memory), sent, 0), tables)
    return record


_fly_many = jit(static_argnums=(0, 1, 2, 3, 4, 5, 6, 7), compiler_options=QUICK_FLIGHT)(_flying_many)
