"""What a fit says about a structure that cannot be the aircraft's, and of ceilings that what was seen contradicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from swashplate.identification.frequency.response_cost import Target, ceiling, target
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.state_space_search import best_end
from swashplate.identification.frequency.structure_score import misfit_words, misfits
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure

OMEGA = 2 * np.pi * np.geomspace(0.1, 6.0, 60)


def measured(model: StateSpaceModel, *, noise: float) -> FrequencyResponse:
    h = model.response(OMEGA)
    random = np.random.default_rng(0)
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    return FrequencyResponse(
        omega=OMEGA, inputs=model.inputs, outputs=model.outputs, response=h, coherence=np.full(h.shape, 0.95),
        multiple=np.full(h.shape[:2], 0.95), error=np.full(h.shape, noise), input_power=np.ones(h.shape[::2]),
        output_power=np.ones(h.shape[:2]), input_coherence=np.zeros((h.shape[0], h.shape[2], h.shape[2])),
    )  # fmt: skip


def targets(responses: FrequencyResponse, pairs: Sequence[tuple[str, str]]) -> list[Target]:
    return [t for output, name in pairs if (t := target(responses, output, name)) is not None]


@pytest.fixture(scope="module")
def truth() -> StateSpaceModel:
    filled = {"Yped": -0.5, "Lw": 0.1, "Mw": 0.05, "Mcol": 0.5, "Za": -2.0, "Zb": -5.0, "Zr": 0.3, "Np": -0.5}
    return structure("hybrid").with_values(filled | {"Nw": 0.1, "Ncol": -2.0})


PAIRS = (("p", "lateral"), ("q", "longitudinal"), ("r", "pedal"), ("az", "collective"))


def test_the_right_structure_is_within_the_scatter(truth: StateSpaceModel) -> None:
    seen = targets(measured(truth, noise=0.05), PAIRS)
    assert misfits(truth, seen) == ()
    assert misfit_words(truth, seen) == []


def test_what_a_rotor_would_add_is_missed_above(truth: StateSpaceModel) -> None:
    late = truth.with_values({"tau_lat": 0.07})  # 50 ms, as an actuator
    found = misfit_words(truth, targets(measured(late, noise=0.05), PAIRS))
    assert len(found) == 1
    assert "1 of 4 responses" in found[0]
    assert "p / lateral" in found[0]
    assert "mostly above 0.77 Hz" in found[0]
    assert "--fix U0=" in found[0]
    assert "--fix" not in misfit_words(truth.with_values({"U0": 9.0}), targets(measured(late, noise=0.05), PAIRS))[0]


def test_speed_derivatives_are_missed_below(truth: StateSpaceModel) -> None:
    other = truth.with_values({"Mu": 3.0, "Lv": -3.0, "Zw": -2.0})
    found = misfit_words(truth, targets(measured(other, noise=0.05), PAIRS))
    assert "mostly below" in found[0], found


def test_one_notch_is_no_wrong_structure(truth: StateSpaceModel) -> None:
    seen = targets(measured(truth, noise=0.05), PAIRS)
    notched = seen[0].measured.copy()
    notched[7] *= 3.0
    assert misfits(truth, [replace(seen[0], measured=notched), *seen[1:]]) == ()


def damaged(truth: StateSpaceModel) -> FrequencyResponse:
    """The roll angle's response came out far too small at low coherence; it has to be the roll rate's integral."""
    responses = measured(truth, noise=0.02)
    o, i = responses.place("phi", "lateral")
    low, coherence = responses.response.copy(), responses.coherence.copy()
    low[:, o, i] *= 1e-3
    coherence[:, o, i] = 0.1
    return replace(responses, response=low, coherence=coherence)


def test_a_ceiling_that_is_too_low_is_given_up_and_named(truth: StateSpaceModel) -> None:
    fit = fit_state_space(truth, damaged(truth), starts=2)
    assert fit.cost < 10.0, fit  # a notch between two lines of v / lateral costs most of it
    assert any("where the flight shows nothing: phi / lateral" in text for text in fit.warnings), fit.warnings


@pytest.mark.proof
def test_with_such_a_ceiling_nothing_fits(truth: StateSpaceModel) -> None:
    responses = damaged(truth)
    limit = ceiling(responses, "phi", "lateral")
    assert limit is not None
    every = targets(responses, [(o, i) for o in responses.outputs for i in responses.inputs])
    end, cost = best_end(truth, (*every, limit), starts=1, iterations=30, seed=0, progress=None)
    together = [j for j, t in zip(cost.each(end.row), cost.targets, strict=True) if not t.ceiling]
    assert np.mean(together) > 50.0
