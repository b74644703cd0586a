"""A published coupled helicopter, HeLion in hover, by the ready eleven-state structure (numbers and source:
`published_helicopters`).
"""

from __future__ import annotations

import numpy as np
import pytest

from published_helicopters import HELION
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure


@pytest.fixture(scope="module")
def truth() -> StateSpaceModel:
    return structure("eleven_state").with_values(HELION)


def measured(model: StateSpaceModel, *, noise: float) -> FrequencyResponse:
    """The responses from 0.1 to 6 Hz with a relative error; pairs 30 dB below their output's best are unseen."""
    omega = 2 * np.pi * np.geomspace(0.1, 6.0, 60)
    h = model.response(omega)
    random = np.random.default_rng(3)
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    size = np.exp(np.mean(np.log(np.abs(h) + 1e-12), axis=0))
    h = np.where(size > 0.03 * size.max(axis=1, keepdims=True), h, np.nan)
    n_f, n_out, n_in = h.shape
    return FrequencyResponse(
        omega=omega, inputs=model.inputs, outputs=model.outputs, response=h, coherence=np.full(h.shape, 0.95),
        multiple=np.full((n_f, n_out), 0.95), error=np.full(h.shape, noise), input_power=np.ones((n_f, n_in)),
        output_power=np.ones((n_f, n_out)), input_coherence=np.ones((n_f, n_in, n_in)),
    )  # fmt: skip


def test_the_numbers_are_those_of_the_publication(truth: StateSpaceModel) -> None:
    """Eigenvalues of its A matrix, worked out from the printed entries without this structure."""
    a, _, _, _ = truth.explicit()
    at = {name: truth.states.index(name) for name in truth.states}
    assert a[at["a"], at["b"]] == pytest.approx(4.6535)
    assert a[at["b"], at["a"]] == pytest.approx(-0.0921)
    assert a[at["a"], at["q"]] == -1.0
    assert np.trace(a) == pytest.approx(-0.1778 - 0.3104 - 2 * 8.1222 - 0.6821 - 5.5561 - 11.112)


def test_from_numbers_30_percent_off_to_the_published_modes(truth: StateSpaceModel) -> None:
    random = np.random.default_rng(5)
    off = {n: truth.parameters[n].value * (1.0 + 0.3 * random.choice([-1.0, 1.0])) for n in truth.free}
    fit = fit_state_space(truth.with_values(off), measured(truth, noise=0.01), starts=2)
    assert fit.cost < 2.0, fit
    found = fit.solution.eigenvalues()
    for value in truth.eigenvalues():
        if abs(value) > 2 * np.pi * 0.1:  # the slow modes lie below the band
            assert min(abs(found - value)) < 0.03 * abs(value), (value, found)


def test_with_three_times_the_noise_each_mode_is_as_far_off_as_its_bound_says(truth: StateSpaceModel) -> None:
    """The yaw mode is 8 % off then, and its bound 14 %."""
    random = np.random.default_rng(5)
    off = {n: truth.parameters[n].value * (1.0 + 0.3 * random.choice([-1.0, 1.0])) for n in truth.free}
    fit = fit_state_space(truth.with_values(off), measured(truth, noise=0.03), starts=2)
    known = truth.eigenvalues()
    for mode in fit.details.modes:
        error = min(abs(known - mode.eigenvalue))
        assert error < 0.03 * mode.frequency + 2.0 * mode.frequency_bound, mode
