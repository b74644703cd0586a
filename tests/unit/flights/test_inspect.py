"""`inspect`: rates, gaps, jitter, constants and outliers of flights in which each is put by hand."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from swashplate.control.laws.hold import hover_hold
from swashplate.errors import FlightError
from swashplate.flights.checked import checked
from swashplate.flights.flight import Flight, stream
from swashplate.flights.inspect import inspect
from swashplate.flights.provenance import Event, Provenance
from swashplate.models.catalogue import vehicle
from swashplate.simulation.closed_loop import simulate_maneuver

N = 400


def _flight(time: np.ndarray | None = None, **channels: np.ndarray) -> Flight:
    stamps = np.arange(N) / 100.0 if time is None else time
    waves = {"phi": 0.1 * np.sin(3 * stamps), "servo_roll": np.cos(5 * stamps)} | channels
    return Flight({"log": stream(stamps, waves, {"odd": "furlong"})}, Provenance("a.csv", notes=("a note",)))


def test_a_clean_flight_has_no_problems() -> None:
    found = inspect(_flight())
    assert found.problems == ()
    assert found.notes == ("a note",)
    (log,) = found.streams
    assert (log.n, log.gaps, log.longest_gap) == (N, 0, 0.0)
    assert log.rate == pytest.approx(100.0)
    assert log.jitter == pytest.approx(0.0, abs=1e-12)
    phi = found.channels[0]
    assert (phi.name, phi.unit) == ("phi", "deg")
    assert phi.high == pytest.approx(np.rad2deg(0.1), rel=1e-3)


def test_gaps_are_counted_and_measured() -> None:
    time = np.arange(N) / 100.0
    time[100:] += 0.15
    time[300:] += 0.05
    found = inspect(_flight(time))
    assert (found.streams[0].gaps, found.streams[0].longest_gap) == (2, pytest.approx(0.16))
    assert "log: 2 gaps in the time stamps, the longest 160 ms (usual step 10.0 ms)" in found.problems


def test_a_stream_that_is_slower_for_a_while_has_no_gaps_but_two_rates() -> None:
    """ArduPilot's RATE: 10 Hz in flight, 100 Hz in System ID mode. What is lost within either is a gap still."""
    steps = np.concatenate([np.full(200, 0.1), np.full(2000, 0.01), np.full(200, 0.101)])
    whole = inspect(_flight(np.cumsum(steps)))
    assert whole.streams[0].gaps == 0
    assert whole.problems == ()
    assert whole.notes[-1].startswith("log: recorded at 9.9 Hz and at 100 Hz by turns")
    steps[1000], steps[2300], steps[-1] = 0.08, 0.5, 0.7
    lossy = inspect(_flight(np.cumsum(steps)))
    assert (lossy.streams[0].gaps, lossy.streams[0].longest_gap) == (3, pytest.approx(0.7))


@pytest.mark.parametrize("slow", [5, 9, 13])
def test_a_few_slow_samples_at_the_edge_are_another_rate_and_a_lost_one_is_a_gap(slow: int) -> None:
    steps = np.concatenate([np.full(slow, 0.1), [0.055], np.full(2000, 0.01), [0.1], np.full(slow, 0.101)])
    steps *= 1.0 + 0.02 * np.random.default_rng(slow).standard_normal(steps.size)
    assert inspect(_flight(np.cumsum(steps))).streams[0].gaps == 0
    steps[[900, 1100]] = 0.08, 0.3
    found = inspect(_flight(np.cumsum(steps))).streams[0]
    assert (found.gaps, found.longest_gap) == (2, pytest.approx(0.3))


def test_a_stream_of_one_mode_pauses_in_the_others_and_any_other_pause_is_a_gap() -> None:
    time = np.arange(N) / 100.0
    time[200:] += 7.0
    other = stream(np.arange(1200) / 100.0, {"x": np.sin(np.arange(1200) / 100.0)})
    whole = replace(_flight(time), streams={**_flight(time).streams, "other": other})
    modes = tuple(Event(at, "mode", name) for at, name in ((1.99, "STABILIZE"), (9.0, "SYSTEMID")))
    told = inspect(replace(whole, provenance=Provenance(events=modes)))
    assert (told.streams[0].gaps, told.streams[0].pause) == (0, pytest.approx(7.01))
    assert told.problems == ()
    assert told.notes[-1] == "log: written in some modes only; it pauses for up to 7.01 s in others"
    for events in ((), modes[:1], (replace(modes[0], time=4.0), modes[1])):
        lost = inspect(replace(whole, provenance=Provenance(events=events)))
        assert (lost.streams[0].gaps, lost.streams[0].pause) == (1, 0.0)
        assert any("log: 1 gap in the time stamps, the longest 7010 ms" in text for text in lost.problems)


def test_samples_that_were_lost_at_a_change_of_mode_are_a_gap_and_no_pause() -> None:
    time = np.arange(N) / 100.0
    time[200:] += 0.07
    told = inspect(replace(_flight(time), provenance=Provenance(events=(Event(2.0, "mode", "LOITER"),))))
    assert (told.streams[0].gaps, told.streams[0].pause) == (1, 0.0)
    time[201:] += 0.07
    told = inspect(replace(_flight(time), provenance=Provenance(events=(Event(2.0, "mode", "LOITER"),))))
    assert told.streams[0].gaps == 2


def test_what_stands_still_on_purpose_is_no_problem_and_a_dead_sensor_is() -> None:
    still = ("omega_rotor", "voltage", "pid_d_roll", "p_demand", "rcin_7", "q", "mixer_yaw", "elevator")
    found = inspect(_flight(**{name: np.full(N, 0.5) for name in still}))
    assert found.problems == ("q, mixer_yaw, elevator: never move, so nothing can be learnt from them",)
    assert str(found).count("never moves") == len(still)


def test_a_sweep_between_slow_stretches_holds_no_outliers_but_a_glitch_is_one() -> None:
    """RATE in and out of System ID mode: what moves in the fast part only is no jump of the slow one, nor in it."""
    steps = np.concatenate([np.full(600, 0.1), np.full(2500, 0.01), np.full(150, 0.1), np.full(2500, 0.01)])
    time, fast = np.cumsum(steps), steps < 0.05
    since = time - np.where(time < 95.0, 60.0, 100.0)
    phase = 2.0 * np.pi * (0.3 * since + 0.154 * since**2)
    random = np.random.default_rng(0)
    p = np.where(fast, 0.6 * np.sin(phase), 0.0) + 0.01 * random.standard_normal(time.size)
    mixer_roll = np.where(fast, 0.15 * np.sin(phase + 0.5), 0.0) + 0.005 * random.standard_normal(time.size)
    clean = inspect(_flight(time, p=p, mixer_roll=mixer_roll))
    assert [each.outliers for each in clean.channels] == [0] * len(clean.channels)
    assert clean.problems == ()
    p[300] += 3.0
    assert any("p: 2 jumps" in told for told in inspect(_flight(time, p=p, mixer_roll=mixer_roll)).problems)


def test_jitter_is_the_scatter_of_the_steps() -> None:
    steps = 0.01 + 0.001 * np.random.default_rng(3).standard_normal(20_000)
    time = np.cumsum(steps)
    found = inspect(Flight({"log": stream(time, {"x": np.sin(time)})}))
    assert found.streams[0].jitter == pytest.approx(0.001, rel=0.05)
    assert any("jitter by 1.0" in problem for problem in found.problems)
    even = stream(np.arange(2000) / 100.0, {"even": np.arange(2000.0)})
    both = Flight({"log": stream(time, {"x": np.sin(time)}), "slow": stream(2.0 * time, {"y": time}), "even": even})
    told = [problem for problem in inspect(both).problems if "jitter" in problem]
    assert [text.partition(":")[0] for text in told] == ["log, slow"], "one sentence for all, none for the even one"


def test_constant_missing_and_outlying_channels_are_named() -> None:
    time = np.arange(N) / 100.0
    spiked, holed = np.sin(time), np.cos(time)
    spiked[50] += 5.0
    holed[7] = np.nan
    found = inspect(_flight(x=spiked, y=holed, motor_lower=np.full(N, 0.5)))
    assert "x: 2 jumps beyond 12 robust sigmas (outliers?)" in found.problems  # there and back
    assert "y: 1 samples are not finite" in found.problems
    assert "motor_lower: never moves, so nothing can be learnt from it" in found.problems
    assert len(found.problems) == 3


def test_a_heading_that_passes_south_does_not_jump() -> None:
    heading = np.pi + 0.2 * np.sin(2.0 * np.arange(N) / 100.0)
    wrapped = np.remainder(heading + np.pi, 2.0 * np.pi) - np.pi
    assert np.ptp(wrapped) > 6.0
    assert inspect(_flight(psi=wrapped)).problems == ()
    wrapped[200] += 1.0
    assert any("psi: 2 jumps" in text for text in inspect(_flight(psi=wrapped)).problems)


def test_a_loops_command_may_spike_where_the_mode_changes_and_nowhere_else() -> None:
    """As ArduPilot's did from LOITER to STABILIZE in a log of its own."""
    spiked = 0.001 * np.sin(np.arange(N))
    spiked[50] += 0.2
    flight = _flight(mixer_collective=spiked)
    told = ("mixer_collective: 2 jumps beyond 12 robust sigmas (outliers?)",)
    for at, problems in ((0.45, ()), (0.1, told), (0.6, told)):
        provenance = replace(flight.provenance, events=(Event(at, "mode", "STABILIZE"),))
        assert inspect(replace(flight, provenance=provenance)).problems == problems


def test_a_touch_down_that_two_accelerometers_feel_is_no_outlier_of_the_yaw_rate() -> None:
    turning, down = (0.001 * np.sin(np.arange(N)) for _ in range(2))
    turning[100] -= 1.5
    down[100] -= 30.0
    felt = inspect(_flight(r=turning, az=down, az_imu2=down + 1e-4 * np.cos(np.arange(N)))).problems
    assert not any("r: 2" in text or "2 in r" in text for text in felt)
    assert any("2 in r" in text for text in inspect(_flight(r=turning, az=down)).problems)
    whole = _flight(az=down, az_imu2=down + 1e-4 * np.cos(np.arange(N)), r=turning, p=turning)
    for name in ("az", "r"):  # what a work needs is judged beside what the others felt
        assert checked(whole, used=[name]).provenance.problems == ()
    assert checked(_flight(az=down), used=["az"]).provenance.problems != ()


def test_a_command_may_step_but_not_spike_and_not_leave_its_range() -> None:
    stepped, spiked, wild = (0.001 * np.sin(np.arange(N)) for _ in range(3))
    stepped[100:200] += 0.2
    spiked[50] += 0.2
    wild[-3:] = (1.0, 1.01, 1.2)
    problems = inspect(_flight(servo_roll=stepped, servo_pitch=spiked, motor_upper=0.5 + 0.4 * wild)).problems
    assert problems == ("servo_pitch: 2 jumps beyond 12 robust sigmas (outliers?)",)
    problems = inspect(_flight(servo_roll=wild)).problems
    assert problems == ("servo_roll: 2 samples outside -1 to 1, which no command is",)


@pytest.mark.parametrize("between", [0.0, 1e-17])
@pytest.mark.parametrize("every", [2, 5, 40])
def test_a_channel_that_a_slower_clock_updates_has_no_jumps(between: float, every: int) -> None:
    """Between its updates it holds, or moves by rounding."""
    rng = np.random.default_rng(every)
    held = np.repeat(rng.standard_normal(N // every), every) + between * np.arange(N)
    assert inspect(_flight(x=held)).problems == ()


def test_a_slight_change_of_a_still_channel_is_no_jump_and_a_large_one_is() -> None:
    rng = np.random.default_rng(1)
    slight = np.concatenate([np.linspace(0.0, 5.0, N // 2), 5.0 + 1e-6 * rng.standard_normal(N // 2)])
    slight[300] += 4e-3
    assert inspect(_flight(x=slight)).problems == ()
    slight[300] += 2.0
    assert inspect(_flight(x=slight)).problems == ("x: 2 jumps beyond 12 robust sigmas (outliers?)",)


def test_a_simulated_maneuver_under_a_slow_controller_has_no_jumps() -> None:
    """Commands of a 50 Hz controller in a 100 Hz log stand still at every other sample."""
    flown = simulate_maneuver(vehicle("coax"), "sweep:pitch,2-8Hz,5s", controller=hover_hold)
    assert [problem for problem in inspect(flown).problems if "jump" in problem] == []


def test_a_quaternion_that_flips_its_sign_has_no_outliers_but_one_that_jumps_has() -> None:
    half = 0.1 * np.sin(np.arange(N) / 30.0)
    half[200:] += 0.5
    sign = np.where(np.arange(N) % 90 < 45, 1.0, -1.0)
    quaternion = {"qw": sign * np.cos(half), "qx": sign * np.sin(half), "qy": 0 * half, "qz": 0 * half}
    problems = inspect(_flight(**quaternion)).problems
    assert [text for text in problems if "jump" in text] == ["attitude: 1 jump beyond 12 robust sigmas (outliers?)"]


def test_it_prints_as_text_as_tables_and_as_json() -> None:
    found = inspect(_flight(odd=np.sqrt(np.arange(N)), motor_lower=np.zeros(N)))
    console = Console(width=120, file=io.StringIO())
    console.print(found)
    for text in (str(found), console.file.getvalue()):  # type: ignore[attr-defined]
        for shown in ("a.csv: 4.0 s", "furlong", "not in the schema", "never moves", "a note"):
            assert shown in text
    assert json.loads(json.dumps(found.to_document(), allow_nan=False))["streams"][0]["n"] == N


def test_single_samples_and_nothing_at_all() -> None:
    found = inspect(Flight({"log": stream([1.0], {"x": [2.0]})}))
    assert found.streams[0].n == 1
    assert found.to_document()["streams"][0]["rate"] is None
    assert "x" in str(found)
    assert inspect(Flight({})).channels == ()
    assert "problems: none" in str(inspect(Flight({})))


@pytest.mark.parametrize("huge", [1e31, 1e160, 1.7e308, -1.7e308])
def test_values_that_nothing_measures_are_counted_and_left_out(huge: float) -> None:
    phi = 0.1 * np.sin(3 * np.arange(N) / 100.0)
    phi[50:52] = huge, -huge
    quaternion = {name: np.full(N, 0.5) + 0.1 * phi for name in ("qw", "qx", "qy", "qz")}
    found = inspect(_flight(phi=phi, mixer_roll=np.full(N, huge), odd=phi, **quaternion))
    by_name = {summary.name: summary for summary in found.channels}
    assert by_name["phi"].impossible == 2
    assert by_name["phi"].missing == 0
    assert by_name["phi"].high < 10.0
    assert by_name["mixer_roll"].impossible == N
    assert "phi: 2 samples beyond 1e+30: nothing measures that" in found.problems
    assert "impossible" in str(found)


@pytest.mark.parametrize("tiny", [1e-160, 1e-200, 5e-324])
def test_values_whose_squares_vanish_are_no_sweep(tiny: float) -> None:
    stamps = np.arange(2 * N) / 50.0
    found = inspect(_flight(stamps, mixer_roll=tiny * np.sin(0.3 * stamps**2)))
    assert found.sweeps == ()


@pytest.mark.parametrize("samples", [0, 1, 2])
def test_streams_of_hardly_any_samples(samples: int) -> None:
    short = stream(np.arange(samples), {"x": np.zeros(samples)})
    found = inspect(Flight({"empty": short, "log": _flight().streams["log"]}))
    assert found.streams[0].n == samples
    assert inspect(Flight({"empty": short})).duration == max(0.0, samples - 1.0)


def test_times_that_no_clock_shows_are_refused() -> None:
    with pytest.raises(FlightError, match="reaches 1e\\+200 s: no clock does"):
        stream([0.0, 1e200], {"x": [1.0, 2.0]})


@pytest.mark.parametrize("details", [{}, {"start": "soon"}, {"seen": True}, {"stop": float("nan")}])
def test_a_sweep_of_a_damaged_file_is_named(details: dict[str, object]) -> None:
    whole = {"seen": 3.0, "start": 1.0, "stop": 3.0, "start_hz": 0.5, "stop_hz": 5.0}
    event = Event(1.0, "sweep", "roll", whole)
    flight = replace(_flight(), provenance=Provenance("a.bin", events=(event,)))
    assert len(inspect(flight).sweeps) == 1
    broken = {key: value for key, value in (whole | details).items() if details or key != "seen"}
    flight = replace(flight, provenance=Provenance("a.bin", events=(replace(event, details=broken),)))
    with pytest.raises(FlightError, match=r"a\.bin: events: the sweep at 1 s has .* expected a number"):
        inspect(flight)


def test_what_several_channels_share_is_one_line() -> None:
    """A log of many channels is not a wall of equal lines."""
    rng = np.random.default_rng(3)
    noise = {name: rng.standard_normal(N) for name in ("ax", "ay")}
    for values in noise.values():
        values[200] += 200.0
    still = {name: np.full(N, 0.5) for name in ("p", "q")}
    found = inspect(_flight(**noise, **still)).problems
    assert "p, q: never move, so nothing can be learnt from them" in found
    assert "jumps beyond 12 robust sigmas (outliers?): 2 in ax, 2 in ay" in found
