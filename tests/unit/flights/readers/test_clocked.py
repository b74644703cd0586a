"""One rule for what a log's clock did: turns are undone, restarts cut, copies dropped, and what is lost is told."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.readers import clocked
from swashplate.flights.readers.clocked import DAY, TURN, Remarks, longest_run, made_stream, unturned, usable

MICRO = TURN * 1e-6
RATE = 250.0
STEADY = np.arange(2000) / RATE


def _usable(time, *columns, bad_stamps="drop", **more):
    told = Remarks()
    kept, mask = usable(time, columns, where="log.csv", bad_stamps=bad_stamps, remarks=told, **more)
    return kept, mask, told


# ---- counters that turn over -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(("tick", "start"), [(1e-6, 4291.967296), (1e-3, 4294964.0), (1e-9, 4.0)])
def test_a_counter_of_32_bits_is_counted_on(tick, start):
    true = start + STEADY
    kept, mask, told = _usable(np.mod(true, TURN * tick), STEADY, tick=tick)
    assert mask.all()
    # A counter in nanoseconds turns over twice in 8 s.
    assert np.diff(kept) == pytest.approx(np.diff(true), abs=1e-9)
    assert kept[-1] - kept[0] == pytest.approx(STEADY[-1])
    assert told.damage == []
    assert "turned over" in told.notes[0]


def test_a_signed_counter_is_counted_on():
    kept, mask, told = _usable(np.mod(2146.0 + STEADY + MICRO / 2, MICRO) - MICRO / 2, STEADY)
    assert mask.all()
    assert kept[-1] - kept[0] == pytest.approx(STEADY[-1])
    assert not told.damage


def test_messages_that_overtake_each_other_at_the_seam_are_set_right():
    true = MICRO - 4.0 + STEADY
    swapped = np.arange(true.size)
    swapped[999:1001] = (1000, 999)
    found, turns = unturned(np.mod(true[swapped], MICRO), [MICRO])
    assert turns == 1
    assert found == pytest.approx(true[swapped])


@pytest.mark.parametrize("start", [100.0, MICRO - 10.0])
def test_a_restart_is_no_turn(start):
    """The clock falls by another amount than a counter's size, or goes on too late for the rate of the log."""
    time = np.concatenate([start + STEADY, STEADY])
    assert unturned(time, [MICRO])[1] == 0
    assert "starts anew" in _usable(time, time)[2].damage[0]


def test_nanoseconds_are_believed_only_of_a_counter_in_nanoseconds():
    """A log that was begun anew after 4.3 s is no turn of its clock in microseconds."""
    time = np.concatenate([np.arange(1073) / RATE, STEADY])
    assert _usable(time, time)[2].damage
    assert not _usable(time, time, tick=1e-9)[2].damage


def test_a_time_of_day_goes_on_after_midnight():
    kept, mask, told = _usable(np.mod(DAY - 4.0 + STEADY, DAY), STEADY, turns=(DAY,))
    assert mask.all()
    assert kept[-1] - kept[0] == pytest.approx(STEADY[-1])
    assert not told.damage


# ---- restarts, copies, losses ----------------------------------------------------------------------------------------
def test_two_runs_are_never_spliced():
    """The longest increasing row of stamps could take the beginning of one flight and the end of another."""
    short, long = STEADY[:800], STEADY[:1200]
    flights = np.concatenate([np.zeros(800), np.ones(1200)])
    kept, mask, told = _usable(np.concatenate([short, long]), flights)
    assert set(flights[mask]) == {1.0}
    assert kept == pytest.approx(long)
    assert told.damage == [
        "the clock starts anew once; only the longest run was read: 800 of 2000 samples (40 %) are lost"
    ]
    with pytest.raises(FlightError, match=r"goes backwards at sample 800 .*starts anew there.*--drop-bad-stamps"):
        _usable(np.concatenate([short, long]), flights, bad_stamps="error")


def test_a_wild_stamp_costs_itself():
    time = STEADY.copy()
    time[500] = 1e6
    _, mask, told = _usable(time, time)
    assert np.flatnonzero(~mask).tolist() == [500]
    assert "1 of 2000 samples (0.05 %) are lost" in told.damage[0]


@pytest.mark.parametrize("bad_stamps", ["drop", "error"])
def test_a_copy_loses_nothing(bad_stamps):
    twice = np.repeat(STEADY, 2)
    kept, _, told = _usable(twice, np.sin(twice), bad_stamps=bad_stamps)
    assert kept == pytest.approx(STEADY)
    assert told.damage == []
    assert "2000 of 4000 samples (50 %) are copies" in told.notes[0]


def test_one_stamp_on_two_different_samples_is_a_loss():
    twice, values = np.repeat(STEADY, 2), np.arange(4000.0)
    _, _, told = _usable(twice, values)
    assert "2000 of 4000 samples (50 %) are lost" in told.damage[0]
    with pytest.raises(FlightError, match="repeats the stamp before it at sample 1 "):
        _usable(twice, values, bad_stamps="error")


def test_a_good_clock_is_told_nothing_of():
    kept, mask, told = _usable(STEADY + 1e3, STEADY, bad_stamps="error")
    assert mask.all()
    assert kept == pytest.approx(STEADY + 1e3)
    assert told == Remarks()


def test_streams_of_containers_follow_the_same_rule():
    told = Remarks()
    values = np.arange(4000.0)
    values[7] = np.nan
    made = made_stream("imu", np.repeat(STEADY, 2), {"p": (values, "rad/s")}, remarks=told)
    assert made is not None
    assert told.notes == []
    assert told.damage == [
        "imu: 1 of 4000 samples (0.025 %) are lost because a number is missing or not finite",
        "imu: 1999 of 3999 samples (50 %) are lost because their time repeats or goes backwards",
    ]
    told = Remarks()
    made_stream("imu", np.repeat(STEADY, 2), {"p": (np.repeat(STEADY, 2), "rad/s")}, remarks=told)
    assert told.damage == []
    assert "copies" in told.notes[0]


def test_clocks_that_start_anew_together_cut_all_topics_at_one_place():
    """A slow topic does not see its own restart, and a third one is stamped by a clock that goes on."""
    fast = np.concatenate([STEADY[:500], STEADY[:700]])
    place = np.arange(fast.size, dtype=np.int64)
    slow, own = place[::200], place[::3]
    clocks = [(slow, fast[::200]), (place, fast), (own, 5e3 + own / RATE)]
    (first, last), said = longest_run(clocks)
    assert first == 500
    assert last > place[-1]
    assert "the clock starts anew once" in said
    assert "(41.7 %)" in said
    assert longest_run([(place, place / RATE), (own, 5e3 + own / RATE)])[1] == ""


def test_a_share_is_told_in_percent():
    assert clocked.share(600, 1200) == "600 of 1200 samples (50 %)"
