"""Models beside a flight, and what they leave: a right model is called complete, a wrong one is not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter, lsim

import swashplate as sp
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse

DT = 0.02

MODEL = """
kind = "state-space"
name = "{name}"
title = "roll rate of a stick"

[states]
p = "rad/s"

[inputs]
stick = "1"

[equations]
p = {{p = "Lp", stick = "K"}}

[outputs.p]
unit = "rad/s"
of = {{p = "1"}}

[parameters]
Lp = {{value = {lp}, unit = "1/s"}}
K = {{value = {gain}, unit = "rad/s^2"}}
"""


def model(*, lp: float = 4.0, gain: float = 8.0, name: str = "right") -> StateSpaceModel:
    return parse(MODEL.format(lp=-lp, gain=gain, name=name))


def flown(*, seed: int, noise: float = 0.3, seconds: float = 40.0, colour: float = 0.9, held: bool = False) -> Flight:
    """A record of the right model, straight lines between the inputs' samples, with coloured noise."""
    rng = np.random.default_rng(seed)
    n = round(seconds / DT)
    stick = np.repeat(rng.choice((-1.0, 1.0), n // 10), 10)
    _, p, _ = lsim(([8.0], [1.0, 4.0]), stick, np.arange(n) * DT, interp=not held)
    p = np.asarray(p) + noise * np.sqrt(1.0 - colour**2) * lfilter([1.0], [1.0, -colour], rng.standard_normal(n))
    return Flight.from_arrays(np.arange(n) * DT, {"stick": stick, "p": p}, units={"stick": "1"}, source="made.csv")


def test_a_right_model_leaves_nothing_that_the_inputs_explain() -> None:
    judged = [sp.residuals(model(), flown(seed=seed)) for seed in range(12)]
    assert sum(not one.complete for one in judged) <= 1, "one in a hundred is promised"
    assert judged[0].white == {"p": False}
    assert "COMPLETE" in repr(judged[0])
    white = sp.residuals(model(), flown(seed=1, colour=0.0))
    assert white.white == {"p": True}


@pytest.mark.parametrize("wrong", [{"gain": 6.4}, {"lp": 5.5}, {"lp": 2.5}, {"gain": -8.0}])
def test_a_wrong_model_is_called_incomplete(wrong: dict[str, float]) -> None:
    judged = [sp.residuals(model(**wrong), flown(seed=seed)) for seed in range(4)]
    assert not any(one.complete for one in judged)
    assert judged[0].headline.startswith("INCOMPLETE: inputs still explain what the model leaves: p from stick")


def test_half_a_sample_of_delay_is_found_in_little_noise() -> None:
    """Inputs that the record held from sample to sample, and the model takes as straight lines."""
    assert sp.residuals(model(), flown(seed=1, noise=0.05, colour=0.0)).complete
    assert not sp.residuals(model(), flown(seed=1, noise=0.05, colour=0.0, held=True)).complete


def test_fits_are_those_of_their_definition() -> None:
    flight = flown(seed=5)
    found = sp.compare([model(), model(lp=2.0, name="slow")], flight)
    (trace, *rest) = found.found["right"].traces
    traces = [trace, *rest]
    error = np.concatenate([t.flight - t.model for t in traces])
    about = np.concatenate([t.flight - t.flight.mean(axis=0) for t in traces])
    expected = 100.0 * (1.0 - np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(about**2)))
    assert found.fits()["p"]["right"] == pytest.approx(expected)
    assert found.fits()["p"]["right"] > found.fits()["p"]["slow"] + 10.0
    assert list(found.to_dataframe().columns) == ["right", "slow"]
    assert "right" in repr(found)
    assert list(sp.compare({"mine": model()}, flight).found) == ["mine"]
    assert list(sp.compare([model(), model()], flight).found) == ["right 1", "right 2"]


def test_both_draw_themselves_with_units() -> None:
    flight = flown(seed=5)
    compared, left = sp.compare([model(), model(lp=2.0, name="slow")], flight), sp.residuals(model(), flight)
    assert compared.figures == ("models",)
    labels = [panel.get_ylabel() for panel in compared.plot().axes]
    assert labels == ["input [-]", "p [deg/s]"]
    assert left.figures == ("cross-correlation", "autocorrelation")
    panel: Any = left.plot().axes[0]
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("lag [s]", "correlation [-]")
    assert left.to_dataframe().shape == (2000, 1)
    assert "COMPLETE" in left._repr_html_()


def test_what_cannot_be_judged_is_refused() -> None:
    with pytest.raises(FlightError, match="expected at least 500 for lags up to 1 s"):
        sp.residuals(model(), flown(seed=1, seconds=4.0))
    with pytest.raises(SwashError, match="expected more than 0"):
        sp.residuals(model(), flown(seed=1), seconds=0.0)
    with pytest.raises(SwashError, match="no model to compare"):
        sp.compare([], flown(seed=1))
