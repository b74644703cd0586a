"""Is a poor verdict in roll and pitch the model's fault? The same judge on a flight whose truth is the model itself.

    python scripts/multirotor_verdict.py --model MODEL.toml --on FLIGHT

The model flies the attitudes that the autopilot of a real flight (NanoBench) asked for, under a controller of that
flight's kind and gains, through gusts as strong as the fit says. The record of it is predicted on the recorded commands
by the model that made it, as `validate` does. Then the same without gusts, and with the loop closed: the controller's
law and the attitudes asked for in the place of the recorded commands. Last, the real flight both ways. Fit % one second
ahead, beside what the past alone predicts.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from multirotor_scores import EDGE, of_files, percent, table

import swashplate as sp
from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import PUSHES, Nuisance
from swashplate.identification.core.records import Record
from swashplate.identification.time.calibration import CALIBRATION, calibrate
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.vehicle import Vehicle
from swashplate.validation.black_box import ceiling
from swashplate.validation.flight_floors import motion_of
from swashplate.validation.metrics import fit_percent
from swashplate.validation.prediction import predict
from swashplate.validation.validate import observer_of

AHEAD, EVERY, SEED = 100, 10, 7
ANGLES, RATES = (6, 7), (9, 10)
SHOWN = {"φ": 6, "θ": 7, "p": 9, "q": 10}
MIX = np.array([[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, 1.0, 1.0]]) / 4.0
"""Motors to roll, pitch, yaw and lift; its rows are orthogonal, so that 4 MIX' goes back. Signs do not matter here."""
HOLD = {"z": 0.25, "w": 0.2, "psi": 0.1, "r": 0.05}
"""Gains that keep height and heading in the simulated flight."""


class Law(NamedTuple):
    """Roll and pitch as a controller makes them: offsets (2,), gains on what is asked for, attitude and rate (2, 3)."""

    offset: Any
    gains: Any
    lag: int


def asked(path: str, record: Record) -> Array:
    """The roll and pitch that the autopilot asked for (n, 2) [rad], at the record's samples."""
    with Path(path.split("@")[0]).open() as file:
        rows = list(csv.DictReader(file))
    t = np.array([float(row["t"]) for row in rows])
    wanted = np.array([[float(row["pid_controller_roll"]), float(row["pid_controller_pitch"])] for row in rows])
    return np.stack([np.interp(record.time, t - t[0], np.radians(column)) for column in wanted.T], axis=1)


def law_of(record: Record, body: Array, wanted: Array, last: int) -> Law:
    """A controller from the first samples: each axis by what is asked for, attitude and rate, some samples ago."""
    mixed = record.inputs @ MIX[:2].T
    best: tuple[float, Law] | None = None
    for lag in range(9):
        offset, gains, left = np.zeros(2), np.zeros((2, 3)), 0.0
        for i in range(2):
            moved = np.stack([wanted[:, i], body[:, ANGLES[i]], body[:, RATES[i]]], axis=1)[50 - lag : last - lag]
            rows = np.column_stack([np.ones(last - 50), moved])
            solution, *_ = np.linalg.lstsq(rows, mixed[50:last, i], rcond=None)
            offset[i], gains[i] = solution[0], solution[1:]
            left += float(np.var(mixed[50:last, i] - rows @ solution) / np.var(mixed[50:last, i]))
        if best is None or left < best[0]:
            best = left, Law(offset, gains, lag)
    assert best is not None
    print(f"law: {np.round(best[1].gains, 4).tolist()}, {best[1].lag} samples late, leaves {50 * best[0]:.0f} %")
    return best[1]


def answered(law: Law, wanted: Any, body: Any) -> Any:
    """Roll and pitch commands (..., 2)."""
    moved = jnp.stack([wanted, body[..., jnp.array(ANGLES)], body[..., jnp.array(RATES)]], axis=-1)
    return law.offset + jnp.sum(law.gains * moved, axis=-1)


def flown(vehicle: Vehicle, record: Record, wanted: Array, law: Law, noise: Noise, *, gusts: float) -> Record:
    """The record of a flight in which the model is the truth."""
    model = stochastic_model(vehicle, record.output_names, record.dt, noise=noise)
    par, voltage = jax.tree.map(jnp.asarray, vehicle.values()), float(record.voltage.mean())
    hover = vehicle.traits.hover
    assert hover is not None
    states, level = hover(vehicle.values(), voltage, np)  # type: ignore[arg-type]
    x = jnp.array([float(states.get(name, 0.0)) for name in vehicle.state_names])
    rng, step = np.random.default_rng(SEED), jax.jit(model.step)
    gust, fade, n = np.zeros(6), np.asarray(model.fade(noise)), len(record.time)
    sizes = np.array([noise.gust_horizontal] * 2 + [noise.gust_vertical] + [noise.gust_tilt] * 2 + [noise.gust_yaw])
    rows, inputs = np.empty((n, len(PREDICTED))), np.empty((n, 4))
    level_row, lean = np.asarray(level), law._replace(offset=np.zeros(2))
    for k in range(n):
        rows[k] = np.asarray(x)[: len(PREDICTED)]
        seen = rows[max(k - law.lag, 0)]
        tilt = np.asarray(answered(lean, wanted[max(k - law.lag, 0)], seen))
        named = dict(zip(PREDICTED, seen, strict=True))
        hold = [-HOLD["psi"] * named["psi"] - HOLD["r"] * named["r"], HOLD["z"] * named["z"] + HOLD["w"] * named["w"]]
        yaw = np.sign(np.sum(MIX[2] * [-s for s in vehicle.card.options["senses"]])) * hold[0]
        inputs[k] = np.clip(level_row + 4.0 * np.concatenate([tilt, [yaw, hold[1]]]) @ MIX, 0.0, 1.0)
        x = step(x, jnp.asarray(gust), jnp.asarray(inputs[k]), par, voltage)
        gust = fade * gust + gusts * sizes * np.sqrt(record.dt) * rng.standard_normal(6)
    seen_by = np.array([noise.sensor_position] * 3 + [noise.sensor_angle] * 3 + [noise.sensor_rate] * 3)
    read = rows[:, [0, 1, 2, 6, 7, 8, 9, 10, 11]]
    outputs = read + seen_by * rng.standard_normal(read.shape)
    return replace(record, inputs=inputs, outputs=outputs, voltage=np.full(n, voltage))


def closed(
    vehicle: Vehicle, record: Record, nuisance: Nuisance, body: Array, wanted: Array, law: Law, starts: Array
) -> Array:
    """States (s, AHEAD, 12) from measured motion with roll and pitch as the law makes them of what is asked for."""
    model = stochastic_model(vehicle, record.output_names, record.dt)
    par = jax.tree.map(jnp.asarray, vehicle.values())
    reaching = np.asarray(commands(vehicle, record.dt, jnp.asarray(record.inputs), nuisance))
    push = jnp.array([float(getattr(nuisance, name)) for name in PUSHES])
    settled = vehicle.traits.settled
    assert settled is not None
    step = jax.jit(jax.vmap(model.step, in_axes=(0, None, 0, None, 0)))
    speeds = np.zeros((len(starts), 4))
    keep = float(np.exp(-record.dt / vehicle.card.parameters["tau_drive"].value))
    held = np.stack(
        [
            list(settled(u, vehicle.values(), v, None, 0.0).values())
            for u, v in zip(reaching, record.voltage, strict=True)
        ]
    )
    speed = held[0]
    for k in range(int(starts.max()) + 1):
        speed = keep * speed + (1.0 - keep) * held[k]
        speeds[starts == k] = speed
    past = [body[starts - i] for i in range(law.lag, -1, -1)]
    x, made = jnp.asarray(np.concatenate([body[starts], speeds], axis=1)), []
    reference = record.inputs @ MIX[:2].T - np.asarray(answered(law, wanted, body))
    level = np.stack([reference[s - 50 : s].mean(axis=0) for s in starts])  # what the law leaves, e.g. its integral
    for k in range(AHEAD):
        tilt = np.asarray(answered(law, wanted[np.maximum(starts + k - law.lag, 0)], jnp.asarray(past[-1 - law.lag])))
        u = reaching[starts + k] + 4.0 * (tilt + level - reaching[starts + k] @ MIX[:2].T) @ MIX[:2]
        x = step(x, push, jnp.asarray(np.clip(u, 0.0, 1.0)), par, jnp.asarray(record.voltage[starts + k]))
        past.append(np.asarray(x)[:, : len(PREDICTED)])
        made.append(past[-1])
    return np.stack(made, axis=1)


def told(vehicle: Vehicle, record: Record, nuisance: Nuisance, wanted: Array) -> list[list[str]]:
    """Fits one second ahead: on recorded commands, with the loop closed, and by the past alone."""
    noise, _ = observer_of(vehicle)
    body, first = measured_states(record, nuisance), round(CALIBRATION / record.dt)
    starts = np.arange(first, record.time.size - AHEAD - EDGE, EVERY)
    truth, begin = body[starts + AHEAD], body[starts]
    predicted = predict(vehicle, record, noise=noise, nuisance=nuisance, horizon=1.0, every=0.1, settling=CALIBRATION)
    recorded = predicted.states[np.isin(predicted.starts, starts), AHEAD - 1]
    law = law_of(record, body, wanted, first)
    looped = closed(vehicle, record, nuisance, body, wanted, law, starts)[:, -1]
    box = ceiling([motion_of(record, body, starts)], AHEAD * record.dt)
    past = 100.0 * (1.0 - np.sqrt(np.mean(box.past[0], axis=0) / np.mean((truth - begin) ** 2, axis=0)))
    leak = np.full(12, np.nan) if box.leak is None else box.leak
    fits = {
        "on recorded commands": fit_percent(recorded, truth, begin),
        "loop closed": fit_percent(looped, truth, begin),
        "past alone": past,
        "error that later inputs take away": leak,
    }
    return [[name, *(percent(float(fit[i])) for i in SHOWN.values())] for name, fit in fits.items()]


def main(vehicle: Vehicle, path: str) -> None:
    (record, _), *_ = of_files([path], vehicle)
    noise, prior = observer_of(vehicle)
    nuisance = calibrate(vehicle, record, noise=noise, prior=prior)
    wanted = asked(path, record)
    body = measured_states(record, nuisance)
    law = law_of(record, body, wanted, round(CALIBRATION / record.dt))
    lines = []
    still = Nuisance()
    for words, gusts in (("the model is the truth, gusts", 1.0), ("the model is the truth, no gusts", 0.0)):
        made = flown(vehicle, record, wanted, law, noise, gusts=gusts)
        lines += [[f"{words}: {row[0]}", *row[1:]] for row in told(vehicle, made, still, wanted)]
    lines += [[f"the real flight: {row[0]}", *row[1:]] for row in told(vehicle, record, nuisance, wanted)]
    print(table(["fit % one second ahead", *SHOWN], lines))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", required=True)
    parser.add_argument("--on", required=True)
    given = parser.parse_args()
    main(sp.vehicle(given.model), given.on)
