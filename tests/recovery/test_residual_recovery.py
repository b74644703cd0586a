"""A residual that is in a simulated flight is found again, and none is found where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.time import identify
from swashplate.identification.time.feedback import excitation
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.kinematics import measured_states
from swashplate.identification.time.residual_fit import LinearResidual, fit_residual
from swashplate.models.residual import with_residual
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.sensors import QUIET

pytestmark = pytest.mark.proof

NOISE = Noise(white_tilt=0.05, white_yaw=0.05, white_horizontal=0.01, white_vertical=0.01, gust_tilt=0.1, gust_yaw=0.1,
              gust_horizontal=0.02, gust_vertical=0.02, drift_moment=0.01, drift_force=0.001)  # fmt: skip


def seen(vehicle: Vehicle) -> Flight:
    flight = sp.simulate(vehicle, "multisine:roll+pitch,0.4-4Hz,26s,0.02", controller=sp.state_hold, lead=1, tail=1)
    return sp.observe(flight, vehicle, sensors=QUIET, seed=5).condition(rate=100.0, cutoff=0.0)


def flown(vehicle: Vehicle) -> list[Record]:
    return records([seen(vehicle)], sp.vehicle("crazyflie"))


def test_a_known_residual_is_found() -> None:
    """With the flight's true constants: a delay that was fitted without the residual would have taken part of it."""
    plain = sp.vehicle("crazyflie")
    trim = dict(zip(plain.input_names, sp.trim(plain).inputs, strict=True))
    truth = {"residual_p_p": -4.0, "residual_q_u": 3.0, "residual_u_theta": 0.0}
    pieces = flown(with_residual(plain, trim).with_values(truth))
    found = fit_residual(plain, pieces, [Nuisance()] * len(pieces), NOISE)
    assert np.isfinite(found.strength), found.summary_text
    card = found.vehicle.card.parameters
    for name, value in truth.items():
        sigma = card[name].sigma
        assert sigma is not None
        assert abs(card[name].value - value) < 4.0 * sigma + 0.1 * abs(value), (name, card[name])


def told(vehicle: Vehicle, pieces: list[Record], *, judged: bool) -> LinearResidual:
    """The residual of a flight by the likelihood's noise and constants, perhaps with a look at what moves its axes."""
    likelihood = FilterError(Parameterization(vehicle, ()), pieces)
    row = minimise(likelihood, Solver(iterations=30)).row
    nuisances = [Nuisance(*numbers.nuisance.tolist()) for numbers in likelihood.numbers(row)]
    axes = [axis for piece in pieces for axis in excitation(vehicle, piece, measured_states(piece, Nuisance()))]
    return fit_residual(vehicle, pieces, nuisances, likelihood.noise_of(row), axes=axes if judged else ())


def test_no_residual_is_found_where_there_is_none() -> None:
    """Heave hardly moves there, and the battery's log leaves a steady error in it. Blocks confirm that (the mutation):
    what refuses it is that the command of that axis is the controller's answer."""
    plain = sp.vehicle("crazyflie")
    pieces = flown(plain)
    found = told(plain, pieces, judged=True)
    assert max(found.shares.values()) < 1.0, found.summary_text
    assert told(plain, pieces, judged=False).shares["w"] > 10.0


def test_physics_gives_back_what_it_took_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fitted alone, the drive becomes faster and the inertia larger in the place of a damping; with that physics held,
    a residual finds little more than half of the damping."""
    plain = sp.vehicle("crazyflie")
    trim = dict(zip(plain.input_names, sp.trim(plain).inputs, strict=True))
    flight = seen(with_residual(plain, trim).with_values({"residual_p_p": -4.0}))
    held: list[float] = []

    def both(vehicle: Vehicle, *given: Any, physics: Any, **named: Any) -> LinearResidual:
        alone = fit_residual(vehicle, *given, **named, physics=None)
        held.extend(alone.vehicle.card.parameters[name].value for name in ("residual_p_p", "tau_drive"))
        return fit_residual(vehicle, *given, **named, physics=physics)

    monkeypatch.setattr(identify, "fit_residual", both)
    found = sp.identify(plain, [flight], free=["inertia_xx", "inertia_yy", "tau_drive"], residual=True)
    damping = found.model.card.parameters["residual_p_p"]
    assert damping.sigma is not None
    assert abs(damping.value + 4.0) < 4.0 * damping.sigma + 0.1
    assert abs(found["tau_drive"].value - 0.05) < 0.002
    assert found.names == ("inertia_xx", "inertia_yy", "tau_drive")
    assert held[0] > -3.0
    assert held[1] < 0.047
    assert "with it the physics moves: " in " ".join(found.problems)
