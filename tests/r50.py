"""A Yamaha R-50 in hover, flown: the published 13-state model in a loop, with sweeps, gusts and sensor noise."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

import numpy as np
import tomli_w
from scipy.linalg import expm, solve_continuous_are

from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.flights.provenance import Provenance
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, structure, to_toml

RATE = 100.0
NOISE = {"p": 0.005, "q": 0.005, "r": 0.005, "ax": 0.05, "ay": 0.05, "az": 0.05, "u": 0.03, "v": 0.03, "w": 0.03}
"""Standard deviation of each sensor [rad/s, m/s^2, m/s]."""
AMPLITUDE = {"lateral": 0.3, "longitudinal": 0.4, "pedal": 0.2, "collective": 0.25}
DELAYS = {"tau_lat": 0.03, "tau_lon": 0.03, "tau_ped": 0.02, "tau_col": 0.04}


def truth(data: Path, flight: str = "hover") -> StateSpaceModel:
    """The published derivatives (Mettler, Tischler and Kanade) in the 13-state structure, in hover or at 15 m/s."""
    names = {"tf": "tau_f", "ts": "tau_s"}
    with (data / "vehicles" / "derivs_mettler_r50.csv").open(encoding="utf-8") as file:
        rows = {names.get(r["param"], r["param"]): float(r[f"{flight}_SI"]) for r in csv.DictReader(file)}
    model = without_angles(structure("thirteen_state"))
    model = model.with_values({n: v for n, v in rows.items() if n in model.free} | DELAYS)
    if flight == "cruise":
        model = model.with_values({"U0": 15.0})
    # What is zero is fixed there by Mettler, too.
    absent = [n for n, v in rows.items() if v == 0.0 and n in model.free]
    return model.with_values(dict.fromkeys(absent, 0.0), free=False)


def without_angles(model: StateSpaceModel) -> StateSpaceModel:
    """The ready structure without its angles among the outputs: the flight carries rates, speeds and accelerations."""
    document = tomllib.loads(to_toml(model))
    for name in ("phi", "theta"):
        del document["outputs"][name]
    return parse(tomli_w.dumps(document))


def fly(
    model: StateSpaceModel, axis: str, *, seed: int, seconds: float = 120.0, gust: float = 0.2, size: float = 1.0
) -> Flight:
    """One sweep record: the loop holds the helicopter and moves every control, the pilot mixes a little.

    Args:
        model: the truth.
        axis: input that is swept from 0.05 to 6 Hz.
        seed: of gust and noise.
        seconds: length.
        gust: standard deviation of the wind along each axis [m/s], correlated over 1.5 s.
        size: of the sweep, in `AMPLITUDE`.
    """
    random = np.random.default_rng(seed)
    a, b, c, d = model.explicit()
    n, m, dt = len(model.states), len(model.inputs), 1.0 / RATE
    weights = np.diag(
        [{"u": 0.004, "v": 0.004, "w": 0.002, "phi": 0.05, "theta": 0.05, "r": 0.01}.get(s, 1e-4) for s in model.states]
    )
    gain = np.linalg.solve(np.eye(m), b.T @ solve_continuous_are(a, b, weights, np.eye(m)))
    # Inputs and wind run straight between samples (first-order hold, by an augmented exponential).
    wind = a[:, [model.states.index(s) for s in ("u", "v", "w")]]
    held = np.hstack([b, -wind])
    k = held.shape[1]
    block = np.zeros((n + 2 * k, n + 2 * k))
    block[:n, :n], block[:n, n : n + k] = a, held
    block[n : n + k, n + k :] = np.eye(k) / dt
    step = expm(block * dt)
    phi, g0, g1 = step[:n, :n], step[:n, n : n + k], step[:n, n + k :]
    count = round(seconds * RATE)
    time = np.arange(count) * dt
    sweep = Maneuver("sweep", (axis,), seconds - 6.0, size * AMPLITUDE[axis], (0.05, 6.0)).signals(time - 3.0)[axis]
    place = model.inputs.index(axis)
    mixing = 0.15 * random.standard_normal(m)
    mixing[place] = 1.0
    shake = np.zeros((count, 3))
    for i in range(1, count):
        shake[i] = shake[i - 1] * (1.0 - dt / 1.5) + gust * np.sqrt(2.0 * dt / 1.5) * random.standard_normal(3)
    late = np.array([model.delay(model.outputs[0], name) / dt for name in model.inputs])
    felt = model.matrices()["H1"] @ wind
    commands, delayed = np.zeros((count, m)), np.zeros((count, m))
    outputs, x = np.zeros((count, len(model.outputs))), np.zeros(n)
    for i in range(count):
        commands[i] = mixing * sweep[i] - gain @ x
        for j, steps in enumerate(late):
            whole = int(steps)
            recent, older = (commands[i - k, j] if i >= k else 0.0 for k in (whole, whole + 1))
            delayed[i, j] = recent + (steps - whole) * (older - recent)
        if i:
            before, after = (np.concatenate([delayed[k], shake[k]]) for k in (i - 1, i))
            x = phi @ x + g0 @ before + g1 @ (after - before)
        outputs[i] = c @ x + d @ delayed[i] - felt @ shake[i]
    noise = np.array([NOISE[name] for name in model.outputs])
    measured = outputs + noise * random.standard_normal(outputs.shape)
    columns = {name: measured[:, i] for i, name in enumerate(model.outputs)}
    columns |= {name: commands[:, i] for i, name in enumerate(model.inputs)}
    columns["sweep"] = sweep
    units = dict.fromkeys((*model.inputs, "sweep"), "1")
    return Flight(
        {"uniform": stream(time, columns, units)}, Provenance(source=f"R-50 {axis} sweep {seed}", simulated=True)
    )
