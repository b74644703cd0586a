"""One way to ask a model for its frequency response, held against python-control's and against flying the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import swashplate as sp
from swashplate.models.linear.answering import LinearResponse, pair_response
from swashplate.models.linear.transfer_function import Form, TransferFunction, TransferFunctions
from swashplate.simulation.linearize import LinearModel

OMEGA = np.geomspace(0.3, 12.0, 15)
POLES = {"pole": 3.0, "tau": 0.04}
PAIR = TransferFunctions(
    [
        TransferFunction(Form(0, 1), {"K": 2.0, **POLES}, "p", "stick"),
        TransferFunction(Form(0, 1), {"K": -5.0, **POLES}, "q", "stick"),
    ]
)


def test_a_vehicle_answers_as_its_linear_model_does_in_python_control() -> None:
    vehicle = sp.vehicle("crazyflie")
    late = replace(sp.linearize(vehicle), delays={vehicle.input_names[0]: 0.03})
    assert isinstance(late, LinearModel)
    assert late.outputs == vehicle.state_names
    plain = np.moveaxis(vehicle.to_control(pade=0)(1j * OMEGA), 2, 0)
    np.testing.assert_allclose(vehicle.response(OMEGA), plain, rtol=1e-6, atol=1e-9)
    lag = np.exp(-0.03j * OMEGA)
    np.testing.assert_allclose(late.response(OMEGA)[:, :, 0], plain[:, :, 0] * lag[:, None], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(late.response(OMEGA)[:, :, 1], plain[:, :, 1], rtol=1e-6, atol=1e-9)
    expected = sorted(abs(np.linalg.eigvals(late.A)))
    np.testing.assert_allclose(sorted(abs(late.eigenvalues())), expected, atol=1e-9)


def test_a_structure_and_its_vehicle_answer_alike() -> None:
    vehicle = sp.vehicle("yaw")
    assert vehicle.structure is not None
    np.testing.assert_array_equal(vehicle.response(OMEGA), vehicle.structure.response(OMEGA))


def test_functions_answer_by_output_with_their_delays() -> None:
    assert isinstance(PAIR, LinearResponse)
    assert (PAIR.inputs, PAIR.outputs) == (("stick",), ("p", "q"))
    expected = np.exp(-0.04j * OMEGA) / (1j * OMEGA + 3.0)
    np.testing.assert_allclose(PAIR.response(OMEGA)[:, :, 0], expected[:, None] * [2.0, -5.0], rtol=1e-12)
    np.testing.assert_allclose(pair_response(PAIR, "q", "stick", OMEGA), -5.0 * expected, rtol=1e-12)
    np.testing.assert_allclose(PAIR.eigenvalues(), [-3.0])


def test_slopes_of_named_parameters_are_the_derivatives() -> None:
    free = ("K q", "K p", "tau q", "pole")
    h, slopes = PAIR.log_slopes("q", "stick", OMEGA, free)
    for k, (name, other) in enumerate([("K", 0.0), ("", 0.0), ("tau", 0.0), ("pole", 0.0)]):
        if not name:
            np.testing.assert_array_equal(slopes[:, k], other)  # the other output's gain
            continue
        moved = PAIR[1].values[name] * (1.0 + 1e-6)
        there = replace(PAIR[1], values={**PAIR[1].values, name: moved}).response(OMEGA)
        np.testing.assert_allclose(slopes[:, k], np.log(there / h) / (1e-6 * PAIR[1].values[name]), rtol=1e-4)
