"""Flights from arrays and data frames, and back."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, UnitError
from swashplate.flights.flight import Flight, stream

TIME = np.arange(200) / 100.0
CHANNELS = {"p": np.sin(TIME), "phi": np.cos(TIME), "knob": TIME**2}


def test_degrees_become_radians_and_what_the_schema_does_not_know_keeps_its_unit() -> None:
    flight = sp.Flight.from_arrays(TIME, CHANNELS, units={"p": "deg/s", "phi": "deg", "knob": "m"}, source="mine")
    np.testing.assert_allclose(flight.values("p"), np.radians(np.sin(TIME)))
    np.testing.assert_allclose(flight.values("phi"), np.radians(np.cos(TIME)))
    assert flight["knob"].attrs["units"] == "m"
    assert flight.provenance.source == "mine"


def test_unix_time_becomes_small_and_is_kept_as_epoch() -> None:
    flight = Flight.from_arrays(1.7e9 + TIME, CHANNELS)
    assert flight.start < 1.0
    assert flight.epoch == 1.7e9


def test_a_wrong_unit_a_wrong_length_and_a_misspelt_name_are_refused() -> None:
    with pytest.raises(UnitError, match="p"):
        Flight.from_arrays(TIME, CHANNELS, units={"p": "m"})
    with pytest.raises(FlightError, match="p: has"):
        Flight.from_arrays(TIME, {"p": TIME[:-1]})
    with pytest.raises(FlightError, match="roll: has a unit but no values"):
        Flight.from_arrays(TIME, CHANNELS, units={"roll": "deg"})
    with pytest.raises(FlightError, match="increasing"):
        Flight.from_arrays(TIME[::-1], CHANNELS)


def test_a_data_frame_there_and_back_is_the_same_flight() -> None:
    flight = Flight.from_arrays(TIME, CHANNELS, units={"knob": "m"})
    frame = flight.to_dataframe()
    assert frame.attrs["units"] == {"p": "rad/s", "phi": "rad", "knob": "m"}
    again = Flight.from_dataframe(frame, units=frame.attrs["units"])
    for name in CHANNELS:
        np.testing.assert_array_equal(again.values(name), flight.values(name))
        np.testing.assert_array_equal(again.time(name), flight.time(name))


def test_of_several_streams_one_has_to_be_named() -> None:
    flight = Flight({"fast": stream(TIME, {"p": TIME}), "slow": stream(TIME[::4], {"phi": TIME[::4]})})
    with pytest.raises(FlightError, match=r"fast, slow.*which of them"):
        flight.to_dataframe()
    with pytest.raises(FlightError, match="'medium' is none of them"):
        flight.to_dataframe(stream="medium")
    assert list(flight.to_dataframe(stream="slow").columns) == ["phi"]
