"""Logs as one figure: files of every kind, one clock, and what cannot be drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swashplate.api.plot_logs import align, plot_logs
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.reporting.figures.of_flight import spectrogram, spectrum
from swashplate.reporting.figures.themes import unpacked

RATE = 100.0


def _wander(time: np.ndarray, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return sum(a * np.sin(2 * np.pi * f * time + p) for a, f, p in rng.uniform((0.2, 0.2, 0), (1, 4, 6), (12, 3)))


def _log(*, late: float = 0.0, seed: int = 1, source: str = "one", epoch: float = 0.0) -> Flight:
    time = np.arange(3000) / RATE
    made = Flight.from_arrays(
        time, {"p": _wander(time + late, seed), "q": _wander(time + late, seed + 9)}, source=source
    )
    return replace(made, provenance=replace(made.provenance, epoch=epoch))


def test_logs_of_one_flight_lie_on_each_other_by_their_motion() -> None:
    found = align([_log(), _log(late=1.7, source="two")])
    assert found.shifts[1] == pytest.approx(1.7, abs=2e-3)
    assert found.words[0].startswith("two: +1.700 s, by the motion")


def test_other_flights_are_put_by_the_clock_or_the_start_and_said_so() -> None:
    one, other = _log(epoch=1e9), _log(seed=5, source="two", epoch=1e9 + 10.0)
    assert align([one, other]).words == ("two: +10.000 s, by the logs' clocks",)
    assert align([one, other], by="start").shifts == (0.0, 0.0)
    with pytest.raises(FlightError, match="agree with a correlation"):
        align([one, other], by="motion")
    with pytest.raises(FlightError, match="no clock that another log knows"):
        align([one, _log(seed=5)], by="clock")


def test_files_of_every_kind_are_written(tmp_path: Path) -> None:
    for suffix, head in (("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG"), ("html", b"<!DOCTYPE")):
        plot_logs(_log(), channels=["p"], path=tmp_path / "made" / f"a.{suffix}")
        assert (tmp_path / "made" / f"a.{suffix}").read_bytes().startswith(head)


def test_a_spectrum_has_the_power_of_its_channel() -> None:
    time = np.arange(6000) / RATE
    flight = Flight.from_arrays(time, {"u": 3.0 * np.sin(2 * np.pi * 12.5 * time)}, source="tone")
    (trace,) = spectrum([flight], channels=["u"]).spec["data"]
    hertz, power = unpacked(trace["x"]), unpacked(trace["y"])
    assert hertz[np.argmax(power)] == pytest.approx(12.5, abs=0.1)
    assert np.sum(power) * (hertz[1] - hertz[0]) == pytest.approx(0.5 * 3.0**2, rel=1e-2)
    (drawn,) = spectrogram(flight, channels=["u"]).spec["data"]
    strongest = np.array(drawn["y"])[np.array(drawn["z"]).argmax(axis=0)]
    assert np.all(np.abs(strongest - 12.5) < 1.0)


def test_what_cannot_be_drawn_is_said(tmp_path: Path) -> None:
    with pytest.raises(SwashError, match=r"ends in '\.jpg', expected one of \.pdf, \.svg, \.png, \.html"):
        plot_logs(_log(), path=tmp_path / "a.jpg")
    with pytest.raises(FlightError, match=r"no such channel\. Did you mean 'p'\? It has p, q|no such channel"):
        plot_logs(_log(), channels=["pp"])
    with pytest.raises(FlightError, match="shows one log, 2 were given"):
        plot_logs([_log(), _log()], kind="spectrogram")
    other = Flight.from_arrays(np.arange(100) / RATE, {"u": np.zeros(100)}, source="third")
    with pytest.raises(FlightError, match="third: p: has none of the channels"):
        plot_logs([_log(), other], channels=["p"])
    with pytest.raises(FlightError, match="samples in a row there, expected at least 32"):
        plot_logs(_log().between(0.0, 0.1), kind="spectrum")
