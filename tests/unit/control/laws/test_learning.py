"""A flown step teaches the decoupling what a hover leaves open."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.straightness import step_paths
from swashplate.control.laws import learning
from swashplate.control.laws.autopilot import Autopilot, autopilot
from swashplate.control.laws.learning import corrected_by_step, straightened
from swashplate.errors import ControllerError


def test_a_drift_that_was_seen_is_taken_out_by_the_models_own_sensitivity(monkeypatch: pytest.MonkeyPatch) -> None:
    """By numbers that stand for flights, which a tilt per speed bends in proportion; flown: below."""
    coax = sp.vehicle("coax")
    law = autopilot(coax, sp.trim(coax), mode="manual")

    def flown(_: object, made: Autopilot, *__: object, **___: object) -> SimpleNamespace:
        across = made.numbers.law
        return SimpleNamespace(drift=np.array([0.7 + 90.0 * across.across_u_linear + 30.0 * across.across_v_linear]))

    monkeypatch.setattr(learning, "step_paths", flown)
    taught = corrected_by_step(coax, law, sp.trim(coax), command=0.2, drift=-0.8)
    assert flown(coax, taught).drift[0] == pytest.approx(flown(coax, law).drift[0] + 0.8)
    for name in ("across_u_linear", "across_v_linear"):
        change = getattr(taught.numbers.law, name) - getattr(law.numbers.law, name)
        assert change == pytest.approx(0.8 / 120.0)


@pytest.mark.proof
def test_one_step_teaches_the_law_the_aircraft() -> None:
    """Aircraft that tilt with speed as the model does not: at most a quarter of their drift is left."""
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    law = autopilot(coax, hover, mode="manual", lag=np.radians(20.0))
    tilts = np.array([-0.006, 0.006])
    others = {"a_alpha_u_linear": tilts, "a_beta_v_linear": tilts}
    flown = step_paths(coax, law, hover, command=0.2, size=2, parameters=others).drift
    assert np.all(np.abs(flown) > 0.5), flown
    for i, drift in enumerate(flown):
        own = {name: values[i : i + 1] for name, values in others.items()}
        taught = corrected_by_step(coax, law, hover, command=0.2, drift=float(drift))
        again = step_paths(coax, taught, hover, command=0.2, parameters=own).drift[0]
        assert abs(again) < 0.25 * abs(drift)


@pytest.mark.proof
@pytest.mark.parametrize("late", [0.06])
def test_the_lag_is_chosen_by_flying_the_model_with_its_delays(late: float) -> None:
    card = sp.vehicle("coax").card
    known = {"nuisance": {"delay_servo": 0.5 * late, "delay_motor": late}}
    coax = replace(sp.vehicle("coax"), card=replace(card, observer={**card.observer, **known}))
    hover = sp.trim(coax)
    papers = autopilot(coax, hover, mode="manual")
    straight = straightened(coax, papers, hover, command=0.2)
    drift = {law: float(step_paths(coax, law, hover, command=0.2).drift[0]) for law in (papers, straight)}
    assert abs(drift[papers]) > 0.4  # the rotor's own lag leaves the bar's misalignment
    assert abs(drift[straight]) < 0.02


@pytest.mark.proof
def test_a_path_that_no_lag_makes_straight_is_refused() -> None:
    coax = sp.vehicle("coax")
    law = autopilot(coax, sp.trim(coax), mode="manual")
    bent = coax.with_values({"a_alpha_u_linear": 0.12}, status="identified", source="a test")
    with pytest.raises(ControllerError, match=r"no constant lag makes a step of 0\.2 end straight ahead"):
        straightened(bent, law, sp.trim(bent), command=0.2)
