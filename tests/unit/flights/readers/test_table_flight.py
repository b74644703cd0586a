"""Flights from tables: names with indices, words, blanks as gaps or as rates of their own, all faults at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, UnitError
from swashplate.flights.readers.checks import Faults


def _file(folder: Path, text: str) -> Path:
    (folder / "log.csv").write_text(text, encoding="utf-8")
    return folder / "log.csv"


def _table(folder: Path, head: str, cells, n: int = 100) -> Path:
    """A table at 100 Hz; `cells` gives the row behind its time."""
    return _file(folder, "\n".join([f"time [s],{head}", *[f"{k / 100:.2f},{cells(k)}" for k in range(n)], ""]))


# ---- names -----------------------------------------------------------------------------------------------------------
def test_parts_of_a_vector_are_no_units(tmp_path: Path) -> None:
    path = _table(
        tmp_path, "xyz[0],xyz[1],xyz[2],mixer_roll[1],gyro[0] (deg/s),slip %", lambda k: f"{k},1,2,0.5,180,50"
    )
    flight = sp.read(path)
    assert flight.channels == ("xyz[0]", "xyz[1]", "xyz[2]", "mixer_roll", "gyro[0]", "slip")
    assert flight.values("mixer_roll")[0] == 0.5  # [1] without another index is the unit
    assert flight.values("gyro[0]")[0] == pytest.approx(np.pi)
    assert flight.values("slip")[0] == 0.5
    channels = {"time": {"column": "time"}, "p": {"column": "xyz[2]", "unit": "deg/s"}}
    assert sp.read(path, mapping={"channels": channels}).values("p")[0] == pytest.approx(np.deg2rad(2.0))


def test_words_and_blank_columns_are_passed_over_and_said(tmp_path: Path) -> None:
    flight = sp.read(_table(tmp_path, "mode,message,,u [m/s]", lambda k: f"LOITER,,{k},{k}"))
    assert flight.channels == ("u",)
    told = " ".join(flight.provenance.notes)
    for said in ("mode holds no numbers", "message holds nothing", "column 4 has no name"):
        assert said in told
    assert flight.provenance.damage == ()
    # Of a channel of the schema they are a fault, and of one that is mapped.
    with pytest.raises(FlightError, match="u: 'LOITER' in line 2 is not a number"):
        sp.read(_table(tmp_path, "u [m/s],v [m/s]", lambda k: f"LOITER,{k}"))
    path = _table(tmp_path, "mode,v [m/s]", lambda k: f"LOITER,{k}")
    with pytest.raises(FlightError, match="p: 'LOITER' in line 2"):
        sp.read(path, mapping={"channels": {"p": {"column": "mode", "unit": "rad/s"}}})


# ---- blanks ----------------------------------------------------------------------------------------------------------
def test_a_channel_of_a_slower_rate_is_a_stream_of_its_own(tmp_path: Path) -> None:
    path = _table(tmp_path, "p [rad/s],mixer_roll", lambda k: f"{k},{k / 100 if k % 4 == 0 else ''}")
    flight = sp.read(path)
    assert (flight.rate("p"), flight.rate("mixer_roll")) == pytest.approx((100.0, 25.0))
    assert flight.values("mixer_roll") == pytest.approx(np.arange(0.0, 1.0, 0.04))
    assert flight.provenance.damage == ()
    assert "mixer_roll: 75 of 100 cells (75 %) are blank: a stream of its own, at 25 Hz" in flight.provenance.notes


def test_two_topics_that_never_share_a_row(tmp_path: Path) -> None:
    flight = sp.read(_table(tmp_path, "p [rad/s],mixer_roll", lambda k: f"{k}," if k % 2 else f",{k / 100}"))
    assert flight.rate("p") == pytest.approx(50.0) == flight.rate("mixer_roll")
    assert flight.provenance.damage == ()


@pytest.mark.parametrize("blank", ["", "NaN", "nan", "n/a", "-"])
def test_a_missing_number_is_a_gap_and_a_loss(tmp_path: Path, blank: str) -> None:
    path = _table(tmp_path, "p [rad/s],mixer_roll", lambda k: f"{blank if k == 7 else k},{k / 100}")
    flight = sp.read(path)
    assert 0.07 not in flight.time("p").round(6)
    assert flight.stream_of("p") == flight.stream_of("mixer_roll")
    assert flight.provenance.damage == ("1 of 100 rows (1 %) are lost: a number is missing in p (1)",)


def test_a_channel_that_stops_early_does_not_cost_the_others_their_rows(tmp_path: Path) -> None:
    flight = sp.read(_table(tmp_path, "p [rad/s],mixer_roll", lambda k: f"{k},{k / 100 if k < 60 else ''}"))
    assert (flight.time("p").size, flight.time("mixer_roll").size) == (100, 60)
    assert flight.provenance.damage == ("mixer_roll: 40 of 100 cells (40 %) are blank: these samples are lost",)


def test_a_full_table_is_one_stream_and_loses_nothing(tmp_path: Path) -> None:
    flight = sp.read(_table(tmp_path, "p [rad/s],mixer_roll", lambda k: f"{k},{k / 100}"))
    assert list(flight.streams) == ["log"]
    assert flight.provenance.damage == ()
    assert not any("blank" in note for note in flight.provenance.notes)


# ---- faults ----------------------------------------------------------------------------------------------------------
def test_all_faults_of_a_table_are_told_at_once(tmp_path: Path) -> None:
    path = _file(tmp_path, "t,phi,p [m],q [rad/s],u [m/s],u [m/s],mode\n0,1,2,x,4,5,A\n1,2,3,y,5,6,B\n2,3,4,5,6,7,C\n")
    with pytest.raises(FlightError) as told:
        sp.read(path, units={"r": "rad/s"})
    text = str(told.value)
    for fault in (
        "has 6 faults",
        "u: the name stands twice",
        "r: units are given for a column that the file lacks",
        "phi: has no unit",
        "p: unit 'm' is a unit of [m], expected one of [rad/s]",
        "q: 'x' in line 2 is not a number (2 of 3 cells are none)",
        "time: has no unit",
        "mode holds no numbers",
    ):
        assert fault in text, text


def test_all_faults_of_a_mapping_are_told_at_once(tmp_path: Path) -> None:
    channels = {
        "time": {"column": "t", "unit": "s"},
        "p": {"colum": 1},
        "q": {"column": "z"},
        "r": {"column": 2, "factor": "x"},
    }
    with pytest.raises(
        FlightError, match=r"3 faults: \(1\) p: .*\(2\) q: there is no column 'z'; the file has t, a.*\(3\) r"
    ):
        sp.read(_file(tmp_path, "t,a\n0,1\n1,2\n"), mapping={"channels": channels})


def test_one_fault_stands_alone_and_units_stay_faults_of_units() -> None:
    faults = Faults("log.csv")
    faults.refuse()
    with faults.gathered():
        raise UnitError("has no unit.", where="log.csv", channel="p", hint="Give it.")
    with pytest.raises(UnitError, match=r"^log\.csv: p: has no unit\. Give it\.$"):
        faults.refuse()
    with faults.gathered():
        raise UnitError("has no unit.", where="other.toml", channel="q", hint="Give it.")
    with pytest.raises(
        UnitError,
        match=r"^log\.csv: has 2 faults: \(1\) p: has no unit\. \(2\) other\.toml: q: has no unit\. Give it\.$",
    ):
        faults.refuse()
    faults.add(FlightError("holds no table."))
    with pytest.raises(FlightError) as told:
        faults.refuse(beside=["words"])
    assert not isinstance(told.value, UnitError)
    assert "Beside that: words." in str(told.value)
