"""Rates, attitude, velocities, positions and weight against each other: right logs pass, each wrong one is named."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from conditioning_flights import hover, tracked
from swashplate.errors import FlightError
from swashplate.flights import consistency as consistency_module
from swashplate.flights.agreement import thinned
from swashplate.flights.conditioning.condition import condition, replay
from swashplate.flights.consistency import consistency, refuse_inconsistent
from swashplate.flights.flight import Flight, stream
from swashplate.flights.inspect import inspect
from swashplate.flights.readers.read import read
from swashplate.flights.schema import ATTITUDE, RATES
from swashplate.identification.responses.respond import respond

DEGREE = 180.0 / np.pi


@cache
def flown(*, heading: bool = True, delay: float = 0.0) -> Flight:
    """30 s of hover: angles and positions at 50 Hz, gyroscopes and accelerometers at 100 Hz with noise and a delay."""
    motion, rng = hover(30.0, 4), np.random.default_rng(4)
    turn = motion.rotation()
    omega = (turn[:-1].inv() * turn[1:]).as_rotvec() / 1e-3
    velocity = np.gradient(motion.position, motion.time, axis=0)
    force = turn.inv().apply(np.gradient(velocity, motion.time, axis=0) - [0.0, 0.0, 9.80665])
    slow, fast = np.arange(0.5, 29.0, 0.02), np.arange(0.503, 29.0, 0.01)

    def seen(at: np.ndarray, values: np.ndarray, noise: float, late: float = 0.0) -> np.ndarray:
        return np.interp(at - late, motion.time[: values.size], values) + noise * rng.standard_normal(at.size)

    angles = {n: seen(slow, motion.euler[:, k], 1e-3) for k, n in enumerate(ATTITUDE) if heading or n != "psi"}
    place = {n: seen(slow, motion.position[:, k], 1e-4) for k, n in enumerate("xyz")}
    moving = {n: seen(slow, velocity[:, k], 1e-3) for k, n in enumerate(("vx", "vy", "vz"))}
    inertial = {n: seen(fast, omega[:, k], 0.02, delay) for k, n in enumerate(RATES)}
    inertial |= {n: seen(fast, force[:, k], 0.05, delay) for k, n in enumerate(("ax", "ay", "az"))}
    return Flight({"motion": stream(slow, angles | place | moving), "imu": stream(fast, inertial)})


def changed(flight: Flight, **channels: np.ndarray) -> Flight:
    for name, values in channels.items():
        flight = flight.with_channel(name, values, like=name)
    return flight


@pytest.mark.parametrize("options", [{}, {"heading": False}, {"delay": 0.05}], ids=["whole", "-psi", "late"])
def test_a_right_log_passes(options: dict[str, Any]) -> None:
    flight = flown(**options)
    assert consistency(flight) == ()
    refuse_inconsistent(flight)


@pytest.mark.parametrize("heading", [True, False])
@pytest.mark.parametrize("name", ["p", "q"])
@pytest.mark.parametrize(
    ("factor", "words", "mend"),
    [
        (DEGREE, "looks like deg/s, not rad/s", "--unit {}=deg/s"),
        (-1.0, "has the other sign", "--unit {}=-rad/s"),
        (-DEGREE, "looks like deg/s, not rad/s and has the other sign", "--unit {}=-deg/s"),
        (1.0 / DEGREE, "57.3 times too small", "units of both"),
    ],
)
def test_a_wrong_rate_is_named_with_its_number(heading: bool, name: str, factor: float, words: str, mend: str) -> None:
    whole = flown(heading=heading)
    (finding,) = consistency(changed(whole, **{name: factor * whole.values(name)}))
    assert (finding.channel, finding.decisive) == (name, True)
    assert words in finding.text
    number = re.search(r"ratio (\S+) ", finding.text)
    assert number is not None
    assert float(number[1]) == pytest.approx(factor, rel=0.05)
    assert mend.format(name) in finding.mend


@pytest.mark.parametrize(("angle", "rate"), [("phi", "p"), ("theta", "q")])
@pytest.mark.parametrize("factor", [1.0, -1.0, DEGREE])
def test_one_angle_alone_tells_of_its_own_rate(angle: str, rate: str, factor: float) -> None:
    """A rig that turns about one axis; on its back theta goes the other way than q, so that q is not refused."""
    whole = flown()
    alone = Flight.from_arrays(whole.time(angle), {angle: whole.values(angle)}, source="rig.csv")
    imu = stream(whole.time("p"), {name: factor * whole.values(name) for name in RATES})
    found = consistency(Flight({**alone.streams, "imu": imu}))
    assert [one.channel for one in found] == ([] if factor == 1.0 else [rate])
    assert all(one.decisive == (angle == "phi") for one in found)


@pytest.mark.parametrize(("one", "other"), [("p", "q"), ("q", "r"), ("p", "r"), ("vx", "vy")])
def test_exchanged_axes_are_named(one: str, other: str) -> None:
    flight = flown()
    found = consistency(changed(flight, **{one: flight.values(other), other: flight.values(one)}))
    assert {finding.channel for finding in found} == {one, other}
    assert all("axes seem to be exchanged" in finding.text for finding in found)


def test_velocities_weight_and_angles_are_held_against_the_rest() -> None:
    flight = flown()
    for channel, factor, words in (
        ("vz", -1.0, "has the other sign"),
        ("vx", 1e3, "looks like mm/s"),
        ("az", -1.0, "has the other sign"),
        ("az", 1.0 / 9.80665, "looks like g, not m/s^2"),
    ):
        (finding,) = consistency(changed(flight, **{channel: factor * flight.values(channel)}))
        assert finding.channel == channel
        assert words in finding.text
    angles = {name: DEGREE * flight.values(name) for name in ATTITUDE}
    found = consistency(changed(flight, **angles))
    assert found[0].channel == "theta"
    assert "looks like degrees" in found[0].text
    assert {finding.channel for finding in found} == {"theta"}  # the rest is judged with the angles put right


@pytest.mark.parametrize("factor", [1.25, 0.8, 1.08, 0.92])
@pytest.mark.parametrize("name", ["p", "q", "r", "vx", "vz"])
def test_a_scale_error_is_told_with_its_factor_and_stops_nothing(name: str, factor: float) -> None:
    flight = changed(flown(), **{name: factor * flown().values(name)})
    (finding,) = consistency(flight)
    assert (finding.channel, finding.decisive) == (name, False)
    assert finding.scale is not None
    told, sigma = finding.scale
    assert abs(told - factor) < max(3.0 * sigma, 0.01)
    assert sigma < 0.02
    assert f"{name}: is {told:.4g} ± {sigma:.1g} times what the" in str(finding)
    assert f"factor = {1.0 / told:.4g}" in finding.mend
    refuse_inconsistent(flight)


def test_an_estimator_s_corrections_are_no_scale_error() -> None:
    """Place and velocity of one message whose units the format fixes; a sign, or another message, still is told."""
    wrong = changed(flown(), vy=1.08 * flown().values("vy"))
    (finding,) = consistency(wrong)
    assert finding.scale is not None
    of_format = replace(wrong, provenance=replace(wrong.provenance, reader="ardupilot"))
    assert consistency(of_format) == ()
    gross = changed(of_format, vy=1.5 * of_format.values("vy"))
    assert [one.channel for one in consistency(gross)] == ["vy"]
    turned = changed(of_format, vy=-of_format.values("vy"))
    assert [one.channel for one in consistency(turned)] == ["vy"]
    gyro = changed(of_format, p=1.08 * of_format.values("p"))
    assert [one.channel for one in consistency(gyro)] == ["p"]


@pytest.mark.parametrize("factor", [1.0, 1.02, 0.98])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_slight_factor_and_noise_on_either_side_are_no_scale_error(factor: float, noise: float) -> None:
    """Half as much noise as motion in the band: the plain ratio of sizes would be 1.1, or 0.9."""
    whole, rng = flown(), np.random.default_rng(5)
    p, phi = whole.values("p"), whole.values("phi")
    moves = np.convolve(rng.standard_normal(p.size), np.hanning(25), "same")
    noisy_rate = factor * p + noise * np.std(p) * moves / np.std(moves)
    assert consistency(changed(whole, p=noisy_rate)) == ()
    shaken = np.convolve(rng.standard_normal(phi.size), np.hanning(25), "same")
    noisy_angle = phi + 0.2 * noise * np.std(phi) * shaken / np.std(shaken)
    assert consistency(changed(whole, p=factor * p, phi=noisy_angle)) == ()


@pytest.mark.parametrize("corner", [1.0, 2.0, 5.0])
def test_a_filter_is_no_scale_error(corner: float) -> None:
    """A minute of motion from 0.1 to 3 Hz: slow motion passes a low-pass whole."""
    time, rng = np.arange(0.0, 60.0, 0.01), np.random.default_rng(2)
    phi = sum(
        0.1 / f * np.sin(2.0 * np.pi * f * time + a) for f, a in zip(*rng.uniform(0.1, 6.0, (2, 40)), strict=True)
    )
    p = np.gradient(np.asarray(phi), time)
    late = lfilter([1.0 - np.exp(-0.02 * np.pi * corner)], [1.0, -np.exp(-0.02 * np.pi * corner)], p)
    log = Flight.from_arrays(time, {"phi": phi, "theta": 0.0 * time, "p": late}, source="late.csv")
    assert [finding for finding in consistency(log) if finding.scale] == []
    wrong = log.with_channel("p", 1.25 * p, like="p")
    assert [finding.channel for finding in consistency(wrong)] == ["p"]


def test_a_unit_that_the_format_fixes_is_doubted_only_where_the_ratio_is_exact() -> None:
    """The speed of a copter in a still hover: a third of what the noise of its place gives."""
    whole = flown()
    for factor, words in ((1.0 / 3.28084, "converted twice"), (0.38, "is 0.38")):
        for reader in ("ardupilot", "delimited"):
            flight = changed(whole, vx=factor * whole.values("vx"))
            flight = replace(flight, provenance=replace(flight.provenance, reader=reader))
            (finding,) = consistency(flight)
            doubted = reader == "delimited" or "twice" in words
            assert ("converted twice" in finding.text, finding.decisive) == (doubted, doubted)


def test_what_an_estimator_makes_of_a_still_hover_is_no_unit() -> None:
    """The velocity follows what moves, and a third of what the place jitters when nothing does."""
    whole = flown()
    time = whole.time("x")
    moving = time < 10.0
    x = whole.values("x") * np.where(moving, 1.0, 0.1)
    speed = np.gradient(x, time) * np.where(moving, 1.0, 0.35)
    assert consistency(changed(whole, x=x, vx=speed)) == ()
    (finding,) = consistency(changed(whole, x=x, vx=0.35 * np.gradient(x, time)))
    assert "3.28 times too small" in finding.text


def test_an_axis_that_does_not_move_says_nothing() -> None:
    flight = flown()
    noise = 1e-3 * np.random.default_rng(1).standard_normal(flight.time("phi").size)
    still = changed(flight, phi=noise, p=-0.02 * np.random.default_rng(2).standard_normal(flight.time("p").size))
    assert consistency(still) == ()


def test_inspect_says_it_and_conditioning_refuses_it_or_takes_it_as_told() -> None:
    flight = changed(flown(), q=-flown().values("q"))
    assert any(problem.startswith("q: has the other sign") for problem in inspect(flight).problems)
    with pytest.raises(FlightError, match=r"q: has the other sign.*--unit q=-rad/s"):
        condition(flight, rate=50)
    taken = condition(flight, rate=50, check=False, trim_ground=False)
    refuse_inconsistent(taken)
    np.testing.assert_array_equal(replay(flight, taken.history).values("q"), taken.values("q"))


def test_what_conditioning_derived_is_no_measurement() -> None:
    made = condition(tracked(hover(20.0, 2), 2), trim_ground=False)
    flipped = made.with_channel("p", -made.values("p"), like="p")
    assert consistency(flipped) == ()  # p is attitude's own derivative here: nothing was measured


@pytest.mark.parametrize(
    ("given", "mend"),
    [("deg/s", "--unit p=-deg/s"), ("-rad/s", "--unit p=-deg/s"), ("rad/s", "--unit p=-deg/s"), ("-deg/s", None)],
)
def test_the_remedy_is_one_whatever_the_file_was_read_with(given: str, mend: str | None, tmp_path: Path) -> None:
    """A roll rate in deg/s with its sign turned: the option replaces the header's unit, sign and all."""
    time = np.arange(0.0, 30.0, 0.02)
    phi = 20.0 * np.sin(2.0 * time) + 5.0 * np.sin(5.1 * time)
    table = np.column_stack([time, phi, np.cos(time), -np.gradient(phi, time)])
    path = tmp_path / "turned.csv"
    np.savetxt(path, table, delimiter=",", header="time [s],phi [deg],theta [deg],p [deg/s]", comments="")
    found = [each for each in consistency(read(path, units={"p": given})) if each.channel == "p"]
    assert [each.mend for each in found] == ([] if mend is None else [f"Give {mend}."])
    if found:
        with pytest.raises(FlightError, match=r"p: .*--unit p=-deg/s"):
            respond(read(path, units={"p": given}), inputs=["theta"], outputs=["p"])


@pytest.mark.parametrize(
    ("copied", "words"), [(False, ""), (True, "moves with what the attitude's change gives for q")]
)
def test_axes_that_move_together_are_not_exchanged(copied: bool, words: str) -> None:
    """A rough roll angle in a motion of both axes: p agrees better with pitch than with roll, and q with pitch best."""
    rng, time = np.random.default_rng(1), np.arange(6000) / 100.0
    both, own = (np.convolve(rng.standard_normal(time.size), np.hanning(60), "same") / 5.0 for _ in range(2))
    angles = {"phi": 0.1 * both + 0.05 * own, "theta": 0.1 * both}
    rates = {name: np.gradient(angle, time) for name, angle in zip("pq", angles.values(), strict=True)}
    noise = {"phi": 0.3, "theta": 0.005, "p": 0.05, "q": 0.05}
    seen = {n: v + noise[n] * rng.standard_normal(time.size) for n, v in (angles | rates).items()}
    flight = Flight.from_arrays(time, seen | ({"p": seen["q"]} if copied else {}), source="both")
    told = [str(finding) for finding in consistency(flight)]
    assert bool(told) == bool(words), told
    assert all(text.startswith("p: ") and words in text for text in told)


def fast_log(*, sign: float = 1.0) -> Flight:
    """A minute at 1 kHz that turns round and round, shakes at 49 Hz, and pauses for half a second."""
    time = np.arange(0.0, 60.0, 1e-3)
    time = time[(time < 30.0) | (time > 30.5)]
    turned = 2.0 * time + 0.5 * np.sin(1.7 * time)  # the heading passes its wrap many times
    phi = 0.3 * np.sin(2.1 * time) + 0.1 * np.sin(5.0 * time)
    shake = 3.0 * np.sin(2.0 * np.pi * 49.0 * time)
    p = 0.63 * np.cos(2.1 * time) + 0.5 * np.cos(5.0 * time)
    still = np.zeros_like(time)
    psi = np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi
    turn = 2.0 + 0.85 * np.cos(1.7 * time)
    rates = {"p": sign * p + shake, "q": turn * np.sin(phi), "r": turn * np.cos(phi) + shake}
    return Flight({"imu": stream(time, {"phi": phi, "theta": still, "psi": psi, **rates})})


def test_a_fast_log_is_averaged_down_and_judged_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    rows: list[int] = []
    inner = consistency_module.quaternion_from_euler
    monkeypatch.setattr(
        consistency_module, "quaternion_from_euler", lambda table: rows.append(len(table)) or inner(table)
    )
    assert consistency(fast_log()) == ()
    assert 60 * 50 < rows[0] + 60 < 60 * 100, "between 50 and 100 Hz of a minute"
    (finding,) = consistency(fast_log(sign=-1.0))
    assert (finding.channel, "other sign" in finding.text) == ("p", True)


def test_stamps_that_hardly_differ_are_no_reason_to_stop() -> None:
    """Times of a damaged log: the number of samples in a block would be infinite."""
    time = np.arange(50) * 5e-324
    stamps, table = thinned(time, np.ones((50, 3)))
    assert (stamps.shape, table.shape) == ((50,), (50, 3))


def test_a_log_in_many_pieces_turns_each_sample_of_its_attitude_once(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, turned = flown(), 0
    parts = {
        name: data.isel(time=np.flatnonzero(data["time"].values % 10.0 < 9.0)) for name, data in whole.streams.items()
    }
    turn = consistency_module.interpolate

    def counting(time: np.ndarray, quaternion: np.ndarray, grid: np.ndarray) -> np.ndarray:
        nonlocal turned
        turned += time.size
        assert np.abs(np.sum(turn(time, quaternion, grid) * turn(*every, grid), axis=1)) == pytest.approx(
            1.0, abs=1e-12
        )
        return turn(time, quaternion, grid)

    cut = Flight(parts)
    attitude = consistency_module._attitude(cut, [])
    assert attitude is not None
    every = (attitude.time, attitude.quaternion)
    monkeypatch.setattr(consistency_module, "interpolate", counting)
    assert consistency(cut) == ()
    several = 4  # rates, velocities of either axes, weight
    assert attitude.time.size < turned < several * attitude.time.size
    assert [one.channel for one in consistency(changed(cut, q=-cut.values("q")))] == ["q"]
