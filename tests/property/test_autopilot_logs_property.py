"""Autopilot logs cut anywhere or changed anywhere give a flight, or a `FlightError`, and nothing else."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from made_autopilot_logs import PX4LOG, ardupilot_rows, dataflash, dataflash_text, px4_rows, ulog
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import clocked
from swashplate.flights.readers.read import read

few = settings(max_examples=12, deadline=None, derandomize=True)

SEEDS = {
    "a.bin": dataflash(ardupilot_rows(until=24.0)),
    "a.log": dataflash_text(ardupilot_rows(until=23.0)).encode(),
    "a.px4log": dataflash(px4_rows(), PX4LOG),
    "a.ulg": ulog(40, dropout=True),
}


def _read_bytes(content: bytes, name: str) -> Flight | None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        with suppress(FlightError):
            return read(path)
    return None


def _check(flight: Flight | None) -> None:
    for channel in flight.channels if flight is not None else ():
        assert np.isfinite(flight.values(channel)).all()
        assert (np.diff(flight.time(channel)) > 0).all()


@pytest.mark.parametrize("name", SEEDS)
@few
@given(data=st.data())
def test_a_log_that_is_cut_anywhere(name: str, data: st.DataObject) -> None:
    whole = _read_bytes(SEEDS[name], name)
    assert whole is not None
    at = data.draw(st.integers(1, len(SEEDS[name]) - 1))
    part = _read_bytes(SEEDS[name][:at], name)
    _check(part)
    for channel in set(part.channels) & set(whole.channels) if part is not None else ():
        # What is left is the beginning of the whole: nothing is invented. (Text: the cut may shorten a number.)
        n = part.time(channel).size - (name == "a.log")
        np.testing.assert_array_equal(part.time(channel)[:n], whole.time(channel)[:n])
        np.testing.assert_array_equal(part.values(channel)[:n], whole.values(channel)[:n])


@pytest.mark.parametrize("name", SEEDS)
@few
@given(data=st.data())
def test_a_log_with_changed_bytes(name: str, data: st.DataObject) -> None:
    content = bytearray(SEEDS[name])
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["write", "cut", "repeat"])):
            case "write":
                content[at] = data.draw(st.integers(0, 255))
            case "cut":
                del content[at : at + data.draw(st.integers(1, 200))]
                content = content or bytearray(b",")
            case _:
                content[at:at] = content[at : at + data.draw(st.integers(1, 200))]
    _check(_read_bytes(bytes(content), name))


@few
@given(st.lists(st.floats(allow_nan=True, width=16), max_size=30))
def test_the_longest_increasing_stamps_are_as_many_as_can_be(times: list[float]) -> None:
    stamps = np.asarray(times, dtype=np.float64)
    kept = stamps[clocked.longest_increasing(stamps)]
    assert (np.diff(kept) > 0).all()
    longest = [0] * len(times)  # by the quadratic method
    for i, value in enumerate(times):
        if value == value:
            longest[i] = 1 + max((longest[j] for j in range(i) if times[j] < value), default=0)
    if np.isfinite(stamps).all():
        assert kept.size == max(longest, default=0)
