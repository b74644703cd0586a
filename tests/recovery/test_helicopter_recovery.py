"""Simulate a helicopter with known numbers, identify it from the log, get the numbers back."""

from __future__ import annotations

import pytest

from swashplate.control.state_hold import state_hold
from swashplate.errors import IdentificationError
from swashplate.identification.identify import identify
from swashplate.identification.parameters import Free, parameterize
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.sensors import QUIET, observe
from swashplate.vehicles.catalogue import vehicle

TRUE = {"hub_stiffness": 35.0, "wake_distortion": 1.0}


def test_hub_spring_and_wake_distortion_come_back_from_a_flight() -> None:
    """Output error on 5 s of motion capture: a card with estimates becomes a card with identified values."""
    card = vehicle("raptor50")
    real = card.with_values(TRUE)
    flown = simulate_maneuver(real, "multisine:roll+pitch,0.6-5Hz,5s,0.02", controller=state_hold, lead=0.5, tail=0.5)
    log = observe(flown, real, sensors=QUIET, seed=1)
    log = log.with_streams({name: data for name, data in log.streams.items() if name != "battery"})
    fit = identify(
        card,
        log.condition(rate=100, cutoff=0),
        free=[Free("hub_stiffness", 20.0), Free("wake_distortion", 1.0)],
        method="output-error",
        iterations=20,
    )
    found = fit.vehicle.card.values()
    assert found["hub_stiffness"] == pytest.approx(35.0, rel=0.01)
    assert found["wake_distortion"] == pytest.approx(1.0, abs=0.03)
    assert fit.vehicle.card.parameters["hub_stiffness"].status == "identified"
    assert fit.vehicle.card.parameters["mass"].status == "published"


def test_a_choice_for_coaxial_helicopters_is_refused() -> None:
    with pytest.raises(IdentificationError, match="'full' is for another kind of vehicle"):
        parameterize(vehicle("raptor50"), "full")
