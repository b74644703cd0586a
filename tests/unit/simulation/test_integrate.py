"""Steps that are too long for a vehicle are refused; the modulus is that of the linear model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.integrate import check_step, fastest_mode


@pytest.fixture(scope="module")
def raptor() -> Vehicle:
    return sp.vehicle("raptor50")


def test_the_fastest_mode_is_the_linear_models(raptor: Vehicle) -> None:
    hover = sp.trim(raptor)
    first = sp.linearize(raptor, hover).modes()[0]
    found = fastest_mode(raptor, hover.state, hover.inputs, hover.environment)
    assert abs(found.real - first.eigenvalue.real) < 1e-4
    assert abs(abs(found.imag) - first.eigenvalue.imag) < 1e-4


def test_one_step_a_second_is_refused_with_what_would_do(raptor: Vehicle) -> None:
    hover = sp.trim(raptor)
    with pytest.raises(SwashError, match=r"1 steps a second are too few for the mode -32\.3 \+- 9\.81j"):
        sp.simulate(raptor, np.tile(hover.inputs, (5, 1)), start=hover, rate=1.0)
    check_step(raptor, hover.state, hover.inputs, hover.environment, rate=14.0)
    check_step(raptor, hover.state, hover.inputs, hover.environment, rate=1.0, substeps=14)
    with pytest.raises(SwashError, match=r"Give 14 Hz or more, or 3 substeps a sample"):
        check_step(raptor, hover.state, hover.inputs, hover.environment, rate=5.0)


def test_a_state_without_finite_rates_is_left_to_the_flight(raptor: Vehicle) -> None:
    hover = sp.trim(raptor)
    nowhere = np.full_like(hover.state, np.nan)
    check_step(raptor, nowhere, hover.inputs, hover.environment, rate=1.0)


def test_equations_that_divide_by_zero_on_floats_are_left_to_the_flight(raptor: Vehicle) -> None:
    def broken(*given: object) -> object:
        raise ZeroDivisionError

    hover = sp.trim(raptor)
    check_step(replace(raptor, derivatives=broken), hover.state, hover.inputs, hover.environment, rate=1.0)
