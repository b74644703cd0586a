"""Sweeps: told by the log, seen in a signal, and not seen where there is none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from conditioning_flights import sweep as linear_sweep
from made_autopilot_logs import ardupilot_rows, dataflash
from swashplate.flights.flight import Flight, stream
from swashplate.flights.inspect import inspect
from swashplate.flights.maneuvers import sweeps as sweeps_module
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.maneuvers.sweep_tracking import Ridge
from swashplate.flights.maneuvers.sweeps import rising, sweeps
from swashplate.flights.provenance import Event, Provenance
from swashplate.flights.readers.read import read

TIME = np.arange(12_000) / 100.0


def _flight(**channels: np.ndarray) -> Flight:
    return Flight({"log": stream(TIME, channels)})


def _swept(seed: int, *, noise: float, start: float = 20.0) -> np.ndarray:
    signal = parse("sweep:roll,0.3-10Hz,60s,0.1").signals(TIME - start)["roll"]
    return np.asarray(signal + noise * np.random.default_rng(seed).standard_normal(TIME.size))


@pytest.mark.parametrize("noise", [0.001, 0.03])
def test_a_sweep_is_seen_with_its_times_and_band(noise: float) -> None:
    (found,) = sweeps(_flight(servo_roll=_swept(1, noise=noise), servo_pitch=np.sin(TIME) * 0.01))
    assert (found.axis, found.channel, found.source) == ("roll", "servo_roll", "signal")
    assert found.start == pytest.approx(20.0, abs=5.0)  # the first wave lasts 3.3 s and fades in
    assert found.stop == pytest.approx(80.0, abs=2.0)
    assert found.low == pytest.approx(0.3, rel=0.35)
    assert found.high == pytest.approx(10.0, rel=0.2)
    assert "roll: " in str(found)
    assert "seen in servo_roll" in str(found)


def test_two_sweeps_in_one_record_on_two_axes() -> None:
    first = parse("sweep:roll,0.5-8Hz,40s,0.1").signals(TIME - 5.0)["roll"]
    second = parse("sweep:pitch,0.5-8Hz,40s,0.2").signals(TIME - 70.0)["pitch"]
    rng = np.random.default_rng(2)
    found = sweeps(
        _flight(
            mixer_roll=first + 0.1 * second + 0.002 * rng.standard_normal(TIME.size),
            mixer_pitch=second + 0.1 * first + 0.002 * rng.standard_normal(TIME.size),
        )
    )
    assert [(s.axis, s.channel) for s in found] == [("roll", "mixer_roll"), ("pitch", "mixer_pitch")]
    assert [s.stop for s in found] == pytest.approx([45.0, 110.0], abs=2.0)


def test_a_linear_sweep_of_a_recorded_flight_is_seen() -> None:
    (found,) = sweeps(linear_sweep(40.0, 3))
    assert (found.axis, found.channel) == ("pitch", "servo_pitch")
    assert found.high == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize("kind", ["white", "walk", "resonance", "steps", "tone", "doublets"])
def test_what_is_no_sweep_is_not_seen(kind: str) -> None:
    for seed in range(5):
        white = np.random.default_rng(seed).standard_normal(TIME.size)
        signal = {
            "white": white,
            "walk": 0.1 * np.cumsum(white),
            "resonance": lfilter([1.0], [1.0, -1.98, 0.99], white),
            "steps": np.repeat(white[:120], 100),
            "tone": np.sin(9.0 * TIME) + 0.1 * white,
            "doublets": parse("3211:roll,1s,1").signals(TIME % 20.0)["roll"] + 0.05 * white,
        }[kind]
        assert rising(TIME, np.asarray(signal)) is None


def test_no_sweep_crosses_a_change_of_mode() -> None:
    """A resonance that moves up with the mode is no sweep; nor is what a sweep and the next mode's motion make."""
    mode = tuple(Event(at, "mode", name) for at, name in ((0.0, "LOITER"), (50.0, "POSHOLD")))
    one = Flight({"log": stream(TIME, {"mixer_roll": _swept(1, noise=0.001)})}, Provenance(events=mode))
    for found in sweeps(one):
        assert found.stop <= 50.0 or found.start >= 50.0
    assert [found.stop for found in sweeps(one)] == pytest.approx([50.0, 80.0], abs=2.0)
    quick, slow = (parse(f"sweep:roll,{band}Hz,30s,0.1") for band in ("2-4.5", "0.6-1.9"))
    joined = np.asarray(slow.signals(TIME - 20.0)["roll"] + quick.signals(TIME - 50.0)["roll"])
    (both,) = sweeps(_flight(mixer_roll=joined))
    assert both.start < 40.0 < 60.0 < both.stop  # it is one where no mode parts it
    parted = sweeps(Flight({"log": stream(TIME, {"mixer_roll": joined})}, Provenance(events=mode)))
    assert all(found.stop <= 50.0 or found.start >= 50.0 for found in parted)


def test_a_sweep_in_a_set_point_counts_where_the_loop_hides_it_in_the_command() -> None:
    rng = np.random.default_rng(1)
    swept, noise = _swept(2, noise=0.001), rng.standard_normal(TIME.size)
    (found,) = sweeps(_flight(mixer_roll=noise + 0.1 * swept, p_demand=swept))
    assert (found.axis, found.channel) == ("roll", "p_demand")
    (found,) = sweeps(_flight(mixer_roll=swept, p_demand=10.0 * swept))
    assert found.channel == "mixer_roll"


def test_a_resonance_that_outlasts_a_sweep_does_not_hide_it() -> None:
    rng = np.random.default_rng(3)
    ringing = lfilter([1.0], [1.0, -0.62, 0.998], rng.standard_normal(TIME.size))  # at 20 Hz, hardly damped
    signal = _swept(1, noise=0.001) + 0.07 * ringing / np.std(ringing)
    ridge = rising(TIME, np.asarray(signal))
    assert ridge is not None
    assert ridge.frequency[0] < 1.0
    assert ridge.frequency[-1] == pytest.approx(10.0, rel=0.3)
    assert rising(TIME, np.asarray(ringing)) is None


def test_short_and_constant_signals_hold_none() -> None:
    assert rising(TIME[:1], TIME[:1]) is None
    assert rising(TIME[:200], np.sin(TIME[:200])) is None
    assert rising(TIME, np.ones(TIME.size)) is None
    assert sweeps(Flight({})) == ()


def test_what_the_log_tells_is_not_told_twice(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(dataflash(ardupilot_rows()))
    flight = read(tmp_path / "a.bin")
    (told,) = sweeps(flight)
    assert (told.axis, told.source, told.channel, told.complete) == ("roll mixer", "log", "sid_target", True)
    assert (told.low, told.high) == (0.5, 8.0)
    blind = replace(flight, provenance=replace(flight.provenance, events=()))
    (seen,) = sweeps(blind)
    assert seen.source == "signal"
    assert seen.stop == pytest.approx(told.stop, abs=1.0)
    assert sweeps(flight.between(20.0, 21.0)) == ()
    (part,) = sweeps(flight.between(20.0, 30.0))
    assert not part.complete
    assert part.stop == pytest.approx(30.0, abs=0.1)


def test_inspect_lists_sweeps_and_damage(tmp_path: Path) -> None:
    content = dataflash(ardupilot_rows())
    (tmp_path / "a.bin").write_bytes(content[: 2 * len(content) // 3])
    found = inspect(read(tmp_path / "a.bin"))
    assert not found.sweeps[0].complete
    assert set(found.damage) <= set(found.problems)
    text = str(found)
    for part in ("sweeps:", "roll mixer: 22.00 to", "not flown to its end", "the log is cut off", "HELI"):
        assert part in text
    assert found.to_document()["sweeps"][0]["axis"] == "roll mixer"


def test_a_sweep_has_no_jumps_though_its_changes_grow() -> None:
    flight = _flight(p=_swept(4, noise=1e-4))
    assert inspect(flight).problems == ()
    spiked = _swept(4, noise=1e-4)
    spiked[6000] += 1.0
    assert inspect(_flight(p=spiked)).problems == ("p: 2 jumps beyond 12 robust sigmas (outliers?)",)


def _hours(hours: float, *, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Stamps at 25 Hz, and noise with sweeps: one over the end of the first window, and one that lasts ten minutes."""
    time = np.arange(int(hours * 3600.0 * 25.0)) / 25.0
    signal = 0.002 * np.random.default_rng(seed).standard_normal(time.size)
    for start, words in ((600.0, "0.3-8Hz,60s"), (1770.0, "0.3-8Hz,60s"), (4900.0, "0.1-8Hz,600s")):
        signal += parse(f"sweep:roll,{words},0.1").signals(time - start)["roll"]
    return time, signal


def test_a_long_log_is_searched_in_windows_and_no_sweep_is_cut() -> None:
    time, signal = _hours(3.0, seed=1)
    found = sweeps(Flight({"log": stream(time, {"mixer_roll": signal})}))
    assert [s.stop for s in found] == pytest.approx([660.0, 1830.0, 5495.0], abs=5.0)
    assert [s.start for s in found] == pytest.approx([600.0, 1770.0, 4900.0], abs=15.0)
    for one in found:
        near = (time > one.start - 100.0) & (time < one.stop + 100.0)
        alone = rising(time[near], signal[near])
        assert alone is not None
        assert (one.start, one.stop) == pytest.approx((alone.start, alone.stop), abs=1.0)


def test_hours_of_noise_hold_no_sweep_and_need_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    longest = []
    search = sweeps_module.rising

    def watched(time: np.ndarray, values: np.ndarray) -> Ridge | None:
        longest.append(float(np.ptp(time)))
        return search(time, values)

    monkeypatch.setattr(sweeps_module, "rising", watched)
    time = np.arange(5 * 36_000) / 10.0
    noise = lfilter([1.0], [1.0, -0.9], np.random.default_rng(7).standard_normal(time.size))
    assert sweeps(Flight({"log": stream(time, {"mixer_roll": np.asarray(noise)})})) == ()
    assert sum(longest) > 4.9 * 3600.0, "all of it is searched"
    assert max(longest) < 3600.0, "no scalogram of all"
