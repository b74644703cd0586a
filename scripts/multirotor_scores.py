"""Open-loop predictions of multirotor flights that no fit saw, beside predictors without a fit: one table.

    python scripts/multirotor_scores.py MODEL.toml FLIGHT [FLIGHT ...]

MODEL.toml is what `swash identify --vehicle crazyflie ... --out FOLDER` wrote; a flight may have a window (FILE@8-30).
Predictions start every 0.1 s from measured motion, run 0.5 s at 100 Hz on the logged commands and voltage, and are
scored by mean absolute errors over the axes. The first five seconds of each flight tell a model that flight's delay,
lever arm and heading of the tracked body; nothing is scored there. "Textbook" is the card before the identification.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbed_model import Nuisance, stochastic_model
from swashplate.flights.readers.read import read
from swashplate.identification.core.records import Record, records
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.simulation.dynamics import enable_double_precision, jax_backend
from swashplate.validation.calibration import CALIBRATION, calibrate
from swashplate.validation.prediction import naive, predict
from swashplate.validation.validate import observer_of, started_from

AHEAD, EVERY = 50, 10
"""Samples of 10 ms."""
SHOWN = (1, 10, 25, 50)
GROUPS = {
    "position m": slice(0, 3),
    "velocity m/s": slice(3, 6),
    "attitude deg": slice(6, 9),
    "rates rad/s": slice(9, 12),
}
SLOW = 3.0
"""Hz below which the acceleration along body z is compared."""
BODY = len(PREDICTED)
Places = NDArray[np.intp]


@partial(jax.jit, static_argnums=(0, 1))
def flown(model: Any, vehicle_of: Any, body: Any, inner: Any, inputs: Any, voltage: Any, par: Any, starts: Any) -> Any:
    """Inner states along the measured motion (n, m), states after each start (s, AHEAD, 12), specific force (n, 3)."""
    calm, vehicle = jnp.zeros(model.n_gusts), vehicle_of.vehicle

    def along(inside: Any, here: Any) -> Any:
        row, u, volts = here
        after = model.step(jnp.concatenate([row, inside]), calm, u, par, volts)
        return after[BODY:], inside

    _, inside = jax.lax.scan(along, inner, (body, inputs, voltage))

    def felt(row: Any, inside: Any, u: Any, volts: Any) -> Any:
        x = jnp.concatenate([row, inside])
        nested = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
        told = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
        return jnp.stack(vehicle.specific_force(nested, told, par, Environment(voltage=volts), jax_backend()))

    def run(start: Any) -> Any:
        def sample(x: Any, k: Any) -> Any:
            x = model.step(x, calm, inputs[k], par, voltage[k])
            return x, x[:BODY]

        first = jnp.concatenate([body[start], inside[start]])
        return jax.lax.scan(sample, first, start + jnp.arange(AHEAD))[1]

    return inside, jax.vmap(run)(starts), jax.vmap(felt)(body, inside, inputs, voltage)


def open_loop(vehicle: Vehicle, record: Record, nuisance: Nuisance, starts: Places) -> tuple[Array, Array, Array]:
    """Measured body states (n, 12), predictions (s, AHEAD, 12) and the specific force (n, 3) of a vehicle."""
    model = stochastic_model(vehicle, record.output_names, record.dt)
    body, par = measured_states(record, nuisance), jax.tree.map(jnp.asarray, vehicle.values())
    reaching = commands(vehicle, record.dt, jnp.asarray(record.inputs), nuisance)
    told = vehicle.inputs(*(reaching[0][i] for i in range(len(vehicle.input_names))))
    settled = vehicle.traits.settled
    assert settled is not None
    inside = settled(told, vehicle.values(), record.voltage[0], None)
    inner = jnp.stack([jnp.asarray(inside[name]) for name in vehicle.state_names[BODY:]])
    voltage = jnp.asarray(record.voltage)
    _, states, force = flown(model, model.equations, jnp.asarray(body), inner, reaching, voltage, par, starts)
    return body, np.asarray(states), np.asarray(force)


def in_the_room(states: Array) -> Array:
    """States with velocities in local axes and angles in degrees, shape (..., 12)."""
    out = np.array(states)
    angles = out[..., 6:9].reshape(-1, 3)
    turned = Rotation.from_euler("ZYX", angles[:, ::-1]).apply(out[..., 3:6].reshape(-1, 3))
    out[..., 3:6] = turned.reshape(out[..., 3:6].shape)
    out[..., 6:9] = np.degrees(out[..., 6:9])
    return out


def errors(states: Array, truth: Array, starts: Places) -> Array:
    """Absolute errors (s, AHEAD, 4): the mean over the axes of each group."""
    later = truth[starts[:, None] + 1 + np.arange(AHEAD)]
    off = in_the_room(states) - in_the_room(later)
    off[..., 6:9] = (off[..., 6:9] + 180.0) % 360.0 - 180.0
    return np.stack([np.abs(off[..., part]).mean(axis=-1) for part in GROUPS.values()], axis=-1)


def measured_force(body: Array, dt: float) -> Array:
    """Specific force along body z [m/s^2] from the tracked motion, shape (n,)."""
    u, v, w, phi, theta, _, p, q, _ = body[:, 3:].T
    return np.asarray(np.gradient(w, dt) + p * v - q * u - LABORATORY_GRAVITY * np.cos(phi) * np.cos(theta))


def share(found: Array, truth: Array, dt: float, after: int) -> tuple[float, float]:
    """R^2 below `SLOW`, with constant errors counted and without."""
    sos = butter(4, SLOW, fs=1.0 / dt, output="sos")
    a, b = (sosfiltfilt(sos, row)[after : -round(0.2 / dt)] for row in (found, truth))
    spread = float(np.sum((b - b.mean()) ** 2))
    off = a - b
    return 1.0 - float(np.sum(off**2)) / spread, 1.0 - float(np.sum((off - off.mean()) ** 2)) / spread


def main(model: str, names: list[str]) -> None:
    enable_double_precision()
    vehicle = sp.vehicle(model)
    rivals = {"textbook quadrotor": started_from(vehicle), "identified": vehicle}
    found: dict[str, list[Array]] = {}
    for name in names:
        flight = read(name).condition(rate=100.0, cutoff=0.0)
        for record in records(flight, vehicle):
            starts = np.arange(round(CALIBRATION / record.dt), record.time.size - AHEAD - 10, EVERY)
            plain = measured_states(record, Nuisance())
            for kind, label in (("hold", "hold"), ("rates", "constant velocity, rates")):
                ahead = [naive(plain, starts, k, record.dt, kind=kind) for k in range(1, AHEAD + 1)]
                found.setdefault(label, []).append(errors(np.stack(ahead, axis=1), plain, starts))
            for label, rival in rivals.items():
                noise, prior = observer_of(rival)
                nuisance = calibrate(rival, record, noise=noise, prior=prior)
                body, states, force = open_loop(rival, record, nuisance, starts)
                found.setdefault(label, []).append(errors(states, body, starts))
                whole, moved = share(force[:, 2], measured_force(body, record.dt), record.dt, int(starts[0]))
                print(
                    f"{record.name}: {label}: delay {1e3 * float(nuisance.delay_motor):.0f} ms, heading of the tracked "
                    f"body {np.degrees(float(nuisance.level_psi)):+.1f} deg, R^2 of acceleration along body z below "
                    f"{SLOW:g} Hz {whole:.3f} ({moved:.3f} without its constant error)"
                )
                if rival is vehicle:
                    seen = predict(rival, record, noise=noise, nuisance=nuisance, horizon=AHEAD * record.dt,
                                   every=EVERY * record.dt, settling=CALIBRATION)  # fmt: skip
                    kept = np.isin(seen.starts, starts)
                    found.setdefault("identified, own observer", []).append(errors(seen.states[kept], body, starts))
    heads = [f"{group} {h}" for group in GROUPS for h in SHOWN]
    print("\nmean absolute error after h samples of 10 ms, and in the last columns the mean over h = 1..50")
    print(f"{'predictor':26}" + "".join(f"{head:>16}" for head in (*heads, *GROUPS)))
    for label, parts in found.items():
        mean = np.concatenate(parts).mean(axis=0)
        cells = [mean[h - 1, g] for g in range(len(GROUPS)) for h in SHOWN] + list(mean.mean(axis=0))
        print(f"{label:26}" + "".join(f"{value:16.4f}" for value in cells))
    print(f"{sum(len(part) for part in found['hold'])} starts in {len(names)} flights")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
