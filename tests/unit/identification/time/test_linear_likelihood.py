"""Slopes of a linear model's errors along records, by every kind of entry, against differences of the cost itself."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rolling import SAME, TRUTH
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.result import Estimate
from swashplate.identification.identify import identify
from swashplate.identification.time.linear_filter import FilterErrors
from swashplate.identification.time.linear_likelihood import LinearErrors
from swashplate.identification.time.linear_problem import hold_remarks, linear_records, torn
from swashplate.identification.time.linear_simulation import driven
from swashplate.models.linear.state_space_file import parse, structure
from swashplate.simulation.discretisation import first_order_hold

MODEL = structure("rotor_body").with_values(
    {"Lb": 300.0, "Ma": 80.0, "tau_f": 0.07, "Ba": 0.5, "Ab": -0.5, "Blat": 0.2, "Blon": -0.05, "Alat": 0.05,
     "Alon": 0.25, "tau_roll": 0.053, "tau_pitch": 0.047}
)  # fmt: skip


def _flight(seed: int, seconds: float) -> Flight:
    random = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 0.02)
    table = {name: random.standard_normal(time.size) for name in (*MODEL.inputs, *MODEL.outputs)}
    units = dict.fromkeys(MODEL.inputs, "1")
    return Flight({"uniform": stream(time, table, units)}, Provenance(source=f"log {seed}", simulated=True))


@pytest.mark.parametrize("method", ["output-error", "prediction-error", "filter-error"])
def test_the_gradient_is_the_slope_of_the_cost_by_every_entry(method: str) -> None:
    outputs, biases = MODEL.outputs, MODEL.outputs[:1]
    pieces, delays = linear_records(MODEL, [_flight(1, 3.0), _flight(2, 2.4)], outputs, biases=biases)
    kind = FilterErrors if method == "filter-error" else LinearErrors
    likelihood = kind(MODEL, outputs, pieces, True, biases, delays=delays, gain=method != "output-error")
    row = likelihood.row.starts() + 0.01 * np.random.default_rng(3).standard_normal(len(likelihood.row))
    for _ in range(1 if method != "filter-error" else 50):  # its gain depends on the covariance
        likelihood.refresh(row)
    gradient = likelihood.scores(row)[1]
    step = 1e-5
    slopes = [
        (likelihood.cost(row + step * e) - likelihood.cost(row - step * e)) / (2 * step) for e in np.eye(row.size)
    ]
    np.testing.assert_allclose(gradient, slopes, rtol=1e-4, atol=1e-5 * np.max(np.abs(gradient)))
    groups = {entry.group for entry in likelihood.row.entries}
    assert groups >= {"parameter", "initial", "nuisance"} | (set() if method == "output-error" else {"noise"})


@pytest.mark.parametrize("samples", [1, 2, 7, 50])
def test_states_in_pieces_are_those_one_after_the_other(samples: int) -> None:
    random = np.random.default_rng(samples)
    phi, start = np.array([[1.02, 0.3], [-0.2, 0.7]]), random.standard_normal((3, 2))
    push = random.standard_normal((samples, 3, 2))
    x, expected = start, []
    for now in push:
        expected.append(x)
        x = x @ phi.T + now
    every, after = driven(start, phi, push)
    np.testing.assert_allclose(every, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(after, x, rtol=1e-12, atol=1e-12)


def test_a_first_gain_is_likelier_and_moves_nothing_else() -> None:
    pieces, delays = linear_records(MODEL, [_flight(1, 3.0), _flight(2, 2.4)], MODEL.outputs, biases=())
    likelihood = LinearErrors(MODEL, MODEL.outputs, pieces, True, (), delays=delays, gain=True)
    plain, begun = likelihood.row.starts(), likelihood.begun()
    assert likelihood.cost(begun) < likelihood.cost(plain)
    noise = np.array([entry.group == "noise" for entry in likelihood.row.entries])
    np.testing.assert_array_equal(begun[~noise], plain[~noise])
    still = LinearErrors(MODEL, MODEL.outputs, pieces, True, (), delays=delays, gain=False)
    np.testing.assert_array_equal(still.begun(), still.row.starts())


def test_a_fit_far_from_the_one_that_it_comes_from_says_so() -> None:
    known = replace(MODEL.parameters["Lb"], cramer_rao=3.0)
    start = replace(MODEL, parameters={**MODEL.parameters, "Lb": known})
    far, near = (Estimate("Lb", "1/s^2", 300.0, value, sigma=4.0) for value in (270.0, 280.0))
    unknown = Estimate("Ma", "1/s^2", 80.0, 8.0, sigma=0.1)  # its start comes from no fit
    (words,) = torn([far, unknown], start)
    assert "1 of the model's parameters" in words
    assert "Lb 300 before, 270 now" in words
    assert torn([near, unknown], start) == []


def test_the_delay_of_a_held_input_has_half_a_sample_of_the_hold_in_it() -> None:
    """Two samples of delay, held and straight: the fit is exact for a straight input, and says 2.5 of a held one."""
    delayed = SAME.replace("[parameters]", '[delays]\nstick = "late"\n[parameters]\nlate = {value = 0.03, lower = 0.0}')
    model, dt, random = parse(delayed).with_values(TRUTH), 0.02, np.random.default_rng(4)
    stick = 0.2 * np.sin((np.arange(400) * dt) ** 2)  # up to 2.5 Hz
    a, b, c, _ = model.explicit()
    late, found = np.concatenate([[stick[0]] * 2, stick[:-2]]), []
    phi, g0, g1 = first_order_hold(a, b, dt)
    for slope in (0.0, 1.0):
        x = [np.zeros(2)]
        for now, then in pairwise(late):
            x.append(phi @ x[-1] + g0[:, 0] * now + slope * g1[:, 0] * (then - now))
        seen = np.array(x) @ c.T + random.standard_normal((400, 3)) * [0.002, 0.06, 0.004]
        columns = {"stick": stick, **dict(zip(model.outputs, seen.T, strict=True))}
        flown = Flight({"uniform": stream(np.arange(400) * dt, columns, {"stick": "1"})})
        result = identify(model, flown, method="output-error", shifts=False)
        assert any(words.startswith("late: ") and "(10 ms" in words for words in result.warnings)
        found.append(result["late"])
    held, straight = found
    pieces, delays = linear_records(model, [flown], model.outputs, biases=())
    assert hold_remarks(MODEL, delays, pieces) == ()  # that has no delay to fit
    assert straight.value == pytest.approx(2.0 * dt, abs=5.0 * straight.sigma)
    assert held.value == pytest.approx(2.5 * dt, abs=0.05 * dt)  # lines between samples are flatter than the hold
    assert held.value - 2.0 * dt > 20.0 * held.sigma
