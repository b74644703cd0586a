"""The verb `track`: streams of a log, what it says of them, its files and its C."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from short_period import TRUTH, short_period
from swashplate.api.track import recursive_estimator
from swashplate.errors import ExportError, FlightError, IdentificationError, SwashError
from swashplate.flights.flight import Flight, stream
from swashplate.identification.recursive.fourier_regression import RegressionPlan
from swashplate.identification.recursive.tracked import stream_of

EQUATION = "q_dot = Mw*w + Mq*q + Md*servo_pitch + bias"


def flight_of(samples: np.ndarray) -> Flight:
    time = np.arange(len(samples)) * 0.01
    channels = dict(zip(("q", "w", "servo_pitch"), samples.T, strict=True))
    return Flight.from_arrays(time, channels, source="made.csv")


def test_a_log_becomes_estimates_over_time_with_bounds(tmp_path: Path) -> None:
    samples = short_period(1500, gust=0.02)
    samples[700:720, 1] = np.nan
    found = sp.track(flight_of(samples), EQUATION, held=["servo_pitch"], every=0.5)
    for name, value in TRUTH.items():
        estimate, sigma = found[name]
        assert abs(estimate - value) < 3.0 * sigma
    (one,) = found.followed
    assert [(round(s.start, 2), round(s.stop, 2)) for s in one.frozen] == [(6.99, 7.2)]
    assert np.isnan(one.values[0]).all()
    assert one.sigmas[-1, 0] < 0.5 * np.nanmax(one.sigmas[:, 0])
    assert "6.99 to 7.20 s: a value that is no number" in repr(found)
    assert "(rad/s^2)/(m/s)" in repr(found)
    found.save(tmp_path / "out")
    document = json.loads((tmp_path / "out" / "track.json").read_text())
    assert document["followed"][0]["values"]["Mq"] == pytest.approx(found["Mq"][0])
    assert "stood still" in (tmp_path / "out" / "report.html").read_text().lower()
    assert found.problems == ()
    code = found.code()
    assert set(code.files) == {"track_q.c", "track_q.h"}
    assert "operations a step" in code.notes[0]


def test_what_the_stream_does_not_tell_is_said(tmp_path: Path) -> None:
    samples = short_period(400)
    samples[:, 2] = 0.1
    found = sp.track(flight_of(samples), EQUATION, held=["servo_pitch"])
    assert found.problems == (f"'{EQUATION}' has coefficients that the log does not separate.",)
    assert "not separated" in repr(found)
    with pytest.raises(KeyError):
        found["Mq"]
    assert "Not separated by this stream" in found.page().banners[0][1]


def test_gusts_that_bias_are_told() -> None:
    calm, rough = (sp.track(flight_of(short_period(900, gust=g)), EQUATION, held=["servo_pitch"]) for g in (0.05, 0.8))
    assert calm.followed[0].notes == ()
    assert "bias the coefficients" in rough.followed[0].notes[0]
    assert "bias the coefficients" in repr(rough)
    told = sp.track(flight_of(short_period(900, gust=0.8)), EQUATION, held=["servo_pitch"], instrument=["servo_pitch"])
    assert told.followed[0].notes == ()
    assert told.to_document()["followed"][0]["instruments"] == ("servo_pitch",)
    with pytest.raises(ExportError, match="instruments: are for Python only"):
        told.code()


def test_slower_streams_keep_their_last_value_and_grow_stale() -> None:
    fast, slow = np.arange(0.0, 1.0, 0.01), np.arange(0.05, 0.5, 0.1)
    flight = Flight({"a": stream(fast, {"q": fast}), "b": stream(slow, {"w": slow})})
    time, table = stream_of(flight, ("q", "w"))
    np.testing.assert_array_equal(time, fast)
    assert np.isnan(table[:5, 1]).all()
    known = np.isfinite(table[:, 1])
    assert np.all(table[known, 1] <= time[known] + 1e-12)  # nothing from the future
    assert time[known].max() == pytest.approx(0.45 + 0.35, abs=0.011)


def test_models_give_their_equations_and_renamed_channels_are_found() -> None:
    model = sp.structure("yaw")
    with pytest.raises(IdentificationError, match="no equation can be estimated"):
        sp.track(flight_of(short_period(400)), vehicle=model)
    other = flight_of(short_period(600))
    renamed = sp.track(other, "r_dot = Nr*r + Nd*cmd + bias", rename={"r": "q", "cmd": "servo_pitch"})
    assert renamed["Nr"][0] != 0.0


@pytest.mark.parametrize(
    ("equation", "arguments", "error"),
    [
        ("q_dot = Ma*alpha", {}, FlightError),
        ("q_dot = Mq*q", {"delay": {"alpha": 0.1}}, IdentificationError),
        ("q_dot = Mq*q", {"held": ["servo_pich"]}, IdentificationError),
        ("q_dot = Mq*q", {"instrument": ["servo_pich"]}, IdentificationError),
        ("q_dot = Mq*q", {"instrument": ["q"]}, IdentificationError),
        ("q_dot = Mq*q", {"rate": 0.4}, SwashError),
        ([], {}, SwashError),
    ],
)
def test_what_cannot_be_tracked_is_refused(equation: str, arguments: dict[str, object], error: type) -> None:
    with pytest.raises(error):
        sp.track(flight_of(short_period(50)), equation, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(("rate", "high"), [(100.0, 2.5), (10.0, 2.0), (5.0, 1.0)])
def test_the_band_that_is_not_given_ends_where_the_rate_ends(rate: float, high: float) -> None:
    rows = short_period(3000)[:: round(100.0 / rate)]
    flown = Flight.from_arrays(np.arange(len(rows)) / rate, dict(zip(("q", "w", "servo_pitch"), rows.T, strict=True)))
    plan = sp.track(flown, EQUATION, held=["servo_pitch"]).followed[0].plan
    assert isinstance(plan, RegressionPlan)
    assert (min(plan.hertz), max(plan.hertz)) == pytest.approx((0.1, high), abs=0.05)
    with pytest.raises(IdentificationError, match="HIGH up to"):
        sp.track(flown, EQUATION, held=["servo_pitch"], band=(0.1, 0.21 * rate))


def test_an_estimator_for_a_stream_of_ones_own() -> None:
    estimator = recursive_estimator(EQUATION, rate=100, held=["servo_pitch"])
    for row in short_period(500, gust=0.02):
        estimator.step(0.01, row)
    found = estimator.estimate()
    assert found is not None
    assert found["Md"] == pytest.approx(-10.0, rel=0.05)
