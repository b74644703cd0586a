"""Large stamps: what readers take off them, that nothing is lost by it, and that the epoch stays with the flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, UnitError
from swashplate.flights.epoch import from_iso, iso, rebased
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance
from swashplate.flights.tabular import write_csv
from swashplate.identification.core.records import uniform_table

ZERO = 1_772_681_685
STEPS = [f"{k // 100}.{k % 100:02d}" for k in range(53, 653)]
"""Stamps of 6 s at 100 Hz, as text."""


def _log(folder: Path, stamps: list[str], *, unit: str = "s", name: str = "log.csv") -> Path:
    wave = np.sin(0.05 * np.arange(len(stamps)))
    lines = [f"{t},{a!r},{-a!r}" for t, a in zip(stamps, wave.tolist(), strict=True)]
    path = folder / name
    path.write_text("\n".join([f"time [{unit}],phi [rad],servo_roll", *lines, ""]), encoding="utf-8")
    return path


def _unix(steps: list[str], digits: int) -> list[str]:
    """Unix time in units of 10^-digits s, as whole numbers."""
    return [str(ZERO * 10**digits + round(float(step) * 10**digits)) for step in steps]


@pytest.mark.parametrize(
    ("stamps", "unit"),
    [
        ([f"{ZERO + int(s.split('.')[0])}.{s.split('.')[1]}" for s in STEPS], "s"),
        (_unix(STEPS, 3), "ms"),
        (_unix(STEPS, 6), "us"),
        (_unix(STEPS, 9), "ns"),
        ([f"2026-03-05T03:34:{45 + int(s.split('.')[0])}.{s.split('.')[1]}Z" for s in STEPS], ""),
        ([f"2026-03-05 04:34:{45 + int(s.split('.')[0])}.{s.split('.')[1]}+01:00" for s in STEPS], "UTC"),
    ],
)
def test_every_way_to_write_unix_time_gives_the_same_small_times(tmp_path: Path, stamps: list[str], unit: str) -> None:
    flight = sp.read(_log(tmp_path, stamps, unit=unit))
    assert flight.epoch == ZERO
    assert flight.time("phi").tolist() == [float(step) for step in STEPS]  # exact, to the last bit
    uniform_table(flight, ("phi",), who="the test")
    assert any("2026-03-05T03:34:45Z" in line for line in sp.inspect(flight).notes)


def test_a_log_of_its_own_clock_is_left_alone(tmp_path: Path) -> None:
    flight = sp.read(_log(tmp_path, STEPS))
    assert flight.epoch == 0.0
    assert flight.time("phi")[0] == 0.53
    assert not any("time zero" in line for line in sp.inspect(flight).notes)


def test_all_streams_and_events_move_together() -> None:
    a, b = ZERO + 0.5 + np.arange(10) / 10.0, ZERO + 2.25 + np.arange(10) / 4.0
    raw = Flight(
        {"a": stream(a, {"phi": a}), "b": stream(b, {"voltage": b})},
        Provenance(source="a", events=(Event(ZERO + 3.0, "message", "hello"),)),
        segments=((ZERO + 1.0, ZERO + 2.0),),
    )
    flight = rebased(raw)
    assert (flight.time("phi")[0], flight.time("voltage")[0], flight.epoch) == (0.5, 2.25, ZERO)
    assert (flight.provenance.events[0].time, flight.segments) == (3.0, ((1.0, 2.0),))
    assert rebased(flight) is flight


def test_two_logs_lie_on_one_clock_through_the_epoch(tmp_path: Path) -> None:
    stamps = _unix(STEPS, 6)
    one = sp.read(_log(tmp_path, stamps, unit="us", name="one.csv"))
    two = sp.read(_log(tmp_path, stamps[200:], unit="us", name="two.csv"))
    np.testing.assert_allclose(two.epoch - one.epoch + two.time("phi"), one.time("phi")[200:], rtol=0, atol=1e-12)


def test_the_epoch_stays_through_conditioning_and_files(tmp_path: Path) -> None:
    flight = sp.read(_log(tmp_path, _unix(STEPS, 3), unit="ms"))
    made = flight.condition(rate=50, cutoff=0, derive=False)
    assert made.epoch == made.between(2.0, 3.0).epoch == ZERO
    assert sp.read(made.save(tmp_path / "made.nc")).epoch == ZERO
    (path,) = write_csv(made, tmp_path / "made.csv")
    again = sp.read(path)
    assert path.read_text(encoding="utf-8").startswith("time [s since 2026-03-05T03:34:45Z],")
    assert again.epoch == ZERO
    assert again.time("phi").tolist() == made.time("phi").tolist()


def test_a_fraction_of_a_second_survives_as_a_date() -> None:
    for value in (ZERO + 0.1234567, float(ZERO), 1.5, -0.25):
        found = from_iso(iso(value))
        assert found is not None
        assert float(found) == value
    assert from_iso("5.3.2026 03:34") is None
    assert from_iso("2026-13-05T03:34:45Z") is None


def test_what_is_no_date_is_refused(tmp_path: Path) -> None:
    mixed = [f"2026-03-05T03:34:{45 + k}Z" for k in range(5)] + ["yesterday"]
    with pytest.raises(FlightError, match=r"'yesterday' in line 7 is no date"):
        sp.read(_log(tmp_path, mixed))
    with pytest.raises(UnitError, match="since"):
        sp.read(_log(tmp_path, STEPS, unit="s since Monday"))
