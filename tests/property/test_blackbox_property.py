"""Blackbox logs cut or changed anywhere, and any bytes behind their mark, give a flight or a `FlightError`."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import made_blackbox_logs as made
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read

few = settings(max_examples=40, deadline=None, derandomize=True)
_RAMP = np.arange(60)
WHOLE = made.rotorflight({"gyroADC[0]": _RAMP, "mixer[0]": -3 * _RAMP}, between={20: made.event(30, 1, 0)})
HEADER = WHOLE[: WHOLE.index(b"H gyro_lpf1_static_hz:100\n") + 26]


def _read(content: bytes) -> Flight | None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bbl"
        path.write_bytes(content)
        with suppress(FlightError):
            return read(path)
    return None


def _check(flight: Flight | None) -> None:
    for channel in flight.channels if flight is not None else ():
        assert np.isfinite(flight.values(channel)).all()
        assert np.all(np.diff(flight.time(channel)) > 0.0)


@few
@given(st.binary(max_size=400))
def test_any_bytes_behind_the_mark(tail):
    _check(_read(made.MARK.encode() + tail))


@few
@given(st.binary(max_size=600))
def test_any_bytes_behind_a_header(tail):
    _check(_read(HEADER + tail))


@few
@given(st.data())
def test_changed_bytes(data):
    content = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(len(made.MARK), len(content) - 1))] = data.draw(st.integers(0, 255))
    _check(_read(bytes(content)))


@few
@given(st.integers(0, len(WHOLE)), st.integers(0, len(WHOLE)))
def test_a_stretch_taken_out(one, two):
    first, last = sorted((one, two))
    _check(_read(WHOLE[:first] + WHOLE[last:]))


def test_the_check_sees_a_number_that_is_none():
    flight = _read(WHOLE)
    assert flight is not None
    broken = flight.with_channel("p", np.where(_RAMP == 5, np.nan, flight.values("p")), like="p")
    with suppress(AssertionError):
        _check(broken)
        raise SystemError("nothing was seen")
