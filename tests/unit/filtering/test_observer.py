"""The observer in flight: as sure as it may be, with and without bar; loops held on it; its C is its graph."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest

from observer_trial import trial
from swashplate.control.kinds import load_controller, save_controller
from swashplate.control.lqg.analysis import analyse
from swashplate.control.lqg.constant_gain import steady_sigmas, with_steady_gain
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.errors import ControllerError
from swashplate.filtering import disturbances
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import ObserverEstimate, arriving, corrected, predicted
from swashplate.filtering.periodic_gain import steady_gains
from swashplate.filtering.sensor_suite import suite
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space_file import structure
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.linearize import linearize
from swashplate.simulation.wind import INDOOR

HIDDEN = ("alpha_lower", "beta_lower", "eta_bar", "zeta_bar")
COMPILER = shutil.which("cc")


@lru_cache(maxsize=1)
def made(*, bar: bool = True) -> Lqg:
    effort = {"motor_lower": 0.04, "motor_upper": 0.04, "servo_roll": 0.1, "servo_pitch": 0.1}  # of the numbers below
    return design(
        vehicle("coax", bar=bar), sensors=suite("imu@100,mocap@50+20ms"), rate=100.0, delays=0.02, effort=effort
    )


def linear() -> Lqg:
    """On a state-space file: 13 identified states, with its delays."""
    return design(linear_vehicle(structure("thirteen_state")), sensors=suite("imu@100,mocap@50+20ms"))


# ---- constant gains --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("which", ["linear", pytest.param("flying", marks=pytest.mark.proof)])
def test_constant_gains_are_the_filters_after_a_long_time(which: str) -> None:
    """The doubled Riccati map against the filter's own covariance, sample by sample, at rest."""
    controller = {"flying": made, "linear": linear}[which]()
    plan, numbers = controller.plan, controller.numbers
    gains, covariances = steady_gains(plan, numbers, linearize(controller.vehicle, controller.start), 2)
    assert gains.shape == (2, len(plan.names), 12)
    assert not np.any(gains[1][:, 6:])  # no motion capture in between
    estimate = ObserverEstimate(controller.first_estimate().mean, covariances[0])
    w, M, N = casadi.DM([*controller.start.inputs, controller.start.environment.voltage]), Matrices(), len(plan.names)
    mean, P, due = given = [casadi.MX.sym(*size) for size in (("mean", N), ("P", N, N), ("due", 2))]
    y = M.value(lambda e, w: arriving(plan, numbers, e, w, M.xp), mean, w)
    after, _, _ = corrected(plan, numbers, ObserverEstimate(mean, P), y, M.scalars(due), w, M)
    sample = casadi.Function("sample", given, predicted(plan, numbers, after, w, M.scalars(due), M))
    mean, P = estimate
    for flags in ([1.0, 1.0], [1.0, 0.0]):
        mean, P = sample(mean, P, flags)
    sigma = np.sqrt(np.diag(covariances[0]))
    assert np.max(np.abs(np.asarray(P) - covariances[0]) / np.outer(sigma, sigma)) < 1e-3
    assert np.max(np.abs(np.asarray(mean) - estimate.mean)[:, 0] / sigma) < 1e-3


@pytest.mark.proof
def test_with_constant_gains_it_is_as_sure_as_it_may_be(tmp_path: Path) -> None:
    controller = with_steady_gain(made())
    found = trial(controller.vehicle, controller, duration=12.0, seeds=range(2), gusts=INDOOR)
    for state in found.states:  # attitude too, although offsets are unknown at the start
        assert state.within >= 0.98, found
        assert 0.5 < state.nees < 2.0, found
    assert np.sqrt(np.mean(found.place**2)) < 0.08
    save_controller(controller, tmp_path / "c.toml")
    again = load_controller(tmp_path / "c.toml")
    assert isinstance(again, Lqg)
    assert again.plan == controller.plan
    np.testing.assert_array_equal(again.memory_of_law(), controller.memory_of_law())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"sensors": ()}, "gain: has no observer"),
        (
            {"sensors": suite("imu@100,mocap@100"), "holding": "speed", "speeds": (0.0, 1.0)},
            "good about one trim",
        ),
        (
            {"sensors": suite("imu@500,mocap@100,sonar@31.25"), "rate": 500.0},
            "repeats only after 80 samples",
        ),
    ],
)
def test_constant_gains_that_cannot_be(options: dict[str, Any], said: str) -> None:
    with pytest.raises(ControllerError, match=said):
        with_steady_gain(design(vehicle("coax"), **options))


@pytest.mark.proof
def test_the_observer_is_as_sure_as_it_may_be() -> None:
    """Hidden states within three sigmas 98 % of the time and (error / sigma)^2 of 0.5 to 2, in gusts, held on it."""
    controller = made()
    found = trial(controller.vehicle, controller, duration=12.0, seeds=range(2), gusts=INDOOR)
    for name in HIDDEN:
        assert found.of(name).within >= 0.98, found
        assert 0.5 < found.of(name).nees < 2.0, found
    expected = analyse(controller).uncertainty
    for name in ("alpha_lower", "eta_bar", "omega_lower"):
        assert found.of(name).sigma == pytest.approx(expected[name], rel=0.15)
    assert np.sqrt(np.mean(found.place**2)) < 0.08
    assert np.sqrt(np.mean(found.height**2)) < 0.04


@pytest.mark.proof
@pytest.mark.parametrize("bar", [True, False])
def test_many_flights_with_and_without_the_bar(bar: bool) -> None:
    controller = made(bar=bar)
    found = trial(controller.vehicle, controller, duration=20.0, seeds=range(40), gusts=INDOOR)
    for state in found.states:
        if state.name in HIDDEN:
            assert state.within >= 0.98, found
            assert 0.5 < state.nees < 2.0, found
    assert np.sqrt(np.mean(found.place**2)) < 0.06
    assert np.max(found.place) < 0.12


@pytest.mark.proof
def test_the_raptor_is_held_and_flown_to_ten_metres_a_second() -> None:
    """Gains from the 13 states of body, rotor, bar and yaw loop (and place, height, heading) over speed."""
    raptor = vehicle("raptor50", bar=True, gyro=True)
    sensors = suite("gyro@100,mocap@100")
    held = design(raptor, sensors=sensors, delays=0.02)
    flight = simulate_closed_loop(raptor, held, duration=15.0, reference={"x": 1.0}, rate=500.0)
    assert np.max(np.abs(flight.between(12.0, 15.0).values("x") - 1.0)) < 0.03
    fast = design(raptor, sensors=sensors, delays=0.02, holding="speed", speeds=(0.0, 5.0, 10.0))
    flight = simulate_closed_loop(raptor, fast, duration=20.0, reference={"ahead": 10.0}, rate=500.0)
    assert np.max(np.abs(flight.between(17.0, 20.0).values("u") - 10.0)) < 0.1
    assert np.max(np.abs(flight.values("z"))) < 0.06
    assert np.max(np.abs(flight.values("psi"))) < 0.1


# ---- its C -----------------------------------------------------------------------------------------------------------
@lru_cache(maxsize=3)
def in_python(which: str) -> tuple[Lqg, Any]:
    """A controller, and its step by the virtual machine: memory, measured, reference to memory and commands."""
    controller = {"flying": made, "steady": lambda: with_steady_gain(made()), "linear": linear}[which]()
    graph, size = controller.graph(), controller.inner_memory.size

    def step(memory: Any, measured: Any, reference: Any) -> Any:
        after = np.asarray(graph(memory, measured, reference)).ravel()
        return after[:size], after[size:]

    return controller, step


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("which", "precision", "tolerance"),
    [
        pytest.param("flying", "double", 1e-12, marks=pytest.mark.proof),
        pytest.param("flying", "float", 3e-4, marks=pytest.mark.proof),
        ("steady", "double", 1e-12),
        ("steady", "float", 2e-4),
        ("linear", "double", 1e-12),
    ],
)
def test_the_c_step_is_the_graph(which: str, precision: str, tolerance: float, tmp_path: Path) -> None:
    """Commands and estimates in units of their sigmas, covariances in units of their diagonal, step by step.

    In single precision the first reading, which shrinks a variance a thousand times, costs most: 1.7e-4.
    """
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    from swashplate.export.controller_c import controller_code

    controller, step = in_python(which)
    code = controller_code(controller, precision=precision)  # type: ignore[arg-type]
    assert set(code.calls) <= {"sin", "cos", "sqrt", "atan2"}
    assert "malloc" not in code.source
    file, library = tmp_path / "controller.c", tmp_path / "controller.so"
    file.write_text(code.source)
    assert COMPILER is not None
    strict = ["-std=c99", "-pedantic", "-Werror", "-O1", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *strict, "-o", library, file, "-lm"], check=True)
    function = ctypes.CDLL(str(library)).swash_step_in
    kind, real = (np.float64, ctypes.c_double) if precision == "double" else (np.float32, ctypes.c_float)

    plan = controller.plan
    random, N = np.random.default_rng(0), len(plan.names)
    promised = steady_sigmas(controller) if plan.period else np.zeros(0)
    (work,) = (int(found) for found in re.findall(r"#define SWASH_WORK (\d+)", code.source))
    gravity = np.where([name == "imu.az" for name in plan.channels], -9.81, 0.0)
    memory, worst = controller.inner_memory, 0.0
    for _ in range(60):
        measured = np.append(gravity + 0.02 * random.standard_normal(len(plan.channels)), 11.5)
        reference = 0.1 * random.standard_normal(8)
        after, commands = (np.asarray(part) for part in step(memory, measured, reference))
        given = (memory, measured, reference, np.zeros(4), np.full(work, np.nan))
        rows = [np.ascontiguousarray(row, dtype=kind) for row in given]
        function(*(row.ctypes.data_as(ctypes.POINTER(real)) for row in rows))
        sigma, rest = promised, after[N:]
        if not plan.period:
            sigma, rest = np.sqrt(np.diag(after[N : N + N * N].reshape(N, N))), after[N + N * N :]
        known = [] if plan.period else [np.outer(sigma, sigma).ravel()]
        scale = np.concatenate([sigma, *known, np.maximum(1.0, np.abs(rest))])
        worst = max(worst, float(np.max(np.abs(rows[0] - after) / scale)), float(np.max(np.abs(rows[3] - commands))))
        memory = after
    assert worst < tolerance


def test_gusts_beside_an_estimated_wind_are_not_all_that_disturbs() -> None:
    card = vehicle("coax").card
    calm = {name: float(value) for name, value in Noise(gust_horizontal=1e-3)._asdict().items()}
    assert disturbances.unrest_of(replace(card, observer={"noise": calm})).force < 1e-3
    assert disturbances.unrest_of(replace(card, observer={"noise": {**calm, "wind": 0.5}})) == disturbances.Unrest()
