"""Stitched models against the nonlinear helicopters that their points are of, at speeds between the points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from proof_page import leave
from swashplate.api.verbs.vehicle import stitch
from swashplate.arrays import Array
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim, trim

AXES = {"theta0": "w", "B1": "q", "A1": "p", "theta0T": "r"}
STEP = np.radians(0.2)
RATE = 200.0
STATES = ("u", "v", "w", "p", "q", "r")


@dataclass(frozen=True)
class Distance:
    """How far a stitched model is from the truth at a speed.

    Attributes:
        controls: largest difference of the trims' controls, part of the travel.
        attitude: largest difference of the trims' angles [rad].
        accelerations: of linear and angular accelerations near the trim, error over truth (rms).
        steps: by input, of the response on its own axis after one and two seconds, error over truth (rms).
    """

    controls: float
    attitude: float
    accelerations: tuple[float, float]
    steps: Mapping[str, tuple[float, float]]


def response(flown: Vehicle, at: Trim, name: str) -> Array:
    """Deviation from trim after a step of one input, rows of u, v, w, p, q, r."""
    inputs = {key: np.full(int(2.0 * RATE) + 1, value) for key, value in at.commands().items()}
    inputs[name] = inputs[name] + STEP
    flight = simulate_open_loop(flown, inputs, start=at, rate=RATE)
    return flight.array(STATES).T - np.array([[at.states()[key]] for key in STATES])


def distance(stitched: Vehicle, truth: Vehicle, speed: float, *, flown: bool = True) -> Distance:
    """Of trims, accelerations and, where it is flown, steps."""
    ours, theirs = trim(stitched, speed=speed), trim(truth, speed=speed)
    travel = np.array([high - low for low, high in truth.input_limits])
    steps = {}
    for name, axis in AXES.items() if flown else ():
        a, b = (response(one, at, name)[STATES.index(axis)] for one, at in ((stitched, ours), (truth, theirs)))
        ends = [int(seconds * RATE) for seconds in (1.0, 2.0)]
        steps[name] = tuple(float(np.linalg.norm((a - b)[:k]) / np.linalg.norm(b[:k])) for k in ends)
    return Distance(
        float(np.max(np.abs(ours.inputs - theirs.inputs) / travel)),
        float(np.max(np.abs(ours.state - theirs.state)[6:8])),
        _accelerations(stitched, truth, theirs),
        steps,  # type: ignore[arg-type]
    )


def _accelerations(stitched: Vehicle, truth: Vehicle, at: Trim) -> tuple[float, float]:
    rng, calm = np.random.default_rng(3), Environment()
    size = np.repeat([0.0, 0.1, 0.01, 0.02, 0.002], (3, 3, 3, 3, len(at.state) - 12))
    found = []
    for _ in range(40):
        x = at.state + size * rng.standard_normal(size.size)
        u = at.inputs + 0.002 * rng.standard_normal(at.inputs.size)
        found.append([np.array(one.rates(x, u, one.values(), calm)) for one in (stitched, truth)])
    ours, theirs = np.array(found).transpose(1, 0, 2)
    share = [np.linalg.norm((ours - theirs)[:, k]) / np.linalg.norm(theirs[:, k]) for k in (slice(3, 6), slice(9, 12))]
    return float(share[0]), float(share[1])


def stitched_from(truth: Vehicle, speeds: Sequence[float]) -> Vehicle:
    return stitch([linearize(truth, trim(truth, speed=float(speed))) for speed in speeds])


@pytest.mark.parametrize("flown", [False, pytest.param(True, marks=pytest.mark.proof)])
def test_half_way_between_two_points(flown: bool) -> None:
    """The R-MAX at 7.5 m/s from points at 5 and 10 m/s: every step within 5 %, trims within 0.1 % of the travel."""
    truth = vehicle("rmax")
    found = distance(stitched_from(truth, (5.0, 10.0)), truth, 7.5, flown=flown)
    assert found.controls < 1e-3
    assert found.attitude < np.radians(0.01)
    assert max(found.accelerations) < 0.05
    assert len(found.steps) == (len(AXES) if flown else 0)
    assert all(max(pair) < 0.05 for pair in found.steps.values())


ONE_REGIME = {"rmax": 20.0, "raptor50": 17.5}
"""Up to which speed [m/s] the points are of one regime: at 20 m/s the Raptor's tailplane gives all the lift it can. A
point there has lost the tail's damping (q by q: -0.10 instead of -0.41 1/s), and no speed below 19.9 m/s has."""


@pytest.mark.proof
def test_between_points_of_two_helicopters() -> None:
    rows, worst, beyond = [], {}, []
    for name in ("rmax", "raptor50"):
        truth = vehicle(name)
        for spacing in (5.0, 2.5):
            points = np.arange(0.0, 20.0 + spacing / 2, spacing)
            flown = stitched_from(truth, points)
            between = points[:-1] + spacing / 2
            far = [distance(flown, truth, float(speed)) for speed in between]
            for speed, d in zip(between, far, strict=True):
                told = [f"{100 * a:.1f} / {100 * b:.1f}" for a, b in d.steps.values()]
                linear, angular = d.accelerations
                rows.append(
                    [name, spacing, float(speed), f"{100 * d.controls:.2f}", f"{np.degrees(d.attitude):.3f}",
                     f"{100 * linear:.1f}", f"{100 * angular:.1f}", *told]
                )  # fmt: skip
            within = [d for d, upper in zip(far, points[1:], strict=True) if upper <= ONE_REGIME[name]]
            steps = [max(pair) for d in within for pair in d.steps.values()]
            good = sum(s <= 0.05 for s in steps)
            worst[name, spacing] = max(steps), good, len(steps), max(d.controls for d in within)
            beyond += [max(max(pair) for pair in d.steps.values()) for d in far if d not in within]
    said = "; ".join(
        f"{name} every {spacing:g} m/s: {good} of {every} steps, the worst {100 * most:.1f} %"
        for (name, spacing), (most, good, every, _) in worst.items()
    )
    leave(
        "stitched-flight",
        {
            "title": "Stitched models between their points",
            "text": "Points linearised from hover to 20 m/s, against the nonlinear helicopter half way between them. "
            f"Steps of {np.degrees(STEP):.1f} deg from trim, open loop; error over truth (rms) on the step's own axis "
            f"within 1 and 2 s. Within 5 %: {said}. Not counted: raptor50 above {ONE_REGIME['raptor50']:g} m/s, "
            f"where its tailplane saturates at the last point (there up to {100 * max(beyond):.0f} %).",
            "columns": [
                "helicopter", "points every [m/s]", "speed [m/s]", "controls [% of travel]", "attitude [deg]",
                "linear acc. [%]", "angular acc. [%]", *(f"{axis} after {name} [%]" for name, axis in AXES.items()),
            ],
            "rows": rows,
            "passed": worst["rmax", 5.0][1] == worst["rmax", 5.0][2],
        },
    )  # fmt: skip
    assert all(controls < 2e-3 for *_, controls in worst.values())
    assert worst["rmax", 5.0][0] < 0.05
    assert worst["raptor50", 2.5][0] < 0.05
    assert min(beyond) > 0.05  # a point of another regime is seen
