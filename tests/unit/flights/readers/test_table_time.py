"""The time of a table's rows: names, forms and units, and where nobody says the unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, UnitError
from swashplate.flights import epoch
from swashplate.flights.readers.table_time import time_name

START = 1772720400.0  # 2026-03-05T14:20:00Z


def _flight(folder: Path, head: str, stamps, **options):
    rows = [f"{stamp},{k}" for k, stamp in enumerate(stamps)]
    (folder / "log.csv").write_text("\n".join([f"{head},u [m/s]", *rows, ""]), encoding="utf-8")
    return sp.read(folder / "log.csv", **options)


def _times(k: int) -> tuple[str, str]:
    """Hour, minute and second of the k-th hundredth, and the hundredth."""
    return f"14:20:{k // 100:02d}", f"{k % 100:02d}"


STEPS = range(250)
FORMS = {
    "seconds": ("time [s]", [f"{k / 100:.2f}" for k in STEPS], 0.0),
    "microseconds of a clock": ("TimeUS", [10_000 * k + 77 for k in STEPS], 77e-6),
    "Unix seconds": ("Zeit (Unix)", [f"{1772720400 + k / 100:.2f}" for k in STEPS], START),
    "Unix milliseconds": ("timestamp [Unix]", [1772720400000 + 10 * k for k in STEPS], START),
    "Unix nanoseconds": ("#timestamp [ns]", [1772720400000000000 + 10_000_000 * k for k in STEPS], START),
    "ISO": ("time", [f"2026-03-05T{t}.{f}Z" for t, f in map(_times, STEPS)], START),
    "ISO with a space": ("Timestamp", [f"2026-03-05 {t}.{f}" for t, f in map(_times, STEPS)], START),
    "United States": ("time", [f"03/05/2026 02{t[2:]}.{f} PM" for t, f in map(_times, STEPS)], START),
    "Germany": ("time", [f"05.03.2026 {t}.{f}" for t, f in map(_times, STEPS)], START),
    "since": ("time [ms since 2026-03-05T14:20:00Z]", [10 * k for k in STEPS], START),
    "time of day": ("Time", [f"{t}.{f}" for t, f in map(_times, STEPS)], 51600.0),
}


@pytest.mark.parametrize(("head", "stamps", "start"), FORMS.values(), ids=FORMS)
def test_every_form_of_time(tmp_path: Path, head: str, stamps, start: float) -> None:
    flight = _flight(tmp_path, head, stamps)
    assert flight.epoch + flight.start == pytest.approx(start, abs=1e-6)
    assert np.diff(flight.time("u")) == pytest.approx(0.01, abs=1e-9)
    assert flight.provenance.damage == ()


def test_date_and_time_of_day_in_two_columns(tmp_path: Path) -> None:
    rows = [f"2026-03-05,{t}.{f},{k}" for k, (t, f) in enumerate(map(_times, STEPS))]
    (tmp_path / "log.csv").write_text("\n".join(["Date,Time,u [m/s]", *rows, ""]))
    flight = sp.read(tmp_path / "log.csv")
    assert flight.epoch + flight.start == START
    assert flight.channels == ("u",)
    channels = {"time": {"column": ["Date", "Time"]}, "v": {"column": "u"}}
    assert sp.read(tmp_path / "log.csv", mapping={"channels": channels}).epoch == START


def test_a_time_of_day_goes_on_after_midnight(tmp_path: Path) -> None:
    stamps = [f"23:59:59.{k}" for k in range(10)] + [f"00:00:00.{k}" for k in range(10)]
    flight = _flight(tmp_path, "Time", stamps)
    assert np.diff(flight.time("u")) == pytest.approx(0.1)


def test_a_mapping_that_names_no_time_takes_the_headers(tmp_path: Path) -> None:
    flight = _flight(tmp_path, "time [ms]", range(0, 100, 10), mapping={"channels": {"v": {"column": "u"}}})
    assert flight.rate("v") == pytest.approx(100.0)
    assert flight.channels == ("v",)


# ---- a unit that nobody says -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("step", "unit", "rate"), [(0.004, "s", 250.0), (4, "ms", 250.0), (4000, "us", 250.0), (4_000_000, "ns", 250.0)]
)
def test_a_unit_that_only_one_rate_of_logs_allows_is_taken_and_told(
    tmp_path: Path, step, unit: str, rate: float
) -> None:
    flight = _flight(tmp_path, "time", [step * k for k in range(50)])
    assert flight.rate("u") == pytest.approx(rate)
    assert any(f"time has no unit: taken in {unit}, in which" in note for note in flight.provenance.notes)
    # What is said wins.
    assert not any(
        "no unit" in note
        for note in _flight(tmp_path, f"time [{unit}]", [step * k for k in range(50)]).provenance.notes
    )


@pytest.mark.parametrize(
    ("step", "may"),
    [
        (0.1, "s .10 Hz. or ms"),
        (125, "ms .8 Hz. or us .8000 Hz."),
        (1e11, None),
        (5e-320, None),
    ],  # the last: by fuzzing
)
def test_a_unit_that_may_be_two_is_asked_for(tmp_path: Path, step: float, may: str | None) -> None:
    """10 Hz in seconds are 10 kHz in milliseconds, and 8 kHz of a Blackbox are 8 Hz in milliseconds."""
    with pytest.raises(UnitError, match=f"time: has no unit.*{may or '--unit time=s'}"):
        _flight(tmp_path, "time", [step * k for k in range(50)])


def test_rates_at_which_one_unit_is_sure() -> None:
    """The premise in numbers: from 32 to 1000 Hz no other unit gives a rate between 1 Hz and 32 kHz."""
    for rate in np.geomspace(33.0, 990.0, 20):
        others = [rate * 1000.0**k for k in (-3, -2, -1, 1, 2, 3)]
        assert all(other < 1.0 or other > 32e3 for other in others)


# ---- names and faults ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["t", "time"], "time"), (["TIME", "t"], "TIME"), (["Time", "TIME"], None), (["T", "u"], None),
        (["timestamp", "timestamp_sample"], "timestamp"), (["__time", "p"], "__time"), (["Zeit", "p"], "Zeit"),
        (["TimeUS", "TimeMS"], None), (["p", "q"], None),
    ],
)  # fmt: skip
def test_the_column_that_holds_time(names: list[str], found: str | None) -> None:
    assert time_name(names) == found


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("12:00:00 AM", None), ("03/05/2026 12:00:00 AM", START - 51600), ("03/05/2026 12:00 PM", START - 8400),
        ("13/05/2026 01:00:00 PM", None), ("03/05/2026 13:00:00 PM", None), ("03/05/2026 13:00:00", None),
        ("05.03.2026 14:20:00,25", START + 0.25), ("32.03.2026 14:20:00", None), ("2026-03-05T14:20:00Z", START),
    ],
)  # fmt: skip
def test_dates_are_read_where_day_and_month_are_sure(text: str, seconds: float | None) -> None:
    found = epoch.from_text(text)
    assert (found is None) == (seconds is None)
    assert seconds is None or float(found or 0) == seconds


def test_a_stamp_of_another_form_is_named(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match="'later' in line 4 is no date and time"):
        _flight(tmp_path, "time", ["2026-03-05T14:20:00Z", "2026-03-05T14:20:01Z", "later"])


def test_rows_without_a_time_are_lost_and_told(tmp_path: Path) -> None:
    flight = _flight(tmp_path, "time [s]", [0, 1, "", 3])
    assert flight.values("u").tolist() == [0.0, 1.0, 3.0]
    assert flight.provenance.damage == ("1 of 4 rows (25 %) are lost: their time is blank",)
