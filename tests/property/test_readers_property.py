"""Whatever bytes a reader is given, it gives a flight or a `FlightError`; what is written reads back the same."""

from __future__ import annotations

import io
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from made_logs import coax_record, motive, vicon
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import ProcessingStep, Provenance
from swashplate.flights.readers.read import read
from swashplate.flights.tabular import write_csv

few = settings(max_examples=10, deadline=None, derandomize=True)


def _mat(*, compressed: bool) -> bytes:
    file = io.BytesIO()
    savemat(file, {"Data": coax_record(4)}, do_compression=compressed)
    return file.getvalue()


SEEDS = {
    "mat": _mat(compressed=False),
    "packed mat": _mat(compressed=True),
    "csv": b"time [s],phi [deg],x [m]\n0,1,2\n0.1,2,3\n0.2,3,4\n",
    "vicon": vicon(["1,0,0.1,0,0,1,1,1", "2,0,,,,,,", "3,0,0.1,0,0,1,1,2"]).encode(),
    "optitrack": motive(["0,0,0,0,0,1,1,2,3,0,0,0,0", "1,0.01,0,0,0,1,1,2,3,0,0,0,0"]).encode(),
}


def _read_bytes(content: bytes, name: str = "flight.log") -> Flight | None:
    """The flight in these bytes, None where they are refused as they should be; any other error is a failure."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        with suppress(FlightError):
            return read(path)
    return None


@pytest.mark.parametrize("name", SEEDS)
def test_the_seeds_are_flights(name: str) -> None:
    assert _read_bytes(SEEDS[name]) is not None


@few
@given(st.binary(max_size=600), st.sampled_from(["", *(seed[:136].decode("latin-1") for seed in SEEDS.values())]))
def test_random_bytes(content: bytes, start: str) -> None:
    _read_bytes(start.encode("latin-1") + content)


@pytest.mark.parametrize("name", SEEDS)
@few
@given(st.data())
def test_changed_bytes(name: str, data: st.DataObject) -> None:
    """Real files with a few bytes overwritten, cut or repeated."""
    content = bytearray(SEEDS[name])
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["write", "cut", "repeat"])):
            case "write":
                content[at] = data.draw(st.integers(0, 255))
            case "cut":
                del content[at : at + data.draw(st.integers(1, 40))]
                content = content or bytearray(b",")
            case _:
                content[at:at] = content[at : at + data.draw(st.integers(1, 200))]
    flight = _read_bytes(bytes(content))
    if flight is not None:
        for channel in flight.channels:
            assert np.isfinite(flight.values(channel)).all()
            assert (np.diff(flight.time(channel)) > 0).all()


@few
@given(st.text(alphabet=st.sampled_from(list('time[s],;\t\n"#0123456789.-+eNa ü')), max_size=300))
def test_random_tables(text: str) -> None:
    _read_bytes(text.encode(), "log.csv")


finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1, max_size=12)


@st.composite
def flights(
    draw: st.DrawFn,
    *,
    values: st.SearchStrategy[float],
    channels: st.SearchStrategy[str],
    stamps: st.SearchStrategy[float],
) -> Flight:
    streams = {}
    free = draw(st.lists(channels, min_size=2, max_size=4, unique=True).filter(lambda found: "time" not in found))
    for index, chunk in enumerate((free[:1], free[1:])):
        time = sorted(draw(st.lists(stamps, min_size=2, max_size=6, unique=True)))
        data = {name: draw(st.lists(values, min_size=len(time), max_size=len(time))) for name in chunk}
        streams[f"stream {index}"] = stream(time, data)
    segments = draw(st.lists(st.tuples(finite, finite), max_size=3))
    steps = draw(
        st.lists(
            st.builds(ProcessingStep, names, st.dictionaries(names, finite | names | st.none(), max_size=3)), max_size=3
        )
    )
    provenance = draw(st.builds(Provenance, names, names, notes=st.lists(names, max_size=2).map(tuple)))
    return Flight(streams, provenance, tuple(steps), tuple(segments))


@few
@given(
    flights(
        values=st.floats(),
        channels=st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True),
        stamps=st.floats(-1e20, 1e20, exclude_min=True, exclude_max=True),  # beyond it no clock is read
    )
)
def test_netcdf_loses_nothing(flight: Flight) -> None:
    with tempfile.TemporaryDirectory() as folder:
        loaded = Flight.load(flight.save(Path(folder) / "a.nc"))
    assert list(loaded.streams) == list(flight.streams)
    for name, data in flight.streams.items():
        assert loaded.streams[name].identical(data)
    assert (loaded.provenance, loaded.history, loaded.segments) == (flight.provenance, flight.history, flight.segments)


@few
@given(
    flights(
        values=finite,
        channels=st.sampled_from(["x", "phi", "p", "servo_roll", "omega_lower", "voltage", "odd"]),
        stamps=st.floats(-1e6, 1e6, exclude_min=True, exclude_max=True),  # larger ones are an epoch, and taken off
    )
)
def test_csv_reads_back_exactly(flight: Flight) -> None:
    with tempfile.TemporaryDirectory() as folder:
        paths = write_csv(flight, Path(folder) / "a.csv")
        back = [read(path).streams["log"] for path in paths]
    for data, found in zip(flight.streams.values(), back, strict=True):
        assert found.identical(data)
