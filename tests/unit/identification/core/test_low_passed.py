"""Low-passed data and fits in time: refused where the history knows, failed where the spectra tell."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import FlightError
from swashplate.filtering.disturbances import Noise
from swashplate.flights.conditioning.condition import condition
from swashplate.flights.conditioning.filters import lowpass
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.tabular import write_csv
from swashplate.identification.core.low_passed import (
    noise_too_small,
    refuse_lowpassed,
    smoothed_outputs,
    without_floor,
)
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.identify import identify
from swashplate.models.linear.state_space_file import structure

RAW = Provenance(source="a.csv")


def _measured(cutoff: float = 0.0) -> Flight:
    """The ten seconds as a log of which nobody says that it is simulated, low-passed or not."""
    return replace(ten_seconds().condition(rate=100.0, cutoff=cutoff), provenance=RAW)


def _fit(flight: Flight) -> Result:
    return sp.identify(sp.vehicle("coax"), flight, free=FREE, method="output-error", tie=[TIE])


@lru_cache(maxsize=1)
def _whole() -> Result:
    return _fit(_measured())


def test_conditioning_filters_nothing_that_was_not_asked_for() -> None:
    steps = [step.operation for step in ten_seconds().condition(rate=100.0).history]
    assert "lowpass" not in steps


@pytest.mark.parametrize("method", ["filter-error", "output-error"])
def test_a_fit_of_a_low_passed_flight_is_refused(method: str) -> None:
    with pytest.raises(FlightError, match=r"low-pass at 15 Hz \(order 4\).*cutoff=0.*at most 37.5 Hz"):
        sp.identify(sp.vehicle("coax"), _measured(15.0), method=method)


def test_the_other_fits_in_time_refuse_it_too() -> None:
    flight = _measured(15.0)
    with pytest.raises(FlightError, match="low-pass at 15 Hz"):
        sp.identify(sp.vehicle("coax"), flight, free=["tau_f_upper"], outputs=["p"])
    with pytest.raises(FlightError, match="low-pass at 15 Hz"):
        identify(structure("rotor_body"), flight)


def test_a_low_pass_at_the_rate_that_is_left_is_no_harm() -> None:
    flight = _measured(15.0)
    refuse_lowpassed([flight.condition(rate=37.0, outliers=False, trim_ground=False, derive=False)])
    refuse_lowpassed([_measured(45.0)])
    with pytest.raises(FlightError):
        refuse_lowpassed([_measured(), flight])


def test_a_filter_that_the_history_does_not_know_fails_the_fit(tmp_path: Path) -> None:
    (path,) = write_csv(_measured(15.0), tmp_path / "smooth.csv")
    fit = _fit(condition(sp.read(path), rate=100.0, outliers=False, trim_ground=False, derive=False))
    assert fit.failed
    assert any("were low-passed before they were logged" in problem for problem in fit.problems)
    whole = _whole()
    assert not whole.failed
    assert not any("low-passed" in problem for problem in whole.problems)


@pytest.mark.parametrize("cutoff", [3.0, 5.0, 10.0, 15.0, 25.0])
def test_the_spectra_tell_every_corner_up_to_a_quarter_of_the_rate(cutoff: float) -> None:
    coax = sp.vehicle("coax")
    flight = _measured()
    assert smoothed_outputs(records(flight, coax), [flight]) == []
    smooth = replace(lowpass(flight, cutoff=cutoff), history=flight.history)
    (problem,) = smoothed_outputs(records(smooth, coax), [smooth])
    assert "x, y, z, phi, theta, psi" in problem


def test_white_noise_has_a_floor_and_a_filter_takes_it() -> None:
    rng = np.random.default_rng(2)
    motion = np.cumsum(np.cumsum(rng.standard_normal(4000)))
    noisy = motion / np.ptp(motion) + 1e-3 * rng.standard_normal(4000)
    assert without_floor(noisy) < 10.0
    flight = Flight({"uniform": stream(np.arange(4000) / 100.0, {"x": noisy})})
    assert without_floor(lowpass(flight, cutoff=15.0).values("x")) > 40.0


def test_noise_that_no_sensor_has_is_said() -> None:
    flight = _measured()
    assert noise_too_small(Noise(), [flight]) == []
    found = noise_too_small(Noise(sensor_position=1e-7, sensor_angle=1e-7), [flight])
    assert len(found) == 2
    assert "sensor_position = 1e-07 m per sample: no sensor is that good" in found[0]
    assert noise_too_small(Noise(sensor_position=1e-7), [ten_seconds()]) == []  # a simulation may have none
