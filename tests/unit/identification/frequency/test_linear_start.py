"""Starts that the responses suggest, and ceilings where nothing was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swashplate.identification.frequency import state_space_search
from swashplate.identification.frequency.linear_start import by_controls, by_regression
from swashplate.identification.frequency.response_cost import ceiling, cost_of, target
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure

OMEGA = np.geomspace(0.5, 40.0, 80)


def shaken(name: str, *, seed: int, signs: bool = True) -> StateSpaceModel:
    """A ready structure with other numbers: halves to doubles, zeros filled, controls perhaps the other way round."""
    model, random = structure(name), np.random.default_rng(seed)
    changed = {}
    for n in model.free:
        p = model.parameters[n]
        value = p.value * 2.0 ** random.uniform(-1.0, 1.0)
        if p.value == 0.0:
            value = random.uniform(-0.3, 0.3) * (10.0 if n[1:] in ("lat", "lon", "ped", "col") else 1.0)
        changed[n] = float(np.clip(value, p.lower, p.upper))
    if signs:
        for e in model.elements:
            if e.matrix == "G" and e.column == 1:
                changed[e.expression.text.lstrip("-")] *= -1.0
    return model.with_values(changed)


def measured(model: StateSpaceModel, outputs: tuple[str, ...], *, noise: float = 0.0) -> FrequencyResponse:
    """A model's own responses as if they were measured, with random errors."""
    rows = [model.outputs.index(o) for o in outputs]
    h = model.response(OMEGA)[:, rows, :]
    random = np.random.default_rng(0)
    error = np.full(h.shape, max(noise, 1e-4))
    h = h * (1.0 + noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)) / np.sqrt(2.0))
    ones = np.ones((OMEGA.size, len(model.inputs)))
    return FrequencyResponse(
        OMEGA,
        model.inputs,
        outputs,
        h,
        np.ones(h.shape),
        np.ones(h.shape[:2]),
        error,
        ones,
        np.ones(h.shape[:2]),
        np.zeros((OMEGA.size, len(model.inputs), len(model.inputs))),
    )


def test_rates_and_accelerations_tell_every_derivative_without_a_start() -> None:
    truth = shaken("six_dof_coupled", seed=1)
    found = by_regression(structure("six_dof_coupled"), measured(truth, ("p", "q", "r", "ax", "ay", "az")))
    assert found is not None
    for name in truth.free:
        p = truth.parameters[name]
        if name.startswith("tau"):
            assert found.parameters[name].value == pytest.approx(p.value, abs=0.006)  # tried in steps of 10 ms
    modes = found.eigenvalues()
    assert all(np.min(np.abs(modes - v)) < 0.1 * max(abs(v), 0.5) for v in truth.eigenvalues())


def test_a_fit_from_a_start_with_wrong_signs_ends_at_the_truth() -> None:
    truth = shaken("six_dof_coupled", seed=2)
    responses = measured(truth, ("p", "q", "r", "ax", "ay", "az"), noise=0.01)
    fit = fit_state_space(structure("six_dof_coupled"), responses, starts=2)
    assert fit.settings["started_from"] == "regression on the responses"
    assert fit.cost < 1.0
    alone = fit_state_space(structure("six_dof_coupled"), responses, starts=1)
    assert alone.settings["started_from"] == "given values"
    assert alone.cost < 1.0


def test_in_logarithms_alone_such_a_fit_ends_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """What relative errors are for: a response of the wrong sign does not turn round in logarithms."""
    monkeypatch.setattr(state_space_search, "_led", lambda model, cost, row: row)
    rotor = measured(shaken("hybrid", seed=4), ("p", "q", "r", "ax", "ay", "az"), noise=0.02)
    assert fit_state_space(structure("hybrid"), rotor).cost > 50.0


def test_hidden_rotor_states_leave_the_controls_to_be_matched() -> None:
    truth = shaken("hybrid", seed=3)
    responses = measured(truth, ("p", "q", "r", "ax", "ay", "az"))
    model = structure("hybrid")
    assert by_regression(model, responses) is None
    targets = [t for o in responses.outputs for i in responses.inputs if (t := target(responses, o, i)) is not None]
    found = by_controls(model, targets)
    assert found is not None
    assert found.parameters["Alon"].value * truth.parameters["Alon"].value > 0.0
    assert model.parameters["Alon"].value * truth.parameters["Alon"].value < 0.0


def test_what_was_not_seen_cannot_be_large() -> None:
    truth = structure("six_dof")
    responses = measured(truth, ("p", "q", "r", "az"))
    o, i = responses.place("az", "pedal")
    coherence, response, error = responses.coherence.copy(), responses.response.copy(), responses.error.copy()
    coherence[:, o, i], response[:, o, i], error[:, o, i] = 0.1, 0.05, 0.5
    unseen = replace(responses, coherence=coherence, response=response, error=error)
    assert target(unseen, "az", "pedal") is None
    limit = ceiling(unseen, "az", "pedal")
    assert limit is not None
    np.testing.assert_allclose(np.abs(limit.measured), 0.05 * 2.5)
    assert cost_of(np.full(limit.omega.size, 0.12 + 0j), limit) == 0.0
    assert cost_of(np.full(limit.omega.size, 1.25 + 0j), limit) == pytest.approx(
        20.0**3 * (1.58 * (1 - np.exp(-1))) ** 2
    )


@pytest.mark.parametrize("seed", [3, 4, *(pytest.param(n, marks=pytest.mark.proof) for n in range(5, 15))])
def test_a_hidden_rotor_comes_back_from_wrong_signs(seed: int) -> None:
    truth = shaken("hybrid", seed=seed)
    fit = fit_state_space(structure("hybrid"), measured(truth, ("p", "q", "r", "ax", "ay", "az"), noise=0.02))
    assert fit.cost < 1.0
    modes = fit.solution.eigenvalues()
    assert all(np.min(np.abs(modes - v)) < 0.02 * abs(v) for v in truth.eigenvalues())
