"""Open-loop predictions of multirotor flights that no fit saw, beside rivals trained on the flights of the fit.

    python scripts/multirotor_scores.py --model LABEL=MODEL.toml ... --fit FLIGHT ... --on FLIGHT ...

MODEL.toml is what `swash identify --vehicle crazyflie ... --out FOLDER` wrote; a flight may have a window (FILE@8-30).
Predictions start every 0.1 s, run 0.5 s at 100 Hz on the logged commands and voltage, and are scored by mean absolute
errors over the axes. A model starts from its own observer, which has seen the flight up to the start; everything else
from measured motion. The first five seconds of each flight tell a model that flight's constants; nothing is scored
there. "Textbook" is the card before the identification.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from multirotor_rivals import RIVALS, Motion, Rival, motion
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbed_model import Nuisance, stochastic_model
from swashplate.filtering.nuisance import PUSHES
from swashplate.flights.readers.read import read
from swashplate.identification.core.records import Record, records
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.simulation.compilation import enable_compilation_cache
from swashplate.simulation.dynamics import enable_double_precision, jax_backend
from swashplate.validation.calibration import CALIBRATION, calibrate
from swashplate.validation.prediction import naive, predict
from swashplate.validation.validate import observer_of, started_from

AHEAD, EVERY = 50, 10
"""Samples of 10 ms."""
SHOWN = (10, 50)
GROUPS = {
    "position m": slice(0, 3),
    "velocity m/s": slice(3, 6),
    "attitude deg": slice(6, 9),
    "rates rad/s": slice(9, 12),
}
SLOW = 3.0
"""Hz below which the acceleration along body z is compared."""
BODY = len(PREDICTED)
EDGE = 10
"""Samples at a record's end whose measured motion has too few samples around it."""
Places = NDArray[np.intp]


@partial(jax.jit, static_argnums=(0, 1))
def flown(
    model: Any, of: Any, body: Any, inner: Any, inputs: Any, voltage: Any, par: Any, push: Any, starts: Any
) -> Any:
    """States after each start (s, AHEAD, 12) from measured motion, and the specific force along it (n, 3)."""
    vehicle = of.vehicle

    def along(inside: Any, here: Any) -> Any:
        row, u, volts = here
        after = model.step(jnp.concatenate([row, inside]), push, u, par, volts)
        return after[BODY:], inside

    _, inside = jax.lax.scan(along, inner, (body, inputs, voltage))

    def felt(row: Any, inside: Any, u: Any, volts: Any) -> Any:
        x = jnp.concatenate([row, inside])
        nested = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
        told = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
        force = vehicle.specific_force(nested, told, par, Environment(voltage=volts, air_density=1.2), jax_backend())
        return jnp.stack(force) + push[:3]

    def run(start: Any) -> Any:
        def sample(x: Any, k: Any) -> Any:
            x = model.step(x, push, inputs[k], par, voltage[k])
            return x, x[:BODY]

        first = jnp.concatenate([body[start], inside[start]])
        return jax.lax.scan(sample, first, start + jnp.arange(AHEAD))[1]

    return jax.vmap(run)(starts), jax.vmap(felt)(body, inside, inputs, voltage)


def open_loop(vehicle: Vehicle, record: Record, nuisance: Nuisance, starts: Places) -> tuple[Array, Array]:
    """Predictions (s, AHEAD, 12) from measured motion and the specific force (n, 3) of a vehicle."""
    model = stochastic_model(vehicle, record.output_names, record.dt)
    body, par = measured_states(record, nuisance), jax.tree.map(jnp.asarray, vehicle.values())
    reaching = commands(vehicle, record.dt, jnp.asarray(record.inputs), nuisance)
    told = vehicle.inputs(*(reaching[0][i] for i in range(len(vehicle.input_names))))
    settled = vehicle.traits.settled
    assert settled is not None
    inside = settled(told, vehicle.values(), record.voltage[0], None)
    inner = jnp.stack([jnp.asarray(inside[name]) for name in vehicle.state_names[BODY:]])
    push = jnp.array([float(getattr(nuisance, name)) for name in PUSHES])
    voltage = jnp.asarray(record.voltage)
    found = flown(model, model.equations, jnp.asarray(body), inner, reaching, voltage, par, push, starts)
    return np.asarray(found[0]), np.asarray(found[1])


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


def share(found: Array, truth: Array, dt: float, after: int) -> tuple[float, float, float]:
    """R^2 below `SLOW`, the same without what is constant in the flight, and the spread of the truth [m/s^2]."""
    sos = butter(4, SLOW, fs=1.0 / dt, output="sos")
    a, b = (sosfiltfilt(sos, row)[after : -round(0.3 / dt)] for row in (found, truth))
    spread, off = float(np.sum((b - b.mean()) ** 2)), a - b
    return 1.0 - float(np.sum(off**2)) / spread, 1.0 - float(np.sum((off - off.mean()) ** 2)) / spread, float(b.std())


def of_files(names: Sequence[str], vehicle: Vehicle) -> list[Record]:
    """Records of at least calibration and a prediction."""
    flights = [read(name).condition(rate=100.0, cutoff=0.0) for name in names]
    shortest = CALIBRATION + 2.0 * AHEAD * 0.01
    return [r for flight in flights for r in records(flight, vehicle) if r.time[-1] - r.time[0] > shortest]


def seen(record: Record) -> Motion:
    """A record as the rivals see it."""
    body = measured_states(record, Nuisance())
    return motion(body, record.inputs, record.voltage, record.dt, calibration=CALIBRATION)


def main(models: dict[str, Vehicle], fitted: Sequence[str], held_out: Sequence[str]) -> None:
    enable_double_precision()
    enable_compilation_cache()
    first = next(iter(models.values()))
    training = [seen(record) for record in of_files(fitted, first)]
    rivals: dict[str, Rival] = {}
    for label, make in RIVALS.items():
        began = time.process_time()
        rivals[label] = make(training)
        print(f"{label}: trained in {time.process_time() - began:.0f} s of processor time")
    textbook = {"textbook quadrotor (the card)": started_from(first)}
    found: dict[str, list[Array]] = {}
    for record in of_files(held_out, first):
        starts = np.arange(round(CALIBRATION / record.dt), record.time.size - AHEAD - EDGE, EVERY)
        plain = measured_states(record, Nuisance())
        for kind, label in (("hold", "hold"), ("rates", "constant velocity and rates")):
            ahead = [naive(plain, starts, k, record.dt, kind=kind) for k in range(1, AHEAD + 1)]
            found.setdefault(label, []).append(errors(np.stack(ahead, axis=1), plain, starts))
        for label, vehicle in (textbook | models).items():
            noise, prior = observer_of(vehicle)
            nuisance = calibrate(vehicle, record, noise=noise, prior=prior)
            body = measured_states(record, nuisance)
            states, force = open_loop(vehicle, record, nuisance, starts)
            if label in models:
                told = predict(vehicle, record, noise=noise, nuisance=nuisance, horizon=AHEAD * record.dt,
                               every=EVERY * record.dt, settling=CALIBRATION)  # fmt: skip
                states = told.states[np.isin(told.starts, starts)]
                whole, moved, spread = share(force[:, 2], measured_force(body, record.dt), record.dt, int(starts[0]))
                print(
                    f"{record.name}: {label}: delay {1e3 * float(nuisance.delay_motor):.0f} ms; acceleration along z "
                    f"below {SLOW:g} Hz ({spread:.2f} m/s^2): R^2 {whole:.2f}, {moved:.2f} without its constant error"
                )
            found.setdefault(label, []).append(errors(states, body, starts))
        for label, rival in rivals.items():
            found.setdefault(label, []).append(errors(rival(seen(record), starts, AHEAD), plain, starts))
    print(f"\nmean absolute error after {' and '.join(f'{h / 100:g} s' for h in SHOWN)}")
    heads = [group.split()[0] + f" {h / 100:g}" for group in GROUPS for h in SHOWN]
    print("| predictor | " + " | ".join(heads) + " |\n|---" * 1 + "|---" * len(heads) + "|")
    for label, parts in found.items():
        mean = np.concatenate(parts).mean(axis=0)
        cells = [f"{mean[h - 1, g]:.3g}" for g in range(len(GROUPS)) for h in SHOWN]
        print(f"| {label} | " + " | ".join(cells) + " |")
    print(f"{sum(len(part) for part in found['hold'])} starts")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", action="append", required=True, metavar="LABEL=MODEL.toml")
    parser.add_argument("--fit", nargs="+", required=True, metavar="FLIGHT")
    parser.add_argument("--on", nargs="+", required=True, metavar="FLIGHT")
    given = parser.parse_args()
    main({m.split("=", 1)[0]: sp.vehicle(m.split("=", 1)[1]) for m in given.model}, given.fit, given.on)
