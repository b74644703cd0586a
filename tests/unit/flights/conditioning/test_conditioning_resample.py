"""One rate from jittered stamps: gaps, segments, aliases, filters, derivatives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conditioning_flights import hover, jittered, sweep, tracked
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import (
    continuous,
    euler_from_quaternion,
    interpolate,
    quaternion_from_euler,
)
from swashplate.flights.conditioning.derive import derive
from swashplate.flights.conditioning.filters import filtered, lowpass, shortest
from swashplate.flights.conditioning.resample import resample, straightened
from swashplate.flights.flight import Flight, stream


def without(flight: Flight, start: float, stop: float) -> Flight:
    """The flight with a hole between two times [s]."""
    return flight.with_streams(
        {n: d.isel(time=(d["time"].values < start) | (d["time"].values > stop)) for n, d in flight.streams.items()}
    )


def test_all_streams_come_onto_one_grid_on_the_truth() -> None:
    flight = resample(sweep(10.0, 1, noise=0.0), rate=100.0)
    assert list(flight.streams) == ["uniform"]
    t = flight.time("x")
    assert np.allclose(np.diff(t), 0.01)
    inner = (t > 1) & (t < 9)
    assert np.max(np.abs(flight.values("x") - 0.2 * np.sin(0.7 * t))[inner]) < 1e-5


def test_short_gaps_are_bridged_and_long_ones_split() -> None:
    flight = without(without(sweep(12.0, 2, noise=0.0), 3.0, 3.04), 6.0, 6.5)
    out = resample(flight, rate=100.0, max_gap=0.06)
    assert len(out.segments) == 2
    (_, first_stop), (second_start, _) = out.segments
    assert 5.9 < first_stop <= 6.0
    assert 6.5 <= second_start < 6.6
    t = out.time("x")
    assert not np.any((t > first_stop + 1e-9) & (t < second_start - 1e-9))
    assert len(out.split()) == 2


def test_bridges_over_holes_in_the_pose_are_told() -> None:
    """With the sample to either side into which the filter carries them. A frame that the rate does not miss is no
    hole, nor is one of the commands."""

    def bridged(flight: Flight) -> list[list[float]]:
        return [list(bridge) for bridge in resample(flight, rate=100.0).history[-1].details["bridged"]]

    t = np.arange(2001) / 200.0
    whole = Flight({"motion": stream(t, {"x": np.sin(t)}), "inputs": stream(t, {"servo_roll": np.cos(t)})})
    (bridge,) = bridged(without(without(whole, 3.0 - 1e-9, 3.04 + 1e-9), 6.0, 6.5))
    np.testing.assert_allclose(bridge, [2.985, 3.055], atol=1e-9)
    assert bridged(whole) == []
    assert bridged(without(whole, 3.0 - 1e-9, 3.0 + 1e-9)) == []
    commands = whole.with_streams({**whole.streams, "inputs": without(whole, 3.0, 3.04).streams["inputs"]})
    assert bridged(commands) == []


def test_pieces_that_are_too_short_are_dropped_and_recorded() -> None:
    flight = without(without(sweep(12.0, 2), 6.0, 6.5), 7.0, 7.5)
    out = resample(flight, rate=100.0)
    details = out.history[-1].details
    assert len(out.segments) == 2
    assert len(details["dropped_pieces"]) == 1
    assert 0.4 < details["dropped_seconds"] < 0.6


def test_nothing_folds_back_when_thinned_out() -> None:
    t = np.arange(3000) / 150.0
    flight = Flight({"a": stream(t, {"x": np.sin(2 * np.pi * 70.0 * t)})})
    thinned = resample(flight, rate=50.0).values("x")
    naive = np.interp(np.arange(0, t[-1], 0.02), t, np.sin(2 * np.pi * 70.0 * t))
    assert naive.std() > 0.3
    assert thinned[20:-20].std() < 0.01 * naive.std()


def test_yaw_is_interpolated_across_its_wrap() -> None:
    t = np.arange(500) / 100.0
    psi = np.angle(np.exp(1j * (2.9 + 0.2 * t)))
    out = resample(Flight({"a": stream(t, {"psi": psi})}), rate=80.0)
    assert np.ptp(np.diff(out.values("psi"))[20:-20]) < 1e-3


def test_errors_name_what_is_wrong() -> None:
    t = np.arange(30) / 150.0
    short = Flight({"a": stream(t, {"x": np.sin(t)})})
    with pytest.raises(FlightError, match=r"lasts 0\.193 s, expected at least 1\.000 s"):
        resample(short)
    with pytest.raises(FlightError, match=r"x: .*1 sample"):
        resample(Flight({"a": stream([0.0], {"x": [1.0]})}))
    with pytest.raises(FlightError, match="rate=-1"):
        resample(short, rate=-1)
    nan = Flight({"a": stream(np.arange(300) / 100, {"x": np.where(np.arange(300) == 5, np.nan, 1.0)})})
    with pytest.raises(FlightError, match="x: 1 of 300 samples are NaN"):
        resample(nan)


def test_straightening_takes_jitter_out_and_keeps_gaps() -> None:
    rng = np.random.default_rng(0)
    true = np.delete(np.arange(2000) / 150.0, slice(900, 920))
    seen = true + rng.uniform(-0.2, 0.2, true.size) / 150.0
    out = straightened(seen)
    assert np.std(out - true) < 0.2 * np.std(seen - true)
    assert np.isclose(np.max(np.diff(out)), 21 / 150.0, atol=1e-3)


def test_the_filter_has_no_phase_and_treats_all_channels_alike() -> None:
    t = np.arange(1000) / 100.0
    wave = np.sin(2 * np.pi * 3.0 * t) + np.sin(2 * np.pi * 35.0 * t)
    flight = Flight({"uniform": stream(t, {"x": wave, "servo_roll": wave})})
    out = lowpass(flight, cutoff=15.0)
    inner = slice(50, -50)
    assert np.max(np.abs(out.values("x") - np.sin(2 * np.pi * 3.0 * t))[inner]) < 2e-3
    np.testing.assert_array_equal(out.values("x"), out.values("servo_roll"))


@pytest.mark.parametrize(("order", "cutoff"), [(2, 10.0), (3, 10.0), (4, 10.0), (4, (1.0, 10.0)), (3, (1.0, 10.0))])
def test_the_shortest_record_is_just_long_enough(order: int, cutoff: float | tuple[float, float]) -> None:
    n = shortest(order, band=isinstance(cutoff, tuple))
    values = np.sin(np.arange(n, dtype=float))
    assert filtered(values, rate=100.0, cutoff=cutoff, order=order).shape == (n,)
    with pytest.raises(FlightError, match=f"{n - 1} samples .* needs {n} samples"):
        filtered(values[1:], rate=100.0, cutoff=cutoff, order=order)


def test_a_piece_shorter_than_one_period_of_the_corner_is_an_error() -> None:
    t = np.arange(400) / 100.0
    flight = Flight({"uniform": stream(t, {"x": np.sin(t)})}, segments=((0.0, 2.5), (2.6, 3.99)))
    assert lowpass(flight, cutoff=0.8).channels == ("x",)
    with pytest.raises(FlightError, match=r"a piece of 1\.390 s is too short for a filter of 0\.5 Hz.*2\.000 s"):
        lowpass(flight, cutoff=0.5)


def test_a_corner_above_half_the_rate_is_an_error() -> None:
    with pytest.raises(FlightError, match=r"60\.0.* 100 Hz"):
        filtered(np.zeros(100), rate=100.0, cutoff=60.0)


def test_quaternions_keep_their_sign_and_come_back_as_angles() -> None:
    rng = np.random.default_rng(1)
    euler = np.stack([0.3 * np.sin(np.arange(400) / 30), 0.2 * np.cos(np.arange(400) / 20), np.arange(400) / 40], -1)
    q = quaternion_from_euler(euler)
    flipped = q * rng.choice([-1.0, 1.0], (400, 1)) * rng.uniform(0.9, 1.1, (400, 1))
    again = continuous(flipped)
    assert np.all(np.sum(again[1:] * again[:-1], axis=1) > 0)
    np.testing.assert_allclose(euler_from_quaternion(again), euler, atol=1e-12)
    t = np.arange(400) / 100.0
    middle = interpolate(t[::2], again[::2], t[1:-1])
    apart = (
        Rotation.from_quat(middle[:, [1, 2, 3, 0]]).inv() * Rotation.from_quat(again[1:-1][:, [1, 2, 3, 0]])
    ).magnitude()
    assert apart.max() < 1e-3
    with pytest.raises(FlightError, match="sample 3"):
        continuous(np.where(np.arange(6)[:, None] == 3, 0.0, q[:6]))


def test_rates_velocities_and_specific_force_are_those_of_the_truth() -> None:
    truth = hover(12.0, 3)
    out = derive(lowpass(resample(tracked(truth, 3, noise=0.0), rate=100.0, method="pchip"), cutoff=20.0))
    t = out.time("x")
    inner = (t > 1) & (t < t[-1] - 1)
    turn = truth.rotation()
    omega = (turn[:-1].inv() * turn[1:]).as_rotvec() / 1e-3
    velocity = turn.inv().apply(np.gradient(truth.position, truth.time, axis=0))
    for k, (rate, speed) in enumerate(zip("pqr", "uvw", strict=True)):
        want = np.interp(t, truth.time[:-1] + 5e-4, omega[:, k])
        assert np.std((out.values(rate) - want)[inner]) < 0.02 * want.std()
        want = np.interp(t, truth.time, velocity[:, k])
        assert np.std((out.values(speed) - want)[inner]) < 0.02 * want.std()
    assert np.std(out.values("ax")[inner]) < 0.05
    assert abs(np.mean(out.values("az")[inner]) + 9.80665) < 0.02


def test_measured_rates_are_not_overwritten() -> None:
    rng = np.random.default_rng(0)
    t = jittered(5.0, 100.0, rng)
    angles = {name: 0.1 * np.sin(t) for name in ("phi", "theta", "psi")}
    flight = Flight({"a": stream(t, {**angles, "p": np.full(t.size, 7.0)})})
    out = derive(resample(flight))
    assert np.allclose(out.values("p"), 7.0)
    assert out.history[-1].details["derived"] == ["q", "r"]


def test_slow_commands_beside_fast_motion_keep_their_size() -> None:
    """Commands at the new rate come through as they are, whatever the other streams need against aliases."""
    slow, fast = np.arange(1001) / 100.0, np.arange(2001) / 200.0
    command = np.sin(2 * np.pi * 8.0 * slow)
    flight = Flight({"inputs": stream(slow, {"servo_pitch": command}), "motion": stream(fast, {"theta": np.sin(fast)})})
    out = resample(flight, rate=100.0)
    assert np.allclose(out.values("servo_pitch"), np.interp(out.time("servo_pitch"), slow, command), atol=1e-12)
    assert np.max(np.abs(out.values("theta") - np.sin(out.time("theta")))) < 2e-3


@pytest.mark.parametrize("offset", [0.0, 0.013])
def test_a_spline_keeps_what_lines_between_slow_samples_lose(offset: float) -> None:
    t, slow = np.arange(2000) / 100.0, offset + np.arange(480) / 25.0
    hertz = 25.0 / 3.0
    flight = Flight({"fast": stream(t, {"x": t}), "slow": stream(slow, {"az": np.sin(2 * np.pi * hertz * slow)})})

    def gain(method: str) -> float:
        out = resample(flight, rate=100.0, method=method)
        assert out.history[-1].details["slower"] == {"az": 25.0}
        time = out.time("az")
        inner = (time > 2.0) & (time < 17.0)
        return 20 * np.log10(np.abs(2 * np.mean((out.values("az") * np.exp(-2j * np.pi * hertz * time))[inner])))

    assert abs(gain("spline")) < 0.2
    assert gain("linear") < -2.5


def test_a_spline_does_not_swing_across_a_hole() -> None:
    t = np.arange(1000) / 100.0
    flight = without(Flight({"a": stream(t, {"x": np.where(t < 5.0, 0.0, 100.0)})}), 4.0, 6.0)
    x = resample(flight, rate=100.0, method="spline")
    assert np.all(np.isclose(x.values("x"), 0.0) | np.isclose(x.values("x"), 100.0))
