"""The map: the estimate's track where there is one, else the receiver's, in metres from its first place."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights import example_logs
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.map import map_of
from swashplate.links.logs.opened import CHECKING, Opened


def opened(path: Path) -> Opened:
    made = Opened(1, path, Read(path.name))
    made.load(made.read)
    for thread in threading.enumerate():
        if thread.name == CHECKING:
            thread.join(60.0)
    return made


def test_the_receivers_places_become_metres() -> None:
    path = example_logs.example("ordinary_flight")
    assert path is not None
    log = opened(path)
    found = map_of(log)
    assert "latitude and longitude" in found["words"]
    assert found["north"][0] == found["east"][0] == 0.0
    latitude = log.shown("latitude").values
    expected = np.radians(latitude - latitude[0]) * 6_371_000.0
    assert found["north"] == pytest.approx(expected, abs=1e-3)
    flight = log.ready
    log.flight = replace(flight, streams={n: d for n, d in flight.streams.items() if "latitude" not in d})
    again = map_of(log)
    assert "GPS.Lat" in again["words"], "the field of the log where there is no such channel"
    assert again["north"] == pytest.approx(expected, abs=1e-3)


def test_the_estimates_track_comes_first() -> None:
    path = example_logs.example("coax_flight")
    assert path is not None
    found = map_of(opened(path))
    assert "x and y" in found["words"]


def test_a_log_without_a_place_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,p [rad/s]\n" + "".join(f"{0.01 * k},{np.sin(k)}\n" for k in range(100)))
    with pytest.raises(FlightError, match="no place"):
        map_of(opened(path))
