"""Identified delays reach the design, the check and the flights; a loop that does not know of them is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

import swashplate as sp
from made_results import result
from swashplate.api.design_controller import _fast
from swashplate.control.analysis.check import ControlCheck, check_controller, with_delay_verdict
from swashplate.control.analysis.sampled_loop import SampledLoop, sampled_loop
from swashplate.control.analysis.stability import loop_modes, margins_at, margins_of, modes_of
from swashplate.control.draws.variations import draw_models
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.lqg.analysis import analyse
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.control.lqg.optimal import crossover_limits, total_delays
from swashplate.control.lqg.steady_loop import Watched, crossovers
from swashplate.errors import ControllerError
from swashplate.filtering.sensor_suite import suite
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.control_check import compose_check
from swashplate.simulation.closed_loop import flown_delays, simulate_closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.discretisation import held_late, with_late_inputs
from swashplate.simulation.linearize import linearize
from swashplate.simulation.record import steps_late
from swashplate.simulation.trim import Trim

SERVO, MOTOR = 0.034, 0.062
SENSORS = "imu@100,mocap@100+10ms"


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def late(coax: Vehicle) -> Vehicle:
    """The card as a fit writes it: two delays among what belongs to the flights."""
    told = {"nuisance": {"delay_servo": SERVO, "delay_motor": MOTOR, "lever_x": 0.1}}
    return coax.with_card(replace(coax.card, observer=told))


@pytest.fixture(scope="module")
def hover(late: Vehicle) -> Trim:
    return sp.trim(late, voltage=late.card.values()["voltage_nominal"])


@pytest.fixture(scope="module")
def aware(late: Vehicle) -> Lqg:
    return design(late, sensors=suite(SENSORS))


@pytest.fixture(scope="module")
def judged(late: Vehicle, aware: Lqg, hover: Trim) -> ControlCheck:
    return check_controller(late, aware, hover, duration=8.0)


# ---- what is known -------------------------------------------------------------------------------------------------
def test_a_fits_two_delays_are_one_for_every_input(coax: Vehicle, late: Vehicle, aware: Lqg) -> None:
    own = {"motor_lower": MOTOR, "motor_upper": MOTOR, "servo_roll": SERVO, "servo_pitch": SERVO}
    assert input_delays(late) == own
    assert input_delays(coax) == {}
    assert aware.plan.delays == (7, 7, 4, 4)
    # Given counts first, then the card, then what the controller believes.
    np.testing.assert_allclose(flown_delays(late, aware), list(own.values()))
    np.testing.assert_allclose(flown_delays(late, aware, delays=0.01), 0.01)
    np.testing.assert_allclose(flown_delays(coax, aware), [0.07, 0.07, 0.04, 0.04])
    np.testing.assert_allclose(flown_delays(late, sp.hover_hold(late, sp.trim(late))), 0.0)
    assert steps_late(np.array([0.034, 0.0341]), 500.0).tolist() == [17, 18]
    with pytest.raises(ControllerError, match="rudder: expected motor_lower"):
        flown_delays(late, aware, delays={"rudder": 0.1})


# ---- sampled models ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("late_by", [0.0, 0.004, 0.02, 0.027, 0.062])
def test_a_delay_within_a_sample_is_exact(late_by: float) -> None:
    """The sampled model with chains against a fine exponential step by step, a command every 10 ms."""
    A, B = np.array([[0.0, 1.0], [4.0, -0.3]]), np.array([[0.0], [1.0]])
    F, now, before, whole = held_late(A, B, 0.01, [late_by])
    larger, entering, _ = with_late_inputs(F, now, whole, before)
    commands = np.random.default_rng(0).standard_normal(30)
    fine = scipy.linalg.expm(np.block([[A, B], [np.zeros((1, 3))]]) * 0.001)
    x, z = np.zeros(2), np.zeros(len(larger))
    for k, command in enumerate(commands):
        for step in range(10):
            sent = k * 10 + step - round(late_by * 1000)
            x = (fine @ np.append(x, commands[sent // 10] if sent >= 0 else 0.0))[:2]
        z = larger @ z + entering @ [command]
        np.testing.assert_allclose(z[:2], x, atol=1e-12)


def test_late_loops_are_what_late_flights_do(coax: Vehicle) -> None:
    """The autopilot loses the bar's mode between 30 and 36 ms: by eigenvalues, and in nonlinear flight."""
    hover = sp.trim(coax)
    controller = autopilot(coax, hover)
    nudged = hover.__class__(**{**vars(hover), "state": hover.state + 0.02 * (np.arange(len(hover.state)) == 9)})
    for wait, stands in ((0.03, True), (0.036, False)):
        slope = loop_modes(coax, controller, hover, delays={"servo_roll": wait, "servo_pitch": wait})
        assert bool(slope[0].real < 0.0) is stands
        flight = simulate_closed_loop(
            coax, controller, duration=12.0, start=nudged, rate=500.0,
            delays={"servo_roll": wait, "servo_pitch": wait},
        )  # fmt: skip
        rate = np.abs(flight.values("p"))
        grew = rate[flight.time("p") > 9.0].max() > rate[flight.time("p") < 3.0].max()
        assert bool(grew) is not stands


def test_nothing_acts_before_it_can(late: Vehicle, hover: Trim) -> None:
    controller = autopilot(late, hover)
    flown = simulate_closed_loop(late, controller, duration=0.5, reference={"psi": 0.3}, start=hover, rate=500.0)
    for name, wait in input_delays(late).items():
        moved = flown.time(name)[np.abs(flown.values(name) - hover.commands()[name]) > 1e-6]
        assert moved.size == 0 or moved[0] >= wait - 1e-9
        assert name.startswith("servo") or moved[0] < wait + 0.02


def test_many_flights_are_as_late_as_one(late: Vehicle, hover: Trim) -> None:
    controller = autopilot(late, hover)
    one = simulate_closed_loop(late, controller, duration=0.5, reference={"psi": 0.3}, start=hover, rate=500.0)
    many = simulate_closed_loops(late, controller, duration=0.5, size=2, reference={"psi": 0.3}, start=hover)
    np.testing.assert_allclose(many["psi"][:, 0], one.values("psi")[:-1:5], atol=1e-11)
    for name, wait in input_delays(late).items():
        place = late.input_names.index(name)
        moved = np.flatnonzero(np.abs(many.rows[:, place, 0] - hover.inputs[place]) > 1e-6)
        assert moved.size == 0 or many.time[moved[0]] >= wait  # nothing acts before it can


# ---- design --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("delays", [None, *(pytest.param(late, marks=pytest.mark.proof) for late in (0.0, 0.1))])
def test_default_loops_are_no_faster_than_their_delays_allow(late: Vehicle, delays: float | None) -> None:
    made = design(late, sensors=suite(SENSORS), delays=delays)
    model = linearize(late, made.start)
    most = crossover_limits(made.plan, [model])
    found = analyse(made).margins
    for axis, limit in zip(found.axes, most, strict=True):
        assert axis.crossover <= 1.06 * limit
    # The bar's mode at 10 rad/s, which only the servos reach, is held by a loop that crosses above it.
    plain = 1.0 / (3.0 * total_delays(made.plan))
    np.testing.assert_allclose(most[:2], plain[:2])
    np.testing.assert_allclose(most[2:], np.maximum(plain[2:], 1.2 * 9.99), rtol=0.01)
    # What was asked for before this limit is faster, and less of it is left for more delay.
    usual = design(late, sensors=suite(SENSORS), delays=delays, effort={"motor_lower": 0.04, "motor_upper": 0.04})
    loop = Watched(usual.plan, usual.numbers, model, place=True)
    assert crossovers(*loop.sensitivities(np.asarray(usual.feedback.gains)[0])).max() > 1.5 * most[0]


def test_a_loop_that_less_effort_does_not_slow_is_told(aware: Lqg) -> None:
    found = [analyse(aware)]
    assert _fast(aware, found) == ""
    asked = replace(aware, figures={"crossover_limits": {**aware.figures["crossover_limits"], "motor_upper": 1.0}})
    assert "motor_upper at 3." in _fast(asked, found)
    assert "(asked for: 1)" in _fast(asked, found)
    free = replace(aware, figures={"crossover_limits": dict.fromkeys(aware.figures["crossover_limits"], np.inf)})
    assert _fast(free, found) == ""


def test_computation_is_a_delay_of_every_input(late: Vehicle) -> None:
    made = design(late, computation=0.009)
    assert made.plan.delays == (8, 8, 5, 5)
    assert np.all(total_delays(made.plan, computation=0.009) < total_delays(made.plan))
    with pytest.raises(ControllerError, match="computation: is -1 s"):
        design(late, computation=-1.0)


# ---- check ---------------------------------------------------------------------------------------------------------
def test_a_design_that_knows_no_delay_is_refused_and_its_flights_are_lost(
    coax: Vehicle, late: Vehicle, hover: Trim
) -> None:
    """The same design on an aircraft without delays has no problems: `test_control_check`."""
    blind = design(coax, sensors=suite(SENSORS))
    found = check_controller(late, blind, hover, duration=5.0)
    assert found.margins is None
    assert found.slowest.real > 1.0
    assert any("growing mode" in words for words in found.problems)
    assert found.in_gusts is None
    heading = next(step for step in found.steps if step.reference == "psi")
    assert heading.metrics.overshoot > 1.0  # it circles


def test_a_design_that_knows_them_flies_as_late_as_the_aircraft_is(judged: ControlCheck) -> None:
    assert judged.problems == ()
    assert judged.delays == {"motor_lower": MOTOR, "motor_upper": MOTOR, "servo_roll": SERVO, "servo_pitch": SERVO}
    assert judged.slowest.real < -0.03
    assert judged.margins is not None
    assert judged.margins.together.alpha > 0.7
    assert all(axis.gain > 10.0 ** (6.0 / 20.0) and np.degrees(axis.phase) > 45.0 for axis in judged.margins.axes)
    assert judged.in_gusts is not None
    assert judged.in_gusts.place < 0.03
    assert judged.in_gusts.heading < np.radians(1.0)
    heading = next(step for step in judged.steps if step.reference == "psi")
    assert heading.metrics.overshoot < 0.2
    assert heading.metrics.settling < 4.0


def fit_of(late: Vehicle, folder: Path) -> sp.Result:
    """What a fit wrote, read again."""
    found = result(late, {"tau_f_upper": 1.6, "linkage_lower": 0.1355}, np.diag([0.1, 0.005]) ** 2)
    found.save(folder / "fit.json")
    return sp.load(folder / "fit.json")


def test_a_fits_file_keeps_its_delays(late: Vehicle, aware: Lqg, tmp_path: Path) -> None:
    fit = fit_of(late, tmp_path)
    assert input_delays(fit.model) == input_delays(late)
    assert design(fit.model, sensors=suite(SENSORS)).plan.delays == aware.plan.delays


@pytest.mark.proof
def test_from_a_fits_file_to_an_aircraft_that_flies_in_short(late: Vehicle, tmp_path: Path) -> None:
    """What a fit wrote, read again, designed on, and flown late and in gusts on an aircraft that the fit allows.

    The whole chain, from a real log and with a hundred aircraft, quantised and with a tired battery, is
    `recovery/test_log_to_flight`; this one has the shapes that are compiled above.
    """
    fit = fit_of(late, tmp_path)
    made = design(fit.model, sensors=suite(SENSORS))
    drawn = {name: float(values[0]) for name, values in draw_models(fit.model, fit, count=1, seed=3).items()}
    assert abs(drawn["tau_f_upper"] - 1.6) > 0.05
    aircraft = fit.model.with_values(drawn)
    rest = sp.trim(aircraft, voltage=12.22)
    flown = check_controller(aircraft, made, rest, duration=8.0)
    assert flown.problems == ()
    assert flown.in_gusts is not None
    assert flown.in_gusts.place < 0.25
    assert flown.in_gusts.heading < np.radians(10.0)


def test_the_loop_of_the_law_is_the_map_of_the_aircraft_with_its_commands_on_their_way(late: Vehicle) -> None:
    """Two routes again: chains in the analysis, and the derivative of the step in front of chains."""
    fed = design(late)
    on_its_way = sampled_loop(late, fed, fed.start, delays=fed.delays)
    modes = analyse(fed).modes
    flown = np.log(np.linalg.eigvals(on_its_way.matrix).astype(complex) + 1e-300) * 100.0
    for mode in modes[:12]:
        assert np.min(np.abs(np.exp(flown / 100.0) - np.exp(mode / 100.0))) < 1e-4


# ---- delay margins -------------------------------------------------------------------------------------------------
def integrator(gain: float, rate: float = 10.0) -> SampledLoop:
    """x' = u, u = -gain x held for a sample, at any delay."""

    def made(further: np.ndarray) -> SampledLoop:
        F, G, before, whole = held_late(np.zeros((1, 1)), np.ones((1, 1)), 1.0 / rate, further.tolist())
        F, G, added = with_late_inputs(F, G, whole, before)
        command = np.zeros((1, 1 + len(added)))
        command[0, 0] = -gain
        names, none = ("x", *map(str, added)), (np.zeros((0, 1 + len(added))), np.zeros((1, 8)), np.zeros((0, 8)))
        return SampledLoop(names, ("u",), rate, F, G, command, *none, later=lambda extra: made(further + extra))

    return made(np.zeros(1))


@pytest.mark.parametrize("samples", [2, 3, 5])
def test_delay_margin_of_a_sampled_integrator_is_that_on_paper(samples: int) -> None:
    """z^(d+1) - z^d + g T = 0 has a pair on the unit circle at g T = 2 sin(pi / (4 d + 2)): fast or slow."""
    rate = 10.0
    loop = integrator(2.0 * rate * np.sin(np.pi / (4 * samples + 2)))
    found = margins_of(loop)
    assert found.axes[0].delay == pytest.approx(samples / rate, rel=0.01)
    assert found.delay == pytest.approx(samples / rate, rel=0.01)


def test_phase_over_crossover_is_a_delay_that_puts_a_mode_on_the_boundary(coax: Vehicle) -> None:
    """Found from the frequency response alone, and then by eigenvalues of the loop with that delay in it."""
    hover = sp.trim(coax)
    loop = sampled_loop(coax, autopilot(coax, hover), hover)
    by_phase, by_modes = margins_at(loop, exact=False), margins_at(loop)
    assert loop.later is not None
    sets = {axis.name: (axis.delay, exact.delay) for axis, exact in zip(by_phase.axes, by_modes.axes, strict=True)}
    sets["all"] = by_phase.delay, by_modes.delay
    assert by_modes.least_delay == pytest.approx(0.031, abs=0.003)
    for name, (guess, exact) in sets.items():
        assert guess == pytest.approx(exact, rel=0.03)
        chosen = np.array([name in ("all", own) for own in loop.inputs], dtype=float)
        assert modes_of(loop.later(0.96 * guess * chosen))[0].real < 0.0
        assert modes_of(loop.later(1.04 * guess * chosen))[0].real > 0.0


def test_a_delay_margin_that_is_too_small_is_a_problem(judged: ControlCheck) -> None:
    assert judged.delay_boundary.level1 == 10.0  # a sample at 100 Hz
    assert judged.margins is not None
    least = judged.margins.least_delay
    assert 0.03 < least < 0.2
    assert with_delay_verdict(judged, 0.95 * least).problems == ()
    (said,) = with_delay_verdict(judged, 1.05 * least).problems
    assert said.startswith("Delay margin: ")
    assert "all inputs together" in said
    page = compose_check(with_delay_verdict(judged, 1.05 * least))
    assert page.summary[1][2] == "bad"
    assert "of further delay" in page.summary[1][1]
    assert compose_check(judged).summary[1][2] != "bad"
