"""Delays of single entries of G: right in responses, slopes, fits, records and loops; refused in words elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swashplate.control.analysis.rate_loop_steps import RATE, stepped
from swashplate.errors import SwashError
from swashplate.export.formats import export_model
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.linear_simulation import answers
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.models.surroundings import input_delays, known_delays

TEXT = """
kind = "state-space"
name = "roll with a late second path"
[states]
p = "rad/s"
b = "rad"
[inputs]
lateral = "1"
[equations]
p = {p = "Lp", b = "Lb", lateral = "Llat"}
b = {b = "-4", p = "-1", lateral = "Blat"}
[outputs.p]
of = {p = "1"}
[outputs.b]
unit = "rad"
of = {b = "1"}
[delays]
lateral = "tau"
"p_dot/lateral" = "late"
[parameters]
Lp = -3.0
Lb = 12.0
Llat = {value = 6.0, unit = "rad/s^2"}
Blat = {value = 1.5, unit = "rad/s"}
tau = {value = 0.02, unit = "s", lower = 0.0, upper = 0.3}
late = {value = 0.09, unit = "s", lower = 0.0, upper = 0.3}
"""
OMEGA = np.geomspace(0.5, 40.0, 60)


@pytest.fixture(scope="module")
def model() -> StateSpaceModel:
    return parse(TEXT)


def by_hand(model: StateSpaceModel, omega: np.ndarray) -> np.ndarray:
    """H of the two entries, each with its delay, (n, outputs)."""
    v = model.numbers()
    a = np.array([[v["Lp"], v["Lb"]], [-1.0, -4.0]])
    h = []
    for w in omega:
        g = [v["Llat"] * np.exp(-1j * w * v["late"]), v["Blat"] * np.exp(-1j * w * v["tau"])]
        h.append(np.linalg.solve(1j * w * np.eye(2) - a, g))
    return np.array(h)


def test_responses_and_slopes_are_those_of_the_equations(model: StateSpaceModel) -> None:
    np.testing.assert_allclose(model.response(OMEGA)[:, :, 0], by_hand(model, OMEGA), rtol=1e-12)
    numbers = np.array([model.parameters[n].value for n in model.free])
    (h,), (slopes,) = model.sensitivities(model.free, numbers, [(1, 0, OMEGA)])
    np.testing.assert_allclose(h, by_hand(model, OMEGA)[:, 1], rtol=1e-12)
    for k, name in enumerate(model.free):
        up, down = (by_hand(model.with_values({name: numbers[k] + s}), OMEGA)[:, 1] for s in (1e-6, -1e-6))
        np.testing.assert_allclose(slopes[:, k], (up - down) / 2e-6, rtol=1e-5, atol=1e-7)


def test_a_fit_finds_both_delays_and_one_delay_does_not_do(model: StateSpaceModel) -> None:
    h = model.response(OMEGA)
    one = np.ones(h.shape)
    measured = FrequencyResponse(
        omega=OMEGA, inputs=model.inputs, outputs=model.outputs, response=h, coherence=0.98 * one,
        multiple=0.98 * one[:, :, 0], error=0.02 * one, input_power=one[:, 0], output_power=one[:, :, 0],
        input_coherence=one[:, :1],
    )  # fmt: skip
    begun = model.with_values({"tau": 0.05, "late": 0.05, "Llat": 3.0, "Lb": 8.0})
    found = fit_state_space(begun, measured, starts=1)
    assert max(found.costs) < 0.01
    for name in ("tau", "late"):
        assert found.solution.parameters[name].value == pytest.approx(model.parameters[name].value, abs=1e-4)
    single = fit_state_space(parse(TEXT.replace('"late"', '"tau"').replace("late = {", "# ")), measured, starts=1)
    assert max(single.costs) > 20.0


def test_records_are_flown_with_them(model: StateSpaceModel) -> None:
    dt = 0.01
    time = np.arange(0.0, 6.0, dt)
    u = np.sin(2.0 * np.pi * 0.8 * time)[:, None] * (time[:, None] > 0.5)
    forced, _ = answers(model, ("p", "b"), u, dt)
    x, steps = np.zeros(2), []
    a, b = np.array([[-3.0, 12.0], [-1.0, -4.0]]), np.array([6.0, 1.5])
    fine = 20
    for t in np.arange(time.size * fine) * dt / fine:
        if len(steps) * dt <= t + 1e-9:
            steps.append(x.copy())
        late = np.array([np.interp(t - lag, time, u[:, 0]) for lag in (0.09, 0.02)])
        x = x + dt / fine * (a @ x + b * late)
    assert np.max(np.abs(forced[:, :, 0] - np.array(steps))) < 0.01 * np.ptp(forced)


def test_a_loop_waits_for_each_entry(model: StateSpaceModel) -> None:
    whole = replace(model, delays={"lateral": model.delays["lateral"]})
    gains = {"P": np.array([0.05])}
    early, late = (stepped(m, gains, "p", "lateral", seconds=1.0)[:, 0] for m in (whole, model))
    # 20 and 90 ms after the demand: until the late entry acts, less than half of the rate is there.
    reached = round(0.08 * RATE)
    assert 0.0 < late[reached] < 0.5 * early[reached]


def test_python_control_has_them_as_polynomials(model: StateSpaceModel) -> None:
    pytest.importorskip("control")
    made = model.to_control(pade=4)
    assert list(made.input_labels) == ["lateral"]
    np.testing.assert_allclose(
        np.array([made(1j * w)[:, 0] for w in OMEGA[:30]]), by_hand(model, OMEGA[:30]), rtol=1e-3, atol=1e-4
    )


def test_what_cannot_hold_them_says_so(model: StateSpaceModel) -> None:
    vehicle = linear_vehicle(model)
    for refused in (
        lambda: model.delay("p", "lateral"),
        lambda: input_delays(vehicle),
        lambda: known_delays(vehicle),
        lambda: export_model(vehicle, "matlab", name="roll"),
        lambda: export_model(vehicle, "c", name="roll"),
    ):
        with pytest.raises(SwashError, match=r"entr(y|ies) of G|single entries"):
            refused()
    left = export_model(vehicle, "matlab", name="roll", delays=False)
    assert any("p_dot/lateral 90 ms" in note for note in left.notes)


@pytest.mark.parametrize(
    ("delay", "words"),
    [
        ('"q_dot/lateral" = "late"', "entries are b_dot/lateral, p_dot/lateral"),
        ('"p_dot/pedal" = "late"', "is no input, no 'output/input' and no 'state_dot/input'"),
        ('"p_dot/lateral" = "late"\n"b/lateral" = "tau"', "expected one kind for an input"),
    ],
)
def test_wrong_names_are_refused(delay: str, words: str) -> None:
    with pytest.raises(SwashError) as caught:
        parse(TEXT.replace('"p_dot/lateral" = "late"', delay))
    assert words in str(caught.value)
