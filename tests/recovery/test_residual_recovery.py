"""A residual that is in a simulated flight is found again, and none is found where there is none."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.scoring import minimise
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.residual_fit import fit_residual
from swashplate.models.residual import with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.sensors import QUIET

pytestmark = pytest.mark.proof

NOISE = Noise(white_tilt=0.05, white_yaw=0.05, white_horizontal=0.01, white_vertical=0.01, gust_tilt=0.1, gust_yaw=0.1,
              gust_horizontal=0.02, gust_vertical=0.02, drift_moment=0.01, drift_force=0.001)  # fmt: skip


def flown(vehicle: Vehicle) -> list[Record]:
    flight = sp.simulate_maneuver(
        vehicle, "multisine:roll+pitch,0.4-4Hz,26s,0.02", controller=sp.state_hold, lead=1, tail=1
    )
    seen = sp.observe(flight, vehicle, sensors=QUIET, seed=5).condition(rate=100.0, cutoff=0.0)
    return records([seen], sp.vehicle("crazyflie"))


def test_a_known_residual_is_found() -> None:
    """With the flight's true constants: a delay that was fitted without the residual would have taken part of it."""
    plain = sp.vehicle("crazyflie")
    trim = dict(zip(plain.input_names, sp.trim(plain).inputs, strict=True))
    truth = {"residual_p_p": -4.0, "residual_q_u": 3.0, "residual_u_theta": 0.0}
    pieces = flown(with_residual(plain, trim).with_values(truth))
    found = fit_residual(plain, pieces, [Nuisance()] * len(pieces), NOISE)
    assert np.isfinite(found.strength), found.words
    card = found.vehicle.card.parameters
    for name, value in truth.items():
        sigma = card[name].sigma
        assert sigma is not None
        assert abs(card[name].value - value) < 4.0 * sigma + 0.1 * abs(value), (name, card[name])


def test_no_tilting_residual_is_found_where_there_is_none() -> None:
    """Noise and constants as the likelihood has them (heave hardly moves, there the battery log leaves something)."""
    plain = sp.vehicle("crazyflie")
    pieces = flown(plain)
    likelihood = PredictionError(Parameterization(plain, ()), pieces)
    row = minimise(likelihood, iterations=30).row
    nuisances = [Nuisance(*numbers.nuisance.tolist()) for numbers in likelihood.numbers(row)]
    found = fit_residual(plain, pieces, nuisances, likelihood.noise_of(row))
    assert max(found.shares[row] for row in ("u", "v", "p", "q")) < 1.0, found.words
