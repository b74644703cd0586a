"""Which of many flights count as lost: every limit can say no, and nothing that was beyond one is called flown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.monte_carlo import not_followed
from swashplate.control.draws.spread import Limits, Spread, spread
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop_batch import Batch
from swashplate.simulation.trim import Trim

SAMPLES, FLIGHTS = 40, 4


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def hover(coax: Vehicle) -> Trim:
    return sp.trim(coax)


def judged(coax: Vehicle, hover: Trim, limits: Limits | None = None, **excursions: float) -> Spread:
    """Four flights that stand at the trim; the third makes the excursions between 1 and 1.5 s and comes back."""
    states = np.repeat(np.repeat(hover.state[None, :, None], SAMPLES, 0), FLIGHTS, 2)
    for name, value in excursions.items():
        states[20:30, coax.index(name), 2] += value
    rows = np.zeros((SAMPLES, len(coax.input_names) + 4, 1))
    return spread(Batch(coax, np.arange(SAMPLES) / 20.0, states, rows), hover, limits=limits)


def test_flights_that_stand_still_are_not_lost(coax: Vehicle, hover: Trim) -> None:
    found = judged(coax, hover)
    assert found.lost == 0
    assert not any(found.lost_by.values())
    assert np.all(np.isinf(found.lost_after))


@pytest.mark.parametrize(
    ("limit", "state", "inside", "beyond"),
    [
        ("lean", "phi", math.radians(44.0), math.radians(46.0)),
        ("lean", "theta", math.radians(-44.0), math.radians(-46.0)),
        ("rate", "r", math.radians(350.0), math.radians(370.0)),
        ("place", "x", 1.9, 9.8),
        ("place", "y", -1.9, -2.1),
        ("height", "z", -0.9, -1.1),
        ("heading", "psi", math.radians(44.0), math.radians(456.0)),
    ],
)
def test_every_limit_can_say_no(
    coax: Vehicle, hover: Trim, limit: str, state: str, inside: float, beyond: float
) -> None:
    assert judged(coax, hover, **{state: inside}).lost == 0
    found = judged(coax, hover, **{state: beyond})
    assert found.lost == 1
    assert {name for name, count in found.lost_by.items() if count} == {limit}
    assert found.worst == 2
    assert found.lost_after[2] == pytest.approx(1.0)
    assert found.values[limit][2] == pytest.approx(abs(beyond), rel=0.01)
    document = found.to_document()
    assert document["lost"] == 1
    assert document["worst"]["number"] == 2
    line = next(line for line in repr(found).splitlines() if line.startswith(f"{limit}, largest"))
    assert line.split()[-1] == "1"
    looser = judged(coax, hover, replace(Limits(), **{limit: math.inf}), **{state: beyond})
    assert looser.lost == 0


def test_a_flight_that_diverged_is_lost_whatever_the_limits(coax: Vehicle, hover: Trim) -> None:
    nothing = Limits(*[math.inf] * 5)
    found = judged(coax, hover, nothing, x=np.nan)
    assert found.lost == 1
    assert found.worst == 2
    assert found.lost_after[2] == pytest.approx(1.0)
    assert found.figures["place, largest [m]"][-1] == math.inf
    assert "inf" in repr(found)


def test_lost_flights_are_in_the_distribution(coax: Vehicle, hover: Trim) -> None:
    found = judged(coax, hover, psi=math.radians(456.0))
    assert found.figures["heading, largest [deg]"][-1] == pytest.approx(456.0)
    assert "45" in next(line for line in repr(found).splitlines() if line.startswith("heading"))


def test_a_limit_is_a_positive_number() -> None:
    with pytest.raises(ControllerError, match="limit of lean: is 0, expected a positive number"):
        Limits(lean=0.0)
    with pytest.raises(ControllerError, match="limit of rate: is nan"):
        Limits(rate=math.nan)


def test_what_was_asked_for_and_not_flown_is_said(coax: Vehicle, hover: Trim) -> None:
    """A second of 2 m/s ahead from 3 s on: flights that fly it say nothing, flights that stand still do."""
    time = np.arange(500) / 100.0
    asked = np.where((time >= 3.0) & (time < 4.0), 2.0, 0.0)
    states = np.repeat(np.repeat(hover.state[None, :, None], 100, 0), FLIGHTS, 2)
    rows = np.zeros((100, len(coax.input_names) + 4, 1))
    still = Batch(coax, np.arange(100) / 20.0, states, rows)
    (words,) = not_followed(still, hover, {"ahead": asked}, time - 3.0)
    assert words == "ahead was asked to change by 2, and half of the flights reached 0."
    moving = states.copy()
    moving[60:80, coax.index("u")] += 1.8
    assert not_followed(Batch(coax, still.time, moving, rows), hover, {"ahead": asked}, time - 3.0) == ()
