"""A published helicopter whose trim is tilted, the Westland Lynx in hover, by the ready structure without start values.

Numbers: Skogestad and Postlethwaite (2005), sec. 13.2, the linear model from the Rationalised Helicopter Model as given
in its file of that section: theta, phi, p, q, yaw rate [rad, rad/s] and speeds [ft/s]; collective, longitudinal and
lateral cyclic and tail rotor collective [deg].
"""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.identification.frequency.start_values import at_flown_trim
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space_file import structure

STATES = ("theta", "phi", "p", "q", "r", "u", "v", "w")
INPUTS = ("collective", "longitudinal", "lateral", "pedal")
A = [
    [0.0, 0.0, 0.0, 0.99857378005981, 0.05338427424431, 0.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, -0.0031822193414, 0.0595246553421, 0.0, 0.0, 0.0],
    [0.0, 0.0, -11.5704956054688, -2.54463768005371, -0.0636026263237, 0.10678052902222, -0.09491866827011,
     0.00710757449269],
    [0.0, 0.0, 0.43935656547546, -1.99818229675293, 0.0, 0.01665188372135, 0.01846204698086, -0.00118747074157],
    [0.0, 0.0, -2.04089546203613, -0.4589991569519, -0.73502779006958, 0.01925575733185, -0.00459562242031,
     0.00212036073208],
    [-32.1036071777344, 0.0, -0.50335502624512, 2.29785919189453, 0.0, -0.0212158113718, -0.02116791903973,
     0.01581159234047],
    [0.10216116905212, 32.0578308105469, -2.34721755981445, -0.50361156463623, 0.83494758605957, 0.02122657001019,
     -0.0378797352314, 0.00035400385968],
    [-1.91097259521484, 1.71382904052734, -0.00400543212891, -0.05741119384766, 0.0, 0.01398963481188,
     -0.00090675335377, -0.29051351547241],
]  # fmt: skip
B = [
    [0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0],
    [0.12433505058289, 0.08278584480286, -2.75247764587402, -0.01788876950741],
    [-0.03635892271996, 0.47509527206421, 0.01429074257612, 0.0],
    [0.30449151992798, 0.01495801657438, -0.49651837348938, -0.20674192905426],
    [0.28773546218872, -0.54450607299805, -0.01637935638428, 0.0],
    [-0.01907348632812, 0.01636743545532, -0.54453611373901, 0.23484230041504],
    [-4.82063293457031, -0.00038146972656, 0.0, 0.0],
]
FOOT = 0.3048
THETA0, PHI0 = 0.0595, -0.0533
"""Its attitude in hover: the shares of r in dphi/dt and dtheta/dt."""


@pytest.fixture(scope="module")
def matrices() -> tuple[Array, Array]:
    """In SI."""
    to_si = np.diag([1.0] * 5 + [FOOT] * 3)
    return to_si @ np.array(A) @ np.linalg.inv(to_si), to_si @ np.array(B)


def measured(a: Array, b: Array, *, noise: float) -> FrequencyResponse:
    """Rates, angles, speeds and accelerations from 0.05 to 4 Hz; pairs 30 dB below their output's best are unseen."""
    omega = 2 * np.pi * np.geomspace(0.05, 4.0, 60)
    s = 1j * omega[:, None, None]
    x = np.linalg.solve(s * np.eye(8) - a, np.broadcast_to(b + 0j, (omega.size, *b.shape)))
    felt = s * x[:, 5:8] - (a[5:8, :2] @ x[:, :2])  # what accelerates, less gravity; the trim's speeds are zero
    h = np.concatenate([x[:, 2:], x[:, :2], felt], axis=1) * np.exp(-0.03 * s)
    outputs = (*STATES[2:], *STATES[:2], "ax", "ay", "az")
    random = np.random.default_rng(4)
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    size = np.exp(np.mean(np.log(np.abs(h) + 1e-12), axis=0))
    seen = np.where(size > 0.03 * size.max(axis=1, keepdims=True), 0.95, 0.1) * np.ones(h.shape)
    n_f, n_out, n_in = h.shape
    return FrequencyResponse(
        omega=omega, inputs=INPUTS, outputs=outputs, response=h, coherence=seen,
        multiple=np.full((n_f, n_out), 0.95), error=np.where(seen > 0.5, noise, 0.5), input_power=np.ones((n_f, n_in)),
        output_power=np.ones((n_f, n_out)), input_coherence=np.ones((n_f, n_in, n_in)),
        settings={"means": {"phi": PHI0, "theta": THETA0}},
    )  # fmt: skip


def test_the_numbers_are_those_of_the_publication(matrices: tuple[Array, Array]) -> None:
    """Its poles at -11.49 and -2.3036 rad/s are given in the same file."""
    modes = np.linalg.eigvals(matrices[0])
    assert min(abs(modes + 11.49)) < 0.01
    assert min(abs(modes + 2.3036)) < 0.001


@pytest.fixture(scope="module")
def fit(matrices: tuple[Array, Array]) -> StateSpaceFit:
    responses = measured(*matrices, noise=0.03)
    return fit_state_space(at_flown_trim(structure("six_dof_coupled"), responses), responses, starts=2)


def test_the_modes_without_start_values(matrices: tuple[Array, Array], fit: StateSpaceFit) -> None:
    assert fit.cost < 8.0, fit
    assert fit.settings["started_from"] == "regression on the responses"
    assert not any("not all of the aircraft" in text for text in fit.warnings), fit.warnings
    found = fit.solution.eigenvalues()
    for value in np.linalg.eigvals(matrices[0]):
        assert min(abs(found - value)) < 0.05 * abs(value), (value, found)


def test_a_trim_taken_for_level_is_said(matrices: tuple[Array, Array], fit: StateSpaceFit) -> None:
    level = fit.solution.with_values({"theta0": 0.0, "phi0": 0.0})
    refit = fit_state_space(level, measured(*matrices, noise=0.03), starts=1, iterations=15)
    assert refit["theta0"].fixed
    assert refit.cost > 50.0
    assert any("not all of the aircraft" in text for text in refit.warnings), refit.warnings
