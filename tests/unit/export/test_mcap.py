"""MCAP files are read back with the format's own library: every sample, unit and time."""

from __future__ import annotations

import io
import json
import sys

import numpy as np
import pytest
import xarray as xr

from swashplate.errors import ExportError, MissingLibraryError
from swashplate.export.mcap import as_mcap
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance

reader = pytest.importorskip("mcap.reader", reason="the extra 'mcap' is not installed")


def flight(**about) -> Flight:
    fast, slow = np.arange(50) / 100.0 + 1.0, np.arange(5) / 10.0 + 1.0
    streams = {
        "rates": stream(fast, {"p": np.sin(fast), "debug_0": np.arange(50.0)}),
        "battery": stream(slow, {"voltage": 12.0 - slow}),
    }
    return Flight(streams, Provenance(source="made", parameters={"GAIN": 0.25}, **about))


def messages(content: bytes):
    return [
        (schema, channel, message, json.loads(message.data))
        for schema, channel, message in reader.make_reader(io.BytesIO(content)).iter_messages()
    ]


def test_every_sample_reads_back_with_its_time_and_unit() -> None:
    logged = flight(epoch=1_700_000_000.0, events=(Event(1.2, "mode", "hover"),))
    found = messages(as_mcap(logged))
    for topic, channel in (("/rates", "p"), ("/rates", "debug_0"), ("/battery", "voltage")):
        mine = [entry for entry in found if entry[1].topic == topic]
        assert [row[channel] for *_, row in mine] == logged.values(channel).tolist()
        stamps = np.array([message.log_time for _, _, message, _ in mine])
        expected = (logged.epoch + logged.time(channel)) * 1e9
        assert np.abs(stamps - expected).max() < 1e3  # float64 holds 2023 to 0.24 us
        assert [(row["time"]["sec"], row["time"]["nsec"]) for *_, row in mine] == [
            divmod(int(s), 10**9) for s in stamps
        ]
        assert [message.sequence for _, _, message, _ in mine] == list(range(len(mine)))
    times = [message.log_time for _, _, message, _ in found]
    assert times == sorted(times)
    schema, channel, *_ = next(entry for entry in found if entry[1].topic == "/rates")
    assert schema.encoding == "jsonschema"
    described = json.loads(schema.data)["properties"]
    assert described["p"]["unit"] == channel.metadata["p"] == "rad/s"
    assert "roll rate" in described["p"]["description"]
    metadata = {entry.name: entry.metadata for entry in reader.make_reader(io.BytesIO(as_mcap(logged))).iter_metadata()}
    assert metadata["parameters"] == {"GAIN": "0.25"}
    assert metadata["events"] == {"0": "1.2 mode: hover"}
    assert metadata["swashplate"]["source"] == "made"


def test_numbers_that_are_none_are_null_and_early_clocks_are_moved() -> None:
    early = Flight({"s": stream(np.array([-2.0, -1.0]), {"p": np.array([np.nan, 1.0])})})
    content = as_mcap(early)
    assert [row["p"] for *_, row in messages(content)] == [None, 1.0]
    assert [message.log_time for _, _, message, _ in messages(content)] == [0, 10**9]
    about = {e.name: e.metadata for e in reader.make_reader(io.BytesIO(content)).iter_metadata()}["swashplate"]
    assert about["added_to_times"] == "2.0"


def test_samples_within_a_nanosecond_are_all_there() -> None:
    close = Flight({"s": stream(np.array([0.0, 1e-10, 2e-10]), {"p": np.array([1.0, 2.0, 3.0])})})
    assert [row["p"] for *_, row in messages(as_mcap(close))] == [1.0, 2.0, 3.0]


def test_what_cannot_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ExportError, match="no sample"):
        as_mcap(Flight({"s": xr.Dataset(coords={"time": ("time", np.zeros(0))})}))
    with pytest.raises(ExportError, match="nanoseconds of 64 bits"):
        as_mcap(Flight({"s": stream(np.array([0.0, 1e12]), {"p": np.zeros(2)})}))
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(MissingLibraryError, match=r"needs the library mcap.*'swashplate\[mcap\]'"):
        as_mcap(flight())
