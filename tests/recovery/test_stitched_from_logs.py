"""Logs at four speeds in gusts -> four identified models -> one stitched model -> logs at speeds between them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import swashplate as sp
from proof_page import leave
from swashplate.flights.flight import Flight
from swashplate.identification.frequency.response_cost import cost_of, target
from swashplate.identification.time.equation_error import equation_error
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import dryden, outdoor

RATE = 100.0
CALLED = {"lateral": "A1", "longitudinal": "B1", "pedal": "theta0T", "collective": "theta0"}
NOISE = {"u": 0.05, "v": 0.05, "w": 0.05, "p": 0.01, "q": 0.01, "r": 0.01, "phi": 0.003, "theta": 0.003}
"""Standard deviations of the sensors."""
SHORT = {"lateral": "lat", "longitudinal": "lon", "pedal": "ped", "collective": "col"}
AXES = {"roll": "p", "pitch": "q", "yaw": "r", "heave": "w"}
POINTS, BETWEEN = (5.0, 10.0, 15.0, 20.0), (7.5, 12.5, 17.5)
WINDOW = 2.0
"""Seconds that a prediction runs from a measured state on the recorded inputs; the gusts are not told."""


def flown(truth: Vehicle, speed: float, axis: str) -> Flight:
    """A sweep under a hold, in Dryden gusts of a mean wind of 2 m/s, with noise."""
    size = 0.08 if axis == "yaw" else 0.04
    seed = 10 * int(10 * speed) + list(AXES).index(axis)
    gusts = dryden(outdoor(2.0), samples=int(66 * RATE) + 1, rate=RATE, seed=seed)
    wind = [values.ravel() for values in gusts.values()]
    maneuver = f"sweep:{axis},0.1-4Hz,60s,{size}"
    flight = sp.simulate(truth, maneuver, controller=sp.state_hold, speed=speed, rate=RATE, wind=wind)
    time, noise = flight.time("u"), np.random.default_rng(seed)
    channels = {name: flight.values(name) + s * noise.standard_normal(time.size) for name, s in NOISE.items()}
    channels |= {name: flight.values(old) for name, old in CALLED.items()}
    return Flight.from_arrays(time, channels, source=f"{speed:g} m/s {axis}")


def start_values(logs: Mapping[str, Flight]) -> dict[str, float]:
    """Derivatives by equation error from 0.15 to 1.2 Hz: where the fit to responses begins."""
    joined = {n: np.concatenate([f.values(n) - f.values(n).mean() for f in logs.values()]) for n in (*NOISE, *CALLED)}
    phi, theta = (float(np.mean([f.values(n).mean() for f in logs.values()])) for n in ("phi", "theta"))
    g = 9.81
    weight = {"u": -g * joined["theta"], "v": g * joined["phi"]}
    weight["w"] = -g * (phi * joined["phi"] + theta * joined["theta"])
    by = ("u", "v", "w", "p", "q", "r")
    columns = np.column_stack([joined[name] for name in (*by, *CALLED)])
    found = {}
    for row, letter in zip(by, "XYZLMN", strict=True):
        names = [f"{letter}{name}" for name in (*by, *SHORT.values())]
        measured = np.gradient(joined[row]) * RATE - weight.get(row, 0.0)
        solved = equation_error(measured, columns, names, dt=1.0 / RATE, band=(0.15, 1.2))
        found |= dict(zip(names, map(float, np.real(solved.values)), strict=True))
    return found


def respond(logs: Mapping[str, Flight]) -> sp.FrequencyResponse:
    return sp.respond(list(logs.values()), inputs=tuple(CALLED), outputs=tuple(NOISE))


def identified(logs: Mapping[str, Flight]) -> StateSpaceModel:
    found = sp.fit_ss("six_dof_coupled", respond(logs), start=start_values(logs), starts=1)
    assert found.structure is not None
    return found.structure


def mismatch(stitched: Vehicle, logs: Mapping[str, Flight], speed: float) -> dict[str, float]:
    """J of every response that is coherent, against the stitched model's at that speed, delays included."""
    model, measured = sp.linearize(stitched, sp.trim(stitched, speed=speed)), respond(logs)
    found = {}
    for output in NOISE:
        for name in CALLED:
            wanted = target(measured, output, name)
            if wanted is not None:
                s = 1j * wanted.omega
                x = np.linalg.solve(s[:, None, None] * np.eye(len(model.states)) - model.A, model.B + 0j)
                h = x[:, model.states.index(output), model.inputs.index(name)] * np.exp(
                    -s * model.delays.get(name, 0.0)
                )
                found[f"{output} / {name}"] = cost_of(h, wanted)
    return found


def theil(model: Vehicle, log: Flight, output: str, *, inputs: Mapping[str, str], speed: float) -> float:
    """Theil's coefficient of predictions over windows, of deviations from the model's trim."""
    at, late = sp.trim(model, speed=speed), input_delays(model)
    n, time = int(WINDOW * RATE), log.time("u")
    commands = {own: np.interp(time - late.get(own, 0.0), time, log.values(name)) for own, name in inputs.items()}
    ours, theirs = [], []
    for k in range(int(3 * RATE), time.size - n - 1, n):
        begin = at.states() | {name: float(np.mean(log.values(name)[k - 2 : k + 3])) for name in NOISE}
        window = {name: values[k : k + n + 1] for name, values in commands.items()}
        ours.append(sp.simulate(model, window, start=begin, rate=RATE).values(output) - at.states()[output])
        theirs.append(log.values(output)[k : k + n + 1] - at.states()[output])
    a, b = np.array(ours), np.array(theirs)
    rms = [float(np.sqrt(np.mean(values**2))) for values in (a - b, a, b)]
    return rms[0] / (rms[1] + rms[2])


@pytest.mark.proof
def test_logs_between_the_points_are_predicted() -> None:
    truth = sp.vehicle("rmax")
    models = [identified({axis: flown(truth, speed, axis) for axis in AXES}) for speed in POINTS]
    stitched, bent = sp.stitch(models), sp.stitch(models, gradients="derivatives")
    same = {name: name for name in CALLED}
    rows, means, axes, floors = [], [], [], []
    for speed in BETWEEN:
        logs = {axis: flown(truth, speed, axis) for axis in AXES}
        costs, others = mismatch(stitched, logs, speed), mismatch(bent, logs, speed)
        told = {a: theil(stitched, logs[a], output, inputs=same, speed=speed) for a, output in AXES.items()}
        floor = {
            a: theil(truth, logs[a], output, inputs={o: n for n, o in CALLED.items()}, speed=speed)
            for a, output in AXES.items()
        }
        worst = max(costs, key=lambda name: costs[name])
        means.append((float(np.mean(list(costs.values()))), float(np.mean(list(others.values())))))
        axes.append(told)
        floors.append(floor)
        good = sum(cost <= 100.0 for cost in costs.values())
        rows.append(
            [speed, means[-1][0], f"{good} of {len(costs)}", f"{costs[worst]:.0f} ({worst})", means[-1][1]]
            + [f"{told[a]:.2f} ({floor[a]:.2f})" for a in AXES]
        )
    missed = [
        (speed, axis)
        for speed, told, floor in zip(BETWEEN, axes, floors, strict=True)
        for axis in AXES
        if told[axis] > 0.25 >= floor[axis]
    ]
    leave(
        "stitched-from-logs",
        {
            "title": "A stitched model from logs alone, at speeds between them",
            "text": "Sweeps of a simulated R-MAX under a hold at 5, 10, 15 and 20 m/s, in gusts (0.2 to 0.4 m/s) and "
            "with noise; each speed's responses give a six-degree-of-freedom model with delays, the four are stitched. "
            "Logs at other speeds: J of the responses (mean, how many up to 100, the worst; also with gradients of the "
            f"identified derivatives), Theil's coefficient of {WINDOW:g} s predictions on the swept axis, in brackets "
            "that of the equations that made the logs, which are not told the gusts either. Asked: a mean J up to 100; "
            "0.25 of Theil's coefficient wherever those equations reach it.",
            "columns": [
                "speed [m/s]", "J", "up to 100", "worst J", "J, own gradients", *(f"{o} ({a})" for a, o in AXES.items())
            ],
            "rows": rows,
            "passed": all(j <= 100.0 for j, _ in means) and not missed,
        },
    )  # fmt: skip
    print(*rows, sep="\n")
    assert all(ours <= 100.0 and ours < others for ours, others in means)
    assert missed == []
    assert all(told[axis] <= 0.25 for told in axes for axis in ("roll", "pitch", "yaw"))
