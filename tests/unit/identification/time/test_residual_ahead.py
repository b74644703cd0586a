"""A residual of errors ahead is fitted to what a saved predictor does on a new flight, and to nothing else."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import ten_seconds
from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.multi_step import Horizon
from swashplate.identification.core.records import CALIBRATION, Record, records
from swashplate.identification.time import residual_ahead
from swashplate.identification.time.calibration import calibrate
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.residual_ahead import FlightAhead, fit_ahead
from swashplate.models.residual import coefficients, with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.validation.prediction import ObservedRecord

HORIZON = Horizon(0.25, 0.5)
TRIMS = {"push_p": 5.0, "push_r": 5.0}
FACTORS = {"residual_p_p": -2.0, "residual_r_psi": -4.0, "residual_u_servo_pitch": 0.5}


def wider() -> Vehicle:
    vehicle = sp.vehicle("coax")
    return with_residual(vehicle, dict.fromkeys(vehicle.input_names, 0.1), ahead=HORIZON.last)


@lru_cache(maxsize=1)
def piece() -> Record:
    (made,) = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), sp.vehicle("coax"))
    return made


def factors() -> Array:
    return np.array([FACTORS.get(name, 0.0) for name in coefficients(wider())])


def met(record: Record, monkeypatch: pytest.MonkeyPatch) -> FlightAhead:
    monkeypatch.setattr(residual_ahead, "BLOCK", 1.5)
    usual = Nuisance(delay_servo=0.05, delay_motor=0.05)
    vehicle = wider().with_values(FACTORS)
    return FlightAhead(vehicle, record, Noise(), usual, trims=TRIMS, horizon=HORIZON, sizes=[np.ones(1)] * 3)


def predicted(record: Record) -> Array:
    """Errors of the vehicle saved with its residual, as `validate` and the scores of the page predict."""
    usual = Nuisance(delay_servo=0.05, delay_motor=0.05)
    vehicle, every = wider().with_values(FACTORS), HORIZON.first
    own = calibrate(vehicle, record, noise=Noise(), prior=usual, trims=TRIMS)
    told = ObservedRecord(vehicle, record, noise=Noise(), nuisance=own).predict(
        horizon=HORIZON.last, every=every, settling=CALIBRATION
    )
    steps = np.array(HORIZON.samples(record.dt))
    starts = told.starts[told.starts + steps[-1] < record.time.size - 1]
    states = np.zeros((len(vehicle.state_names), len(starts), len(steps)))
    states[[vehicle.index(name) for name in PREDICTED]] = np.moveaxis(told.states[: len(starts), steps - 1], -1, 0)
    seen = stochastic_model(vehicle, record.output_names, record.dt).measure(states, own, ArrayBackend())
    return np.asarray(record.outputs[starts[:, None] + steps] - np.moveaxis(seen, 0, -1))


def test_errors_are_those_of_the_saved_predictor(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = np.concatenate(met(piece(), monkeypatch).errors(factors()))
    np.testing.assert_allclose(errors, predicted(piece())[: len(errors)], atol=1e-9)
    assert np.abs(errors).max() > 1e-4


def test_constants_come_from_the_first_seconds_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The accelerations of its own too: the filter begins with them, and knows nothing of what comes later."""
    outputs = piece().outputs.copy()
    outputs[round(CALIBRATION / piece().dt) + 1 :] += 0.1
    here, other = met(piece(), monkeypatch), met(replace(piece(), outputs=outputs), monkeypatch)
    one, two = (each.likelihood.numbers(each.likelihood.row.starts())[0].nuisance for each in (here, other))
    np.testing.assert_array_equal(one, two)
    began = Nuisance(*one)
    assert float(began.push_p) != 0.0
    run = here.likelihood.runs(here.likelihood.row.starts())[0]
    assert abs(float(np.asarray(run.states.drift)[0, 3]) - float(began.push_p)) < 0.2 * abs(float(began.push_p))
    assert all(len(part) for part in here._starts)
    assert here._starts[0][0] == round(CALIBRATION / piece().dt)


def test_the_nose_may_point_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """The heading that an autopilot holds counts from where a record begins."""
    turn = 2.0
    c, s = np.cos(turn), np.sin(turn)
    outputs = piece().outputs.copy()
    x, y = outputs[:, 0].copy(), outputs[:, 1].copy()
    outputs[:, 0], outputs[:, 1], outputs[:, 5] = c * x - s * y, s * x + c * y, outputs[:, 5] + turn
    here = np.concatenate(met(piece(), monkeypatch).errors(factors()))
    turned = np.concatenate(met(replace(piece(), outputs=outputs), monkeypatch).errors(factors()))
    np.testing.assert_allclose(turned[..., 2:6], here[..., 2:6], atol=2e-6)


def test_too_few_blocks_after_the_first_seconds_are_refused() -> None:
    with pytest.raises(IdentificationError, match="0 blocks of 6 s after their first 5 s"):
        fit_ahead(wider(), [piece()], [Nuisance(delay_servo=0.05, delay_motor=0.05)], Noise(), horizon=HORIZON)
