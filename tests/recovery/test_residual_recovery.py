"""A residual that is in a simulated flight is found again, and none is found where there is none."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.scoring import minimise
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.residual_fit import LinearResidual, fit_residual
from swashplate.models.residual import with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.sensors import QUIET

pytestmark = pytest.mark.proof


def flown(vehicle: Vehicle) -> list[Record]:
    flight = sp.simulate_maneuver(
        vehicle, "multisine:roll+pitch,0.4-4Hz,26s,0.02", controller=sp.state_hold, lead=1, tail=1
    )
    seen = sp.observe(flight, vehicle, sensors=QUIET, seed=5).condition(rate=100.0, cutoff=0.0)
    return records([seen], sp.vehicle("crazyflie"))


def fitted(vehicle: Vehicle) -> LinearResidual:
    """The residual about the card's own physics, with noise and constants as the likelihood has them."""
    pieces, plain = flown(vehicle), sp.vehicle("crazyflie")
    likelihood = PredictionError(Parameterization(plain, ()), pieces)
    row = minimise(likelihood, iterations=30).row
    nuisances = [Nuisance(*numbers.nuisance.tolist()) for numbers in likelihood.numbers(row)]
    return fit_residual(plain, pieces, nuisances, likelihood.noise_of(row))


def test_a_known_residual_is_found() -> None:
    plain = sp.vehicle("crazyflie")
    trim = dict(zip(plain.input_names, sp.trim(plain).inputs, strict=True))
    truth = {"residual_p_p": -4.0, "residual_q_u": 3.0, "residual_u_theta": 0.0}
    found = fitted(with_residual(plain, trim).with_values(truth))
    assert np.isfinite(found.strength), found.words
    card = found.vehicle.card.parameters
    for name, value in truth.items():
        assert abs(card[name].value - value) < 4.0 * card[name].sigma + 0.1 * abs(value), (name, card[name])


def test_none_is_kept_where_there_is_none() -> None:
    found = fitted(sp.vehicle("crazyflie"))
    assert not np.isfinite(found.strength), found.words
