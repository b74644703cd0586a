"""Slopes of a linear model's errors along records, by every kind of entry, against differences of the cost itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.result import Estimate
from swashplate.identification.time.linear_filter import FilterErrors
from swashplate.identification.time.linear_likelihood import LinearErrors
from swashplate.identification.time.linear_problem import linear_records, torn
from swashplate.identification.time.linear_simulation import driven
from swashplate.models.linear.state_space_file import structure

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
