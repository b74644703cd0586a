"""The ceiling of models flown along the inputs: the truth reaches it, a spoilt model does not, a cheat is caught."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.models.linear.state_space_file import parse
from swashplate.validation.black_box import LEAK, ceiling_along, inputs_so_far
from swashplate.validation.verification import Verification
from swashplate.validation.verify import verify

DT, N = 0.02, 2000
TIME = np.arange(N) * DT


def _rolled(seed: int, *, own: float, gust: float, feedback: float = 0.0, late: int = 5) -> tuple[Array, Array]:
    """Input and p of p' = -3 p + 6 u + gust, perhaps under a controller that answers p late."""
    rng = np.random.default_rng(seed)
    moved, push = (np.repeat(rng.standard_normal(N // 10), 10) * size for size in (own, gust))
    u, p = np.zeros(N), np.zeros(N)
    for k in range(N - 1):
        u[k] = moved[k] - feedback * p[max(k - late, 0)]
        p[k + 1] = p[k] + DT * (6.0 * u[k] + push[k] - 3.0 * p[k])
    return u[:, None], (p + 1e-3 * rng.standard_normal(N))[:, None]


def _fit(squares: Array, p: Array) -> float:
    return float(100.0 * (1.0 - np.sqrt(squares.mean()) / np.std(p)))


@pytest.mark.parametrize("seed", range(4))
def test_independent_inputs_tell_the_motion_and_are_no_leak(seed: int) -> None:
    u, p = _rolled(seed, own=1.0, gust=1.0)
    box = ceiling_along([TIME], [u], [p])
    assert box.leak is not None
    assert box.leak[0] < LEAK
    assert _fit(box.squares[0], p) > 70.0


def test_a_controllers_answers_are_a_leak() -> None:
    u, p = _rolled(1, own=0.02, gust=3.0, feedback=0.5)
    box = ceiling_along([TIME], [u], [p])
    assert box.leak is not None
    assert box.leak[0] > LEAK


def test_regressors_that_look_ahead_are_caught_and_short_records_refused() -> None:
    u, p = _rolled(1, own=1.0, gust=1.0)
    cheat = ceiling_along([TIME], [u], [p], bank=lambda u, dt, after: np.roll(inputs_so_far(u, dt, after), -2, axis=0))
    assert cheat.refused == "its regressors see the motion after the start"
    short = ceiling_along([TIME[:200]], [u[:200]], [p[:200]])
    assert short.refused == "the flights are too short for it"


MODEL = """
kind = "state-space"
name = "roll"
[states]
p = "rad/s"
[inputs]
command = "1"
[equations]
p = {p = "-3", command = "Lu"}
[outputs.p]
of = {p = "1"}
[parameters]
Lu = {value = GAIN, unit = "1/s^2"}
"""


def _verified(gain: float, *, band: tuple[float, float] | None = None) -> Verification:
    u, p = _rolled(1, own=1.0, gust=1.0)
    flight = Flight({"a": stream(TIME, {"command": u[:, 0], "p": p[:, 0]}, {"command": "1"})})
    return verify(parse(MODEL.replace("GAIN", str(gain))), flight, band=band)


def test_the_truth_is_at_its_ceiling_and_a_spoilt_model_is_short_of_it() -> None:
    good, spoilt = (_verified(gain) for gain in (6.0, 2.0))
    for found in (good, spoilt):
        (floor,) = found.floors
        assert (floor.fit, floor.rms) == (pytest.approx(found["p"].fit), pytest.approx(found["p"].rms))
        assert floor.low < floor.fit < floor.high
        assert floor.summary_text in repr(found)
        assert found.to_document()["floors"][0]["ceiling"] == floor.ceiling
    assert good.floors[0].reached
    assert not spoilt.floors[0].reached
    assert spoilt.floors[0].gap_low > 5.0
    assert "a better model is possible" in repr(spoilt)


def test_within_a_band_whose_filters_look_ahead_there_is_no_ceiling() -> None:
    (floor,) = _verified(6.0, band=(0.3, 5.0)).floors
    assert np.isnan(floor.ceiling)
    assert "look ahead" in floor.refused
